# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""security/policies.xml beside what running nodes have, over DDS."""

from __future__ import annotations

import os
from fnmatch import fnmatchcase
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from rclpy.context import Context
from rclpy.node import Node, NodeNameNonExistentError
from sensor_msgs.msg import CameraInfo

from focus_planner import Mesh, PointCloud, cylinder_rig
from focus_planner.lenses.profiles import CAMERA, PROFILES
from focus_planner.ros.client import PlannerClient
from testing.forked import run_forked
from testing.ros.calls import WAITING, until
from testing.ros.lens_processes import LensProcess
from testing.ros.planner_process import PlannerProcess

POLICY = Path(__file__).parents[2] / "security" / "policies.xml"
# The schema of SROS 2, 0.2.0: what an element may hold, and its attributes.
SCHEMA = {
    "policy": ({"enclaves"}, {"version"}),
    "enclaves": ({"enclave"}, set()),
    "enclave": ({"profiles"}, {"path"}),
    "profiles": ({"profile"}, set()),
    "profile": ({"topics", "services", "actions"}, {"ns", "node"}),
    "topics": ({"topic"}, {"publish", "subscribe"}),
    "services": ({"service"}, {"request", "reply"}),
    "actions": ({"action"}, {"call", "execute"}),
    "topic": (set(), set()),
    "service": (set(), set()),
    "action": (set(), set()),
}
KINDS = ("publisher", "subscriber", "service", "client")
KIND = {"publish": "publisher", "subscribe": "subscriber", "reply": "service", "request": "client"}
ACTION = {"execute": ("service", "publisher"), "call": ("client", "subscriber")}
PARTS = (("send_goal", "cancel_goal", "get_result"), ("feedback", "status"))


# --- the policy ------------------------------------------------------------------------------


def full_name(name, profile):
    namespace = profile.get("ns").rstrip("/")
    return name.replace("~", f"{namespace}/{profile.get('node')}", 1)


def allowed(enclave):
    """Return the names that an enclave may have, patterns, by kind, as SROS 2 reads them."""
    found = {kind: set() for kind in KINDS}
    for profile in POLICY_TREE.findall(f"enclaves/enclave[@path='{enclave}']/profiles/profile"):
        for rules in profile:
            names = [full_name(name.text, profile) for name in rules]
            for permission in rules.attrib:
                if rules.tag != "actions":
                    found[KIND[permission]].update(names)
                    continue
                for kind, parts in zip(ACTION[permission], PARTS, strict=True):
                    found[kind].update(f"{n}/_action/{part}" for n in names for part in parts)
    return found


def matches(name, patterns):
    # As fnmatch of POSIX without FNM_PATHNAME, by which DDS Security compares: * takes slashes too.
    return any(fnmatchcase(name, pattern) for pattern in patterns)


POLICY_TREE = ET.parse(POLICY).getroot()
ENCLAVES = [enclave.get("path") for enclave in POLICY_TREE.findall("enclaves/enclave")]
OTHERS = [path for path in ENCLAVES if path != "/focus_planner"]


def test_the_policy_has_the_form_that_sros_reads():
    assert POLICY_TREE.get("version") == "0.2.0"
    for element in POLICY_TREE.iter():
        children, attributes = SCHEMA[element.tag]
        assert {child.tag for child in element} <= children
        if children:
            assert len(element), element.tag
            assert not (element.text or "").strip()
        else:
            assert element.text.startswith(("/", "~/"))
        optional = element.tag in {"topics", "services", "actions"}
        assert set(element.attrib) <= attributes if optional else set(element.attrib) == attributes
        if optional:
            assert element.attrib
            assert set(element.attrib.values()) == {"ALLOW"}


def test_every_enclave_is_there_once():
    assert sorted(ENCLAVES) == sorted(set(ENCLAVES))
    assert set(ENCLAVES) >= {"/focus_planner", "/lens_adapter", "/orchestrator", "/engineer"}
    assert "/camera_driver" in ENCLAVES


