# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A node that records its runs, over DDS, and what became of them on disk."""

from __future__ import annotations

import math
import os
import re
import resource
import shutil
import signal
import subprocess
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import replace
from itertools import count, repeat

import numpy as np
import pytest
from focus_planner_msgs.msg import CameraRig, FocusPlan
from rclpy.serialization import deserialize_message
from shape_msgs.msg import Mesh as MeshMsg

from focus_planner.core.planning.request import METHODS
from focus_planner.core.rig.layouts import cylinder_rig
from focus_planner.core.surface.surface import PointCloud
from focus_planner.core.validation import InputError
from focus_planner.messages.cdr import write_mesh
from focus_planner.messages.plan_reading import plan_from_message
from focus_planner.messages.typestore import CLOUD, MESH, RIG, serialize
from focus_planner.messages.writing import (
    mesh_to_bytes,
    rig_to_fields,
)
from focus_planner.parameters.planner import DECLARATIONS
from focus_planner.recording.bag_reading import read_bag
from focus_planner.recording.folders import bag_size
from focus_planner.recording.naming import PARTIAL
from focus_planner.recording.replay import differences, plan_run
from focus_planner.recording.run_reading import read_run
from focus_planner.recording.software import software
from focus_planner.ros.client import _INPUTS, PlannerClient
from focus_planner.ros.conversions import message_to_ros
from focus_planner.runtime.inputs import without_unheard
from testing.ros.bits import bits
from testing.ros.calls import FEW, having, set_parameters, until
from testing.ros.goals import LONG, cancelled, planning
from testing.ros.planner_process import PlannerProcess
from testing.ros.recorded import (
    TYPES,
    assert_reproduced,
    cloud_payload,
    mesh_payload,
    moved,
    poses_payload,
    recorded,
    rig_payload,
    whole,
)
from testing.visuals import check_markers

pytestmark = pytest.mark.processes

_count = count()


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Where the module's node records."""
    return tmp_path_factory.mktemp("recorded") / "made" / "by the node"


@pytest.fixture(scope="module")
def planner(start_planner, folder):
    return start_planner(*FEW, "-p", f"record_directory:={folder}")


@pytest.fixture(scope="module")
def another(start_planner):
    """A second node, which records nothing until it is told to."""
    planner = start_planner(*FEW)
    with PlannerClient(planner.name) as client:
        yield planner, client


@pytest.fixture
def ready(client, body, rig):
    client.publish_mesh(body)
    client.publish_rig(rig)
    return client


@pytest.fixture
def elsewhere(ready, folder, tmp_path):
    """Has the module's node record below a folder of the test's own; return that."""
    with having(ready, record_directory=str(tmp_path / "runs")):
        yield tmp_path / "runs"


def refused(client, folder, **request):
    """Call for what is no plan; return what was told, which was recorded and comes again."""
    answer, run = recorded(client, folder, **request)
    assert not answer.success
    message = without_unheard(answer.message)
    assert (run.ending.success, run.ending.message) == (False, message)
    assert plan_run(run).ending.message == message
    assert_reproduced(run)
    return answer.message


# --- what a run holds --------------------------------------------------------------------------


PAYLOADS = {
    "mesh": mesh_payload,
    "cloud": cloud_payload,
    "camera_poses": poses_payload,
    "rig": rig_payload,
}


@contextmanager
def hearing(client, topic):
    """Subscribe to one of the planner's inputs; yields the list of what arrives, as bytes."""
    heard = []
    name = f"{client._planner}/{topic}"
    before = client._node.count_subscribers(name)
    subscription = client._node.create_subscription(_INPUTS[topic], name, heard.append, 4, raw=True)
    try:
        until(lambda: client._node.count_subscribers(name) > before)
        yield heard
    finally:
        client._destroy_soon(client._node.destroy_subscription, subscription)


