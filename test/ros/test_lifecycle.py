# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The node as a managed one, over DDS: what it does in each state, and after a kill."""

from __future__ import annotations

import re
import signal
from itertools import count

import pytest
from action_msgs.msg import GoalStatus
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rclpy.qos import DurabilityPolicy, QoSProfile
from shape_msgs.msg import Mesh as MeshMsg

from focus_planner.core.rig.layouts import cylinder_rig
from focus_planner.messages.writing import mesh_to_bytes
from focus_planner.ros.client import PlannerClient
from focus_planner.runtime.reason import Reason
from testing.ros.bits import bits
from testing.ros.calls import FEW, until, what_counts
from testing.ros.goals import SHORT, cancelled, ended, planning
from testing.ros.planner_process import PATIENCE, PlannerProcess
from testing.ros.spinning import Spinning

pytestmark = pytest.mark.processes

MANAGED = ("-p", "autostart:=false")
# The way to each state from the one before.
WAYS = {
    ("unconfigured", "inactive"): ["configure"],
    ("unconfigured", "active"): ["configure", "activate"],
    ("inactive", "unconfigured"): ["cleanup"],
    ("inactive", "active"): ["activate"],
    ("active", "inactive"): ["deactivate"],
    ("active", "unconfigured"): ["deactivate", "cleanup"],
}
TRANSITIONS = {
    "unconfigured": {"configure", "shutdown"},
    "inactive": {"cleanup", "activate", "shutdown"},
    "active": {"deactivate", "shutdown"},
}
NUMBERS = {
    "configure": Transition.TRANSITION_CONFIGURE,
    "cleanup": Transition.TRANSITION_CLEANUP,
    "activate": Transition.TRANSITION_ACTIVATE,
    "deactivate": Transition.TRANSITION_DEACTIVATE,
    "destroy": Transition.TRANSITION_DESTROY,
    "no such": 99,
}
_count = count()


@pytest.fixture(scope="module")
def planner(start_planner):
    return start_planner(*FEW, *MANAGED)


def bring(client, state):
    """Have the node in a state."""
    for transition in WAYS.get((client.state(), state), []):
        assert client.change_state(transition), transition
    assert client.state() == state


@pytest.fixture
def active(client, body, rig):
    bring(client, "active")
    client.publish_mesh(body)
    client.publish_rig(rig)
    return client


def by_number(client, number):
    request = ChangeState.Request(transition=Transition(id=number))
    return client._call(client._change_state, request, "change_state").success


# --- states ------------------------------------------------------------------------------------


def test_without_autostart_it_waits_to_be_configured(client, planner):
    assert client.state() == "unconfigured"
    assert client.status().state == "unconfigured"
    with pytest.raises(TimeoutError):
        client.wait_for_node(0.3)
    assert client.set_parameters(seed=3)[0].successful
    assert client.get_parameters(["seed", "autostart"]) == {"seed": 3, "autostart": False}
    assert client.set_parameters(seed=0)[0].successful
    assert "loading kernels" not in planner.log


@pytest.mark.parametrize("state", TRANSITIONS)
def test_a_transition_that_does_not_fit_is_refused(client, planner, state):
    bring(client, state)
    for name, number in NUMBERS.items():
        if name not in TRANSITIONS[state]:
            assert not client.change_state(name)
            assert not by_number(client, number)
            planner.wait_for_log(
                f"refused the transition number {number}: not possible in state {state}"
            )
    assert client.state() == state
    until(lambda: client.status().state == state)
    assert "Traceback" not in planner.log


def test_inactive_it_answers_that_it_is(client, planner):
    bring(client, "inactive")
    response = client.plan(timeout=PATIENCE)
    assert (response.success, response.reason) == (False, Reason.INACTIVE)
    assert response.message == (
        f"the planner is inactive; activate it: ros2 lifecycle set {planner.name} activate"
    )
    assert not client.send_goal(**SHORT).accepted
    planner.wait_for_log("rejected a goal: the planner is not active")


def test_before_inputs_arrive_all_are_told_so(client):
    bring(client, "unconfigured")
    bring(client, "active")
    response = client.plan(timeout=PATIENCE)
    assert response.reason == Reason.NOT_READY
    status, reason, result = ended(client.send_goal(**SHORT))
    assert (status, reason) == (GoalStatus.STATUS_ABORTED, Reason.NOT_READY)
    assert result.message == response.message
    assert "surface: expected a mesh on ~/mesh or a cloud on ~/cloud, got none" in result.message


def test_what_comes_while_it_is_inactive_is_read_once_it_is_active(client, body, rig):
    bring(client, "unconfigured")
    bring(client, "inactive")
    client.publish("mesh", mesh_to_bytes(body)[:-5])
    client.publish_rig(cylinder_rig(rows=2, columns=4, radius=1.2))
    client.publish_mesh(body)
    client.publish_rig(rig)
    status = client.status()
    assert (status.surface.topic, status.rig.topic) == ("", "")
    bring(client, "active")
    response = client.plan(**SHORT)
    assert response.success, response.message
    assert [camera.name for camera in response.plan.cameras] == [c.name for c in rig.cameras]