@pytest.mark.parametrize("enclave", OTHERS)
def test_what_others_may_do_with_the_planner_it_has(enclave):
    planner, other = allowed("/focus_planner"), allowed(enclave)
    counterparts = {
        "publisher": planner["subscriber"],
        "subscriber": planner["publisher"] | planner["subscriber"],
        "client": planner["service"],
    }
    for kind, there in counterparts.items():
        for name in other[kind]:
            if name.startswith("/focus_planner/"):
                assert name in there


@pytest.mark.parametrize("enclave", OTHERS)
def test_no_other_may_speak_for_the_planner(enclave):
    other = allowed(enclave)
    for name in (
        "focus_plan",
        "status",
        "cameras/a/focus",
        "cameras/camera/focus",
        "plan/_action/feedback",
    ):
        assert not matches(f"/focus_planner/{name}", other["publisher"])
    for name in ("plan_focus", "set_parameters", "plan/_action/send_goal"):
        assert not matches(f"/focus_planner/{name}", other["service"])


def test_only_the_orchestrator_may_change_anything():
    for enclave in set(OTHERS) - {"/orchestrator"}:
        other = allowed(enclave)
        for name in ("mesh", "cloud", "camera_poses", "rig"):
            assert not matches(f"/focus_planner/{name}", other["publisher"])
        for name in ("plan_focus", "change_state", "set_parameters", "set_parameters_atomically"):
            assert not matches(f"/focus_planner/{name}", other["client"])
        assert not matches("/focus_planner/plan/_action/send_goal", other["client"])


def test_nobody_here_may_move_what_the_planner_plans_for():
    # Frames come from whoever publishes the rig's description, in an enclave of its own.
    for enclave in ENCLAVES:
        assert not matches("/tf_static", allowed(enclave)["publisher"])


def test_the_engineer_only_watches():
    engineer = allowed("/engineer")
    assert engineer["publisher"] == {"/rosout", "/parameter_events"}
    asked = {name.removeprefix("/focus_planner/") for name in engineer["client"]}
    assert all(name.startswith(("get_", "list_", "describe_")) for name in asked)


# --- running nodes ---------------------------------------------------------------------------


@pytest.fixture(scope="module")
def observer():
    context = Context()
    context.init(args=[])
    node = Node("observer", context=context, use_global_arguments=False)
    yield node
    node.destroy_node()
    context.try_shutdown()


def interfaces(observer, full):
    """Return what a node is seen to have: pairs of a kind and a name; none before it is found."""
    namespace, _, name = full.rpartition("/")
    try:
        return {
            (kind, each)
            for kind in KINDS
            for each, _ in getattr(observer, f"get_{kind}_names_and_types_by_node")(
                name, namespace or "/"
            )
        }
    except NodeNameNonExistentError:
        return set()


def nodes(observer):
    return {
        f"{namespace.rstrip('/')}/{name}"
        for name, namespace in observer.get_node_names_and_namespaces()
    }


def assert_covered(seen, enclave):
    patterns = allowed(enclave)
    assert not {(kind, name) for kind, name in seen if not matches(name, patterns[kind])}


def unseen(seen, enclave):
    """Return what the policy names and nobody has."""
    return {
        (kind, pattern)
        for kind, patterns in allowed(enclave).items()
        for pattern in patterns
        if not any(kind == k and fnmatchcase(name, pattern) for k, name in seen)
    }


@pytest.mark.processes
def test_the_planner_and_its_client_have_in_every_state_what_the_policy_allows(observer):
    # With simulated time it listens to /clock, with frames of cameras to their CameraInfo.
    parameters = ("autostart:=false", "use_sim_time:=true", "camera_frames:=cam_a")
    planner = PlannerProcess(
        "focus_planner", *WAITING, *(part for each in parameters for part in ("-p", each))
    )
    driver = observer.create_publisher(CameraInfo, "/cam_a/camera/camera_info", 1)
    try:
        with PlannerClient() as client:
            assert client.state() == "unconfigured"
            expect(observer, ("service", "/focus_planner/get_type_description"))
            assert client.change_state("configure")
            expect(observer, ("service", "/focus_planner/plan/_action/get_result"))
            assert client.change_state("activate")
            client.publish_rig(cylinder_rig(2, 2))
            assert "surface" in client.plan(method="em").message
            expect(observer, ("publisher", "/focus_planner/cameras/cam_1_01/focus"))
            until(lambda: not unseen(interfaces(observer, "/focus_planner"), "/focus_planner"))
            check_client(observer, client)
            for transition in ("deactivate", "cleanup"):
                assert client.change_state(transition)
                expect(observer, ("service", "/focus_planner/get_type_description"))
    finally:
        observer.destroy_publisher(driver)
        assert planner.stop() == 0