@pytest.mark.parametrize("little", [True, False], ids=["little-endian", "big-endian"])
@pytest.mark.parametrize("topic", PAYLOADS)
def test_an_input_is_recorded_as_every_subscriber_gets_it(
    ready, folder, planner, body, rig, topic, little
):
    payload = PAYLOADS[topic](body, rig, little)
    with hearing(ready, topic) as heard:
        ready.publish(topic, payload)
        until(lambda: heard)
    _, run = recorded(ready, folder, method="em")
    recorded_payloads = {m.topic: (m.type_name, m.payload) for m in run.inputs}
    assert len(recorded_payloads) == len(run.inputs) == 2
    assert recorded_payloads[f"{planner.name}/{topic}"] == (TYPES[topic], payload)
    assert heard == [payload]
    assert_reproduced(run)


def test_the_inputs_carry_the_times_at_which_they_came(ready, folder, body, rig):
    before = time.time_ns()
    ready.publish_mesh(body)
    until(lambda: received(ready.status().surface) > before)  # acknowledged is not yet taken
    between = time.time_ns()
    ready.publish_rig(rig)
    until(lambda: received(ready.status().rig) > between)
    after = time.time_ns()
    _, run = recorded(ready, folder)
    at = {message.type_name: message.at for message in run.inputs}
    assert before < at[MESH] < between < at[RIG] < after < run.beginning.at


def received(state):
    """When an input of a status was received, nanoseconds; whole microseconds, rounded up."""
    return 10**9 * state.received.sec + state.received.nanosec + 999


@pytest.mark.parametrize("method", METHODS)
def test_the_plan_is_recorded_as_it_was_answered_and_published(ready, folder, planner, method):
    answer, run = recorded(ready, folder, method=method, seed=11)
    (plan,) = [m for m in read_bag(run.path).messages if m.topic == f"{planner.name}/focus_plan"]
    assert bits(deserialize_message(plan.payload, FocusPlan)) == bits(answer.plan)
    assert bits(ready.latched_plan()) == bits(answer.plan)
    assert run.ending.plan == plan_from_message(answer.plan)
    assert run.ending.message == answer.message
    assert run.path.name == run.beginning.run_id == answer.plan.plan_id
    assert run.beginning.planner == planner.name
    assert_reproduced(run)


def test_notes_are_answered_logged_diagnosed_and_recorded(ready, folder, planner, body, rig):
    x, y, z = body.vertices.T
    ready.publish_mesh(replace(body, vertices=np.column_stack([x, z, -y])))
    try:
        ready.publish_poses(rig)
        answer, run = recorded(ready, folder, method="em", samples=300)
        assert answer.success, answer.message
        notes = {note.code: note.text for note in answer.plan.notes}
        assert {"up_axis", "default_lens", "default_image"} <= notes.keys()
        assert "the lens of 32 of 32 cameras" in notes["default_lens"]
        assert "set the parameters lens.focal_length" in notes["default_lens"]
        assert f"see its notes: {', '.join(notes)}" in answer.message
        assert {note.code: note.text for note in run.ending.plan.notes} == notes
        for code, text in notes.items():
            planner.wait_for_log(re.escape(f"note ({code}): {text}"))
        replayed = plan_run(run)
        assert replayed.plan.notes == run.ending.plan.notes
    finally:
        ready.publish_mesh(body)
        ready.publish_rig(rig)


def test_a_run_is_a_rosbag2_folder(ready, folder, planner):
    _, run = recorded(ready, folder)
    name = run.path.name
    assert {file.name for file in run.path.iterdir()} == {f"{name}_0.mcap", "metadata.yaml"}
    topics = [message.topic for message in read_bag(run.path).messages]
    assert topics[:4] == [f"{planner.name}/{t}" for t in ("mesh", "rig", "run", "run/request")]
    plan, steps, result = (
        f"{planner.name}/{t}" for t in ("focus_plan", "run/progress", "run/result")
    )
    assert set(topics[4:-1]) == {
        plan,
        steps,
    }
    assert topics.count(plan) == 1
    assert topics[-1] == result