def test_deactivated_it_stops_and_tells_everybody_at_once(active, rig):
    before = active.plan(**SHORT).plan
    goal, waiting = planning(active), active.plan_async(**SHORT)
    queued = active.send_goal(**SHORT)
    until(lambda: active.status().waiting == 2)
    assert active.change_state("deactivate")
    for status, reason, result in (ended(goal), ended(queued)):
        assert (status, reason) == (GoalStatus.STATUS_ABORTED, Reason.INACTIVE)
        assert (result.success, result.message) == (False, "the planner was deactivated")
    response = active.wait_for(waiting, PATIENCE)
    assert (response.reason, response.message) == (Reason.INACTIVE, "the planner was deactivated")
    assert active.state() == "inactive"
    # The plan in force stays so, and the inputs too.
    assert bits(active.latched_plan()) == bits(before)
    assert bits(active.latched_focus(rig.cameras[0].name)) == bits(before.cameras[0])
    assert active.status().plan_id == before.plan_id
    assert active.change_state("activate")
    assert what_counts(active.plan(**SHORT).plan) == what_counts(before)


def test_a_plan_goes_on_being_planned_for_nobody_after_deactivating_and_activating(active):
    goal = planning(active)
    assert active.change_state("deactivate")
    assert active.change_state("activate")
    response = active.plan(timeout=PATIENCE, **SHORT)
    assert response.success
    assert ended(goal)[1] is Reason.INACTIVE
    assert active.latched_plan().plan_id == response.plan.plan_id


def test_cleaned_up_it_forgets_and_can_be_configured_again(active):
    assert active.plan(**SHORT).success
    bring(active, "unconfigured")
    until(lambda: active.status().plan_id == "")
    until(lambda: not active._plan_focus.service_is_ready())
    with pytest.raises(TimeoutError):
        active.latched_plan(0.3)
    for _ in range(2):
        bring(active, "active")
        assert active.plan().reason == Reason.NOT_READY
        status = active.status()
        assert (status.plan_id, status.lenses, status.from_record) == ("", [], False)
        bring(active, "unconfigured")


def test_of_two_transitions_at_once_one_is_refused(client):
    bring(client, "unconfigured")
    request = ChangeState.Request(transition=Transition(id=Transition.TRANSITION_CONFIGURE))
    calls = [client._change_state.call_async(request) for _ in range(2)]
    until(lambda: all(call.done() for call in calls))
    assert sorted(call.result().success for call in calls) == [False, True]
    assert client.state() == "inactive"


def test_the_log_holds_no_traceback(client, planner):
    client.state()
    assert "Traceback" not in planner.log


# --- starting and ending -----------------------------------------------------------------------


def interrupted(planner):
    planner.signal(signal.SIGINT)
    assert planner.wait() == 0
    assert "Traceback" not in planner.log


def test_while_it_starts_no_other_transition_is_made_and_inactive_it_ends_well(
    start_planner, body, rig
):
    planner = start_planner(*FEW)
    planner.wait_for_log("loading kernels")
    with PlannerClient(planner.name) as client:
        if client.state() != "active":
            assert not client.change_state("cleanup")
        client.publish_mesh(body)
        client.publish_rig(rig)
        assert client.plan(**SHORT).success
        bring(client, "inactive")
    interrupted(planner)


def test_interrupted_while_it_is_configured_it_ends_well(start_planner):
    planner = start_planner(*FEW, *MANAGED)
    with PlannerClient(planner.name) as client:
        client._change_state.wait_for_service(PATIENCE)
        request = ChangeState.Request(transition=Transition(label="configure"))
        call = client._change_state.call_async(request)
        planner.wait_for_log("loading kernels")
        interrupted(planner)
        until(call.done)


def test_shut_down_while_it_plans_it_tells_everybody_and_then_ends_well(start_planner, body, rig):
    planner = start_planner(*FEW)
    with PlannerClient(planner.name) as client:
        client.publish_mesh(body)
        client.publish_rig(rig)
        goal, waiting = planning(client), client.plan_async(**SHORT)
        assert client.change_state("shutdown")
        assert client.state() == "finalized"
        assert ended(goal)[1] is Reason.INACTIVE
        assert client.wait_for(waiting, PATIENCE).reason == Reason.INACTIVE
        assert (
            client.plan(timeout=PATIENCE).message
            == "the planner has been shut down; start it again"
        )
        assert not client.change_state("configure")
    interrupted(planner)


def test_interrupted_while_it_plans_a_goal_it_tells_everybody(start_planner, body, rig):
    planner = start_planner(*FEW)
    with PlannerClient(planner.name) as client:
        client.publish_mesh(body)
        client.publish_rig(rig)
        goal, queued = planning(client), client.send_goal(**SHORT)
        planner.signal(signal.SIGINT)
        for one in (goal, queued):
            status, reason, result = ended(one)
            assert (status, reason) == (GoalStatus.STATUS_ABORTED, Reason.SHUTTING_DOWN)
            assert result.message == "the node is shutting down"
    assert planner.wait() == 0
    assert "Traceback" not in planner.log