def expect(observer, marker):
    """Wait until something is seen of the planner, and check all that is."""
    until(lambda: marker in interfaces(observer, "/focus_planner"))
    assert_covered(interfaces(observer, "/focus_planner"), "/focus_planner")


def check_client(observer, client):
    name = client._node.get_fully_qualified_name()
    # It publishes on what it was asked to.
    client.publish_mesh(Mesh(np.eye(3), np.array([[0, 1, 2]])))
    client.publish_cloud(PointCloud(np.random.default_rng(0).random((16, 3))))
    has = {("publisher", f"/focus_planner/{topic}") for topic in ("mesh", "cloud", "rig")}
    has.add(("client", "/focus_planner/plan_focus"))
    until(lambda: has <= interfaces(observer, name))
    assert_covered(interfaces(observer, name), "/orchestrator")


@pytest.mark.processes
def test_the_lens_adapter_and_drivers_have_what_the_policy_allows(observer):
    names = ["cam_a", "cam_b"]
    processes = [LensProcess(m, cameras=names) for m in ("simulated_lens", "lens_adapter")]
    try:
        until(lambda: {"/lens_adapter", "/cam_a/camera"} <= nodes(observer))
        # Also what it has with drivers of the other kinds.
        others = {("subscriber", "/clock")} | {
            ("client", f"/{profile.node.replace(CAMERA, '*')}/{service}")
            for driver, profile in PROFILES.items()
            for service in ("get_parameters", "list_parameters", "set_parameters_atomically")
            if driver != "camera_ros"
        }
        # Asked only of a driver whose values do not tell what it has.
        perhaps = {("client", "/*/camera/list_parameters")}
        until(
            lambda: (
                others
                <= unseen(interfaces(observer, "/lens_adapter"), "/lens_adapter")
                <= others | perhaps
            )
        )
        assert_covered(interfaces(observer, "/lens_adapter"), "/lens_adapter")
        setting = ("service", "/cam_a/camera/set_parameters_atomically")
        until(lambda: setting in interfaces(observer, "/cam_a/camera"))
        assert_covered(interfaces(observer, "/cam_a/camera"), "/camera_driver")
    finally:
        assert [process.stop() for process in processes] == [0, 0]


# --- enforcing -------------------------------------------------------------------------------


def ended_with_security(keystore, strategy, enclave):
    """Run the node with security asked for until it ends by itself, which it must."""
    environment = {
        **os.environ,
        "ROS_SECURITY_ENABLE": "true",
        "ROS_SECURITY_STRATEGY": strategy,
        "ROS_SECURITY_KEYSTORE": str(keystore),
    }
    arguments = ("--ros-args", "--enclave", enclave)
    return run_forked("focus_planner.ros.node", *arguments, env=environment)


@pytest.mark.processes
@pytest.mark.parametrize("strategy", ["Enforce", "Permissive"])
def test_with_security_asked_for_the_planner_never_runs_without(tmp_path, strategy):
    keys = tmp_path / "enclaves" / "focus_planner"
    keys.mkdir(parents=True)
    certificates = ("cert.pem", "key.pem", "identity_ca.cert.pem", "permissions_ca.cert.pem")
    for name in (*certificates, "governance.p7s", "permissions.p7s"):
        (keys / name).write_text("none")
    process = ended_with_security(tmp_path, strategy, "/focus_planner")
    assert process.returncode == 2
    last = process.stderr.splitlines()[-1]
    assert last.startswith("planner_node: RCLError: ")
    assert "security" in last
    assert "loading" not in process.stderr


@pytest.mark.processes
def test_with_security_asked_for_an_unknown_enclave_is_an_error(tmp_path):
    process = ended_with_security(tmp_path, "Enforce", "/stranger")
    assert process.returncode == 2
    assert "SECURITY ERROR" in process.stderr