def test_all_parameters_are_recorded_as_they_are(ready, folder, rig):
    ready.publish_poses(rig)
    parameters = {
        "method": "em",
        "k": 3,
        "shots": 2,
        "depth_tolerance": 0.001,
        "gap": 0.01,
        "lens__hyperfocal_distance": 12.0,
        "lens__focus_distances": [0.7, 0.9, 1.2],
        "cost__focus_weight": 0.25,
    }
    with having(ready, **parameters):
        effective = ready.get_parameters([d.name for d in DECLARATIONS])
        answer, run = recorded(ready, folder)
    assert dict(run.beginning.settings.values) == effective
    assert effective["lens.focus_distances"] == (0.7, 0.9, 1.2)
    assert answer.plan.method == "em"
    assert_reproduced(run)
    _, run = recorded(ready, folder)
    changed = dict(run.beginning.settings.values)
    assert {n for n in effective if changed[n] != effective[n]} == {
        name.replace("__", ".") for name in parameters
    }


def test_the_request_the_seed_and_the_versions_are_recorded(ready, folder):
    request = {"method": "k_view", "k": 3, "samples": 400, "seed": 2**40, "gap": 0.02}
    _, run = recorded(ready, folder, **request)
    assert {n: v for n, v in run.beginning.asked.items() if v} == request
    assert seed_of(run) == run.ending.plan.seed == 2**40
    assert run.beginning.software == software()
    with having(ready, seed=5):
        _, run = recorded(ready, folder)
    assert seed_of(run) == run.ending.plan.seed == 5
    assert not any(run.beginning.asked.values())


def seed_of(run):
    (message,) = [m for m in read_bag(run.path).messages if m.topic.endswith("/run")]
    return message.read().seed


def test_the_progress_is_recorded(ready, folder):
    _, run = recorded(ready, folder, method="k_view", bound="tight")
    stages = {step.stage for step in run.progress}
    assert {"solving", "em", "prices"} <= stages
    costs = [step.cost for step in run.progress if not math.isnan(step.cost)]
    assert costs[-1] == pytest.approx(run.ending.plan.cost) == min(costs)
    bounds = [step.lower_bound for step in run.progress if step.lower_bound is not None]
    assert max(bounds) == pytest.approx(run.ending.plan.lower_bound)
    assert_reproduced(run)


def test_what_shows_a_plan_is_recorded_on_request_only(ready, folder, planner):
    def shown(run):
        topics = [f"{planner.name}/{name}" for name in ("markers", "quality_cloud")]
        return [m.read() for m in read_bag(run.path).messages if m.topic in topics]

    with having(ready, record_markers=True):
        answer, run = recorded(ready, folder)
        markers, cloud = shown(run)
        stamp = (answer.plan.header.stamp.sec, answer.plan.header.stamp.nanosec)
        check_markers(markers.markers, "world", stamp)
        assert cloud.width == answer.plan.fresh_samples
        assert_reproduced(run)
        refused(ready, folder, method="guess")
    _, run = recorded(ready, folder)
    assert not shown(run)


def test_what_a_plan_rests_on_is_on_disk_while_it_is_solved(elsewhere, ready, body):
    ready.publish_rig(cylinder_rig())
    goal = planning(ready)
    (partial,) = elsewhere.glob(f"*{PARTIAL}/*.mcap")
    run = read_run(partial.parent)
    assert run.fault == "a truncated file"
    assert run.inputs[0].payload == mesh_to_bytes(body)
    assert len(run.inputs) == 2
    cancelled(goal)
    assert list(until(lambda: whole(elsewhere))) == [partial.parent.name.removesuffix(PARTIAL)]


def readable(path):
    try:
        return read_run(path)
    except InputError:
        return None


# --- requests that fail ------------------------------------------------------------------------


def test_without_input_the_refusal_is_recorded(another, tmp_path):
    _, client = another
    if client.plan(samples=10).success:
        pytest.fail("this test is to come before the others that use this node")
    with having(client, record_directory=str(tmp_path)):
        assert "got none yet" in refused(client, tmp_path)
        client.publish("mesh", b"\x00\x01\x00\x00")
        assert "got none that can be used" in refused(client, tmp_path)