# --- killed ------------------------------------------------------------------------------------


@pytest.fixture
def start_again(tmp_path):
    """Start nodes of one name, one after another, that record into one folder."""
    name, started = f"again_{next(_count)}", []

    def start(*arguments):
        record = ("-p", f"record_directory:={tmp_path / 'runs'}")
        started.append(PlannerProcess(name, *FEW, *record, *arguments))
        return started[-1]

    yield start
    assert started.pop().stop() == 0
    assert [process.wait() for process in started] == [-signal.SIGKILL] * len(started)


def kill(planner):
    assert "Traceback" not in planner.log
    planner.signal(signal.SIGKILL)
    planner.wait()


def assert_has(client, plan, rig):
    """Check that a plan is in force again, for those who subscribe now and for each camera."""
    assert bits(client.latched_plan()) == bits(plan)
    for index in (0, len(rig) - 1):
        assert bits(client.latched_focus(rig.cameras[index].name)) == bits(plan.cameras[index])
    status = until(lambda: (found := client.status()).plan_id and found)
    assert (status.plan_id, status.from_record) == (plan.plan_id, True)
    assert status.planned_at == plan.header.stamp
    assert status.plan_surface == plan.surface
    assert [lens.name for lens in status.lenses] == [camera.name for camera in plan.cameras]
    assert status.unreported == len(rig)


def test_killed_in_any_state_it_comes_back_with_its_last_plan(start_again, body, rig):
    planner = start_again()
    with PlannerClient(planner.name) as client:
        client.publish_mesh(body)
        client.publish_rig(rig)
        assert client.plan(**SHORT).success
        plan = cancelled(planning(client))
        assert not client.status().from_record
        planning(client)
        kill(planner)
    planner = start_again(*MANAGED)
    with PlannerClient(planner.name) as client:
        assert client.state() == "unconfigured"
        kill(planner)
    planner = start_again(*MANAGED)
    with PlannerClient(planner.name) as client:
        bring(client, "inactive")
        planner.wait_for_log(f"restored the last plan, {plan.plan_id}, from its record")
        assert_has(client, plan, rig)
        kill(planner)
    planner = start_again()
    with PlannerClient(planner.name) as client:
        assert_has(client, plan, rig)
        client.publish_mesh(body)
        client.publish_rig(rig)
        newer = client.plan(**SHORT).plan
        assert bits(client.latched_plan()) == bits(newer)
        assert not until(lambda: (s := client.status()).plan_id == newer.plan_id and s).from_record
        bring(client, "unconfigured")
        bring(client, "inactive")
        assert_has(client, newer, rig)
        assert "Traceback" not in planner.log


# --- QoS ---------------------------------------------------------------------------------------


@pytest.fixture
def latched_mesh(make_node, context, body):
    """Publish, once, to those who subscribe later."""

    def publish(topic):
        node = make_node()
        qos = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        publisher = node.create_publisher(MeshMsg, topic, qos)
        publisher.publish(mesh_to_bytes(body))
        return Spinning(node)

    started = []
    yield lambda topic: started.append(publish(topic))
    for each in started:
        each.close()


def override(name, topic, policy, value):
    return ("-p", f"qos_overrides./{name}/{topic}.subscription.{policy}:={value}")


def test_a_surface_latched_before_it_started_is_read_where_parameters_say_so(latched_mesh, rig):
    name = f"latched_{next(_count)}"
    latched_mesh(f"/{name}/mesh")
    planner = PlannerProcess(name, *FEW, *override(name, "mesh", "durability", "transient_local"))
    try:
        with PlannerClient(planner.name) as client:
            client.publish_rig(rig)  # of a publisher that keeps nothing: the others are as ever
            until(lambda: client.status().surface.topic)
            assert client.plan(**SHORT).success
            for _ in range(2):
                bring(client, "unconfigured")
                bring(client, "active")
                until(lambda: client.status().surface.topic)
    finally:
        assert planner.stop() == 0
    assert "Traceback" not in planner.log


def test_bad_parameters_are_told_when_it_is_configured(tmp_path):
    name = f"overridden_{next(_count)}"
    directory = tmp_path / ("a" * 300)
    planner = PlannerProcess(
        name,
        *MANAGED,
        *("-p", f"record_directory:={directory}"),
        *override(name, "rig", "durability", "forever"),
    )
    try:
        with PlannerClient(planner.name) as client:
            for _ in range(2):
                assert not client.change_state("configure")
                assert client.state() == "unconfigured"
    finally:
        assert planner.stop() == 0
    assert f"qos_overrides./{name}/rig.subscription: expected history, depth" in planner.log
    assert "forever" in planner.log
    assert re.search("cannot look for the last plan: .*File name too long", planner.log)
    assert "Traceback" not in planner.log