def test_a_bad_request_is_recorded(ready, folder):
    assert "method: expected one of" in refused(ready, folder, method="guess")
    assert "shots" in refused(ready, folder, shots=1000)
    assert "samples" in refused(ready, folder, samples=2**31)


def test_the_refusal_of_a_newer_input_is_recorded_and_so_is_what_comes_after_it(
    ready, folder, body, rig
):
    recorded(ready, folder)
    ready.publish_rig(moved(rig, 1000))
    assert "probably in millimetres" in refused(ready, folder)
    ready.publish_rig(rig)
    ready.publish("mesh", write_mesh(body.triangles, 1000 * body.vertices))
    assert "stays in force" in refused(ready, folder)
    _, run = recorded(ready, folder)
    assert_reproduced(run)


def test_a_plan_on_what_stayed_in_force_is_reproduced(ready, folder, rig):
    ready.publish_rig(moved(rig, 1000))
    refused(ready, folder)
    answer, run = recorded(ready, folder)
    assert "as a newer one was refused" in answer.message
    assert_reproduced(run)


def test_a_refusal_is_reproduced_where_the_other_input_came_later(ready, folder, body, rig):
    ready.publish_rig(moved(rig, 1000))
    ready.publish("mesh", mesh_to_bytes(body, big_endian=True))
    assert "stays in force" in refused(ready, folder)


def test_a_surface_and_a_rig_that_do_not_fit_are_recorded(another, tmp_path, body, rig):
    _, client = another
    with having(client, record_directory=str(tmp_path)):
        client.publish_rig(moved(rig, 1000))
        client.publish_mesh(body)
        for _ in range(2):
            assert "probably in millimetres" in refused(client, tmp_path)
        client.publish_rig(rig)
        _, run = recorded(client, tmp_path)
        assert_reproduced(run)


def test_the_refusal_of_a_message_without_content_is_recorded(ready, folder):
    ready.publish("cloud", serialize(CLOUD, {"header": {"frame_id": "world"}}))
    assert "cloud" in refused(ready, folder)


@pytest.mark.parametrize("topic", ["mesh", "cloud", "camera_poses", "rig"])
def test_the_refusal_of_bytes_that_are_no_message_is_recorded(ready, folder, body, rig, topic):
    ready.publish(topic, PAYLOADS[topic](body, rig, True)[:-9])
    refused(ready, folder)


def test_the_refusal_of_a_name_that_makes_no_topic_is_recorded(ready, folder, rig):
    fields = rig_to_fields(rig)
    fields["cameras"][0]["name"] = "c" * 300
    ready.publish("rig", message_to_ros(CameraRig, fields))
    assert "at most 100 characters" in refused(ready, folder)


# --- plans that depend on more than their request ----------------------------------------------


def test_plans_that_start_from_the_last_one_are_reproduced_each_by_itself(ready, folder, body):
    with having(ready, warm_start=True):
        recorded(ready, folder, seed=4)
        runs = [recorded(ready, folder, seed=5)[1]]
        ready.publish("mesh", write_mesh(body.triangles, body.vertices + 0.002))
        runs += [recorded(ready, folder, method=m, bound="tight")[1] for m in ("em", "k_view")]
    for run in runs:
        assert run.beginning.warm_start is not None
        assert_reproduced(run)
    cold = replace(runs[0], beginning=replace(runs[0].beginning, warm_start=None))
    assert differences(cold, plan_run(cold))
    _, run = recorded(ready, folder)
    assert run.beginning.warm_start is None


@pytest.mark.parametrize("budget", [1e-6, 0.05, 0.3])
def test_a_plan_that_the_time_ended_is_reproduced(ready, folder, budget):
    ready.publish_rig(cylinder_rig())
    answer, run = recorded(ready, folder, **LONG, time_budget=budget)
    assert answer.success
    assert not run.ending.plan.converged
    assert_reproduced(run)


# --- where runs go -----------------------------------------------------------------------------


def test_recording_is_switched_off_and_on(elsewhere, ready):
    recorded(ready, elsewhere)
    with having(ready, record_directory=""):
        answer = ready.plan()
        assert answer.success
    recorded(ready, elsewhere)
    assert len(whole(elsewhere)) == 2
    assert answer.plan.plan_id not in whole(elsewhere)


def test_a_folder_that_was_deleted_is_made_again(elsewhere, ready):
    recorded(ready, elsewhere)
    shutil.rmtree(elsewhere)
    recorded(ready, elsewhere)
    assert len(whole(elsewhere)) == 1


def test_a_folder_may_be_relative_or_of_a_user_and_topics_remapped(
    start_planner, tmp_path, monkeypatch, body, rig
):
    (tmp_path / "home").mkdir()
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    monkeypatch.chdir(tmp_path)
    remapped = ["--remap", "~/mesh:=/scanner/mesh", "--remap", "__ns:=/left"]
    planner = start_planner(*FEW, *remapped, "-p", "record_directory:=some/runs")
    name = f"/left{planner.name}"
    with PlannerClient(name) as client:
        client._inputs["mesh"] = client._input(MeshMsg, "/scanner/mesh")
        client.publish_mesh(body)
        client.publish_rig(rig)
        until(lambda: client.status().surface.topic)  # once discovery has brought the two together
        _, run = recorded(client, tmp_path / "some" / "runs")
        set_parameters(client, record_directory="~/runs")
        _, of_user = recorded(client, tmp_path / "home" / "runs")
        assert not client.set_parameters(record_directory="~of nobody/runs")[0].successful
    assert {message.topic for message in run.inputs} == {"/scanner/mesh", f"{name}/rig"}
    assert run.beginning.planner == name
    assert_reproduced(run)
    assert_reproduced(of_user)


@pytest.mark.parametrize(
    ("where", "reason"),
    [("a file/runs", "Not a directory"), ("/proc/runs", "No such file or directory")],
)
def test_a_folder_that_cannot_be_made_costs_no_plan(
    elsewhere, ready, planner, tmp_path, where, reason
):
    (tmp_path / "a file").write_text("")
    place = tmp_path / where
    with having(ready, record_directory=str(place)):
        lost_but_planned(ready, planner, place, reason)
    recorded(ready, elsewhere)


def lost_but_planned(client, planner, place, reason):
    answer = client.plan()
    assert answer.success
    what = f"not recorded: run {answer.plan.plan_id} in {place}: {reason}"
    assert answer.message.endswith(what)
    planner.wait_for_log(rf"\[ERROR\].*not recorded: run {answer.plan.plan_id}")
    assert what in planner.log
    return answer


def test_a_file_that_may_not_grow_costs_no_plan(elsewhere, ready, planner):
    process = planner.pid
    before = resource.prlimit(process, resource.RLIMIT_FSIZE)
    resource.prlimit(process, resource.RLIMIT_FSIZE, (20_000, before[1]))
    try:
        for _ in range(2):
            lost_but_planned(ready, planner, elsewhere, "File too large")
    finally:
        resource.prlimit(process, resource.RLIMIT_FSIZE, before)
    # What was not recorded leaves nothing behind.
    until(lambda: not list(elsewhere.glob(f"*{PARTIAL}")))
    assert not whole(elsewhere)
    answer = ready.plan()
    assert "not recorded" not in answer.message
    assert_reproduced(read_run(until(lambda: whole(elsewhere))[answer.plan.plan_id]))


@pytest.fixture
def small_disk(tmp_path):
    place = tmp_path / "small"
    place.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=32k", "tmpfs", str(place)]
    if subprocess.run(mount, check=False, capture_output=True).returncode:
        pytest.skip("only root may mount")
    yield place
    subprocess.run(["umount", "-l", str(place)], check=True)


def test_a_full_disk_costs_no_plan(elsewhere, ready, planner, small_disk):
    place = small_disk / "runs"
    with having(ready, record_directory=str(place)):
        lost_but_planned(ready, planner, place, "No space left on device")
    recorded(ready, elsewhere)


# --- how many are kept -------------------------------------------------------------------------


def test_no_more_runs_are_kept_than_wanted_and_the_newest_always(elsewhere, ready):
    names = [recorded(ready, elsewhere)[1].path.name for _ in range(4)]
    with having(ready, record_max_runs=2):
        names.append(ready.plan().plan.plan_id)
        until(lambda: list(whole(elsewhere)) == names[-2:])
    each = max(map(bag_size, whole(elsewhere).values()))
    with having(ready, record_max_bytes=int(3.5 * each)):
        names += [ready.plan().plan.plan_id for _ in range(4)]
        until(lambda: list(whole(elsewhere)) == names[-3:])
    with having(ready, record_max_bytes=1):
        names.append(ready.plan().plan.plan_id)
        until(lambda: list(whole(elsewhere)) == names[-1:])
    assert_reproduced(read_run(elsewhere / names[-1]))


def test_two_nodes_record_into_one_folder(elsewhere, ready, planner, another, body, rig):
    other, client = another
    client.publish_mesh(body)
    client.publish_rig(rig)
    already = [len(planner.log), len(other.log)]
    with having(client, record_directory=str(elsewhere)):
        names = both(ready, client, 10)
        until(lambda: whole(elsewhere).keys() == names)
        limit = {"record_max_runs": 3}
        with having(ready, **limit), having(client, **limit):
            newest = max(both(ready, client, 30))
            until(lambda: not list(elsewhere.glob(f"*{PARTIAL}")))
            # One more, if it has the plan in force of the other node.
            until(lambda: len(whole(elsewhere)) <= 4)
    assert newest in whole(elsewhere)
    for run in whole(elsewhere).values():
        assert read_run(run).fault == ""
    for node, length in zip((planner, other), already, strict=True):
        assert "ERROR" not in node.log[length:]


def both(one, other, calls):
    """Call both for plans at once; return their names."""
    called = [(c, c.plan_async(method="closest")) for _ in range(calls) for c in (one, other)]
    answers = [client.wait_for(call) for client, call in called]
    assert all(answer.success for answer in answers)
    assert [a.message for a in answers if "not recorded" in a.message] == []
    return {answer.plan.plan_id for answer in answers}


def test_of_many_calls_at_once_every_one_has_its_run(elsewhere, ready):
    requests = [{"method": METHODS[i % len(METHODS)], "seed": 1 + i % 3} for i in range(64)]
    calls = [ready.plan_async(**request) for request in requests]
    answers = [ready.wait_for(call) for call in calls]
    assert all(answer.success for answer in answers)
    names = {answer.plan.plan_id for answer in answers}
    assert len(names) == 64
    until(lambda: whole(elsewhere).keys() == names)
    for answer, request in zip(answers, requests, strict=True):
        run = read_run(elsewhere / answer.plan.plan_id)
        assert {n: v for n, v in run.beginning.asked.items() if v} == request
        assert run.ending.plan == plan_from_message(answer.plan)
        assert len(run.inputs) == 2
    for answer in answers[::8]:
        assert_reproduced(read_run(elsewhere / answer.plan.plan_id))


def test_the_log_holds_no_traceback(ready, folder, planner):
    recorded(ready, folder)
    assert "Traceback" not in planner.log


# --- how a node ends ---------------------------------------------------------------------------


def test_interrupted_while_it_plans_it_leaves_a_partial_run(start_planner, tmp_path, body, rig):
    planner = start_planner(*FEW, "-p", f"record_directory:={tmp_path}")
    with PlannerClient(planner.name) as client:
        client.publish_mesh(body)
        client.publish_rig(rig)
        done = client.plan().plan.plan_id
        until(lambda: list(whole(tmp_path)) == [done])
        client.publish_rig(cylinder_rig())
        call = client.plan_async(**LONG)
        partial = until(lambda: next(tmp_path.glob(f"[!.]*{PARTIAL}"), None))
        until(lambda: readable(partial))
        planner.signal(signal.SIGINT)
        assert client.wait_for(call).message == "the node is shutting down"
    assert planner.wait() == 0
    assert "Traceback" not in planner.log
    assert list(whole(tmp_path)) == [done]
    assert_reproduced(read_run(tmp_path / done))
    assert list(tmp_path.glob(f"*{PARTIAL}")) == [partial]
    run = read_run(partial)
    assert run.fault == "a truncated file"
    assert run.inputs[0].payload == mesh_to_bytes(body)
    assert len(run.inputs) == 2
    assert run.beginning.asked["samples"] == LONG["samples"]


def test_interrupted_while_it_writes_it_finishes_what_was_answered(
    start_planner, tmp_path, body, rig
):
    parameters = ("-p", f"record_directory:={tmp_path}", "-p", "record_markers:=true")
    planner = start_planner(*FEW, *parameters, module="testing.ros.patient_node")
    points = body.vertices[:, None] + np.random.default_rng(3).normal(0, 1e-3, (1, 20, 3))
    normals = np.broadcast_to(body.vertices[:, None] - [0.0, 0.0, 1.0], points.shape)
    cloud = PointCloud(points.reshape(-1, 3), normals.reshape(-1, 3))
    with PlannerClient(planner.name) as client:
        client.publish_cloud(cloud)
        client.publish_rig(rig)
        calls = [client.plan_async(method="closest") for _ in range(12)]
        client.wait_for(calls[3])
        planner.signal(signal.SIGINT)
        answers = [client.wait_for(call) for call in calls]
    assert planner.wait() == 0
    assert "Traceback" not in planner.log
    plans = {answer.plan.plan_id for answer in answers if answer.success}
    assert 4 <= len(plans) <= 12
    assert plans <= whole(tmp_path).keys()
    for name in plans:
        assert read_run(tmp_path / name).fault == ""
    assert len(whole(tmp_path)) <= len(plans) + 1
    assert len(list(tmp_path.glob(f"*{PARTIAL}"))) <= 1


MOMENTS = 6


def test_killed_at_any_moment_it_leaves_whole_runs_and_partial_ones(tmp_path, body, rig):
    payloads = {"mesh": mesh_to_bytes(body), "rig": serialize(RIG, rig_to_fields(rig))}
    calls = np.random.default_rng(20).integers(0, 15, MOMENTS).tolist()
    folders = [tmp_path / str(k) for k in range(MOMENTS)]
    with ThreadPoolExecutor(max_workers=2) as pool:
        list(pool.map(kill_while_it_works, folders, repeat(payloads), calls))
    runs = [run for folder in folders for run in sorted(folder.iterdir())]
    for run in filter(None, map(readable, runs)):
        assert {message.payload for message in run.inputs} == set(payloads.values())
    kept = [run for folder in folders for run in whole(folder).values()]
    assert kept
    assert len(runs) - len(kept) == check_partial(runs) > 0
    for run in kept[:: 1 + len(kept) // 12]:
        assert_reproduced(read_run(run))


def kill_while_it_works(folder, payloads, answers):
    """Run a node, ask it for many plans, and kill it after some, while it makes the next ones."""
    name = f"victim_{os.getpid()}_{next(_count)}"
    parameters = ("-p", f"record_directory:={folder}", "-p", "record_markers:=true")
    node = PlannerProcess(name, *FEW, *parameters)
    try:
        with PlannerClient(f"/{name}") as client:
            for topic, payload in payloads.items():
                client.publish(topic, payload)
            calls = [client.plan_async(method="k_view", seed=1 + i) for i in range(40)]
            client.wait_for(calls[answers])
    finally:
        node.kill()
    assert node.wait() == -signal.SIGKILL


def check_partial(runs):
    """Check that what is not whole says so; return how many are not."""
    partial = [run for run in runs if run.name.endswith(PARTIAL)]
    for path in partial:
        run = readable(path)
        if run is not None and not run.fault:  # all was written, only the folder not renamed
            assert_reproduced(run)
    for path in set(runs) - set(partial):
        assert read_run(path).fault == ""
    return len(partial)
