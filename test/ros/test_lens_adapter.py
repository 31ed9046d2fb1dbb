# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Planner's topic, adapter, driver: processes that meet over DDS."""

from __future__ import annotations

import math
import signal
from importlib import import_module

import numpy as np
import pytest
from focus_planner_msgs.msg import LensState
from rclpy.context import Context

from testing.hostile_lenses import orders
from testing.ros.lens_processes import LensProcess, Orchestrator
from testing.ros.parameter_services import set_of
from testing.ros.planner_process import PATIENCE

SENT, VERIFIED = LensState.STATUS_SENT, LensState.STATUS_VERIFIED
DIFFERS, FAILED = LensState.STATUS_DIFFERS, LensState.STATUS_FAILED
ACCEPTED = LensState.STATUS_ACCEPTED
# Answers come however busy the machine is; a lens that is wrong is wrong soon.
QUICK = {"timeout": float(PATIENCE), "retries": 0, "poll_period": 0.05, "verify_timeout": 1.0}
QUICK |= {"watch_period": 0.5}
# Dioptres per second: all the way takes longer than any test waits between two orders.
SLOW = 0.1
UNDER_WAY = QUICK | {"verify_timeout": float(PATIENCE)}
FRAMES = {"frame_rate": 30.0}
# Its two lenses are on one node, which measures where they are.
BOX = {
    "cameras": ["upper", "lower"],
    "driver": "custom",
    "driver_node": "box",
    "parameter": "{camera}.ring",
    "first": ["{camera}.auto=false"],
}
TABLES = "default: {unit: steps, whole: true, distances: [0.25, 1.0], values: [200, 50]}\n"


@pytest.fixture(scope="module")
def start():
    """Start lens nodes; they are stopped, and must have ended well, at the end of the module."""
    started = []

    def start(module, *namespace, **parameters):
        started.append(LensProcess(module, *namespace, **parameters))
        return started[-1]

    yield start
    statuses = []
    # One by one: when many end at once, Fast DDS may hang, and a watchdog end the node with 1.
    for process in started:
        process.signal(signal.SIGTERM)
        statuses.append(process.wait())
    assert set(statuses) <= {0, -signal.SIGKILL}
    assert "Traceback" not in "".join(process.log for process in started)


@pytest.fixture(scope="module")
def orchestrator():
    context = Context()
    context.init(args=[])
    made = Orchestrator(context)
    yield made
    made.close()
    context.try_shutdown()


@pytest.fixture(scope="module")
def rig(start, orchestrator, tmp_path_factory):
    """Start all kinds of lenses, and their adapters, at the same time."""
    tables = tmp_path_factory.mktemp("lenses") / "tables.yaml"
    tables.write_text(TABLES)
    webcams = {"cameras": ["webcam"], "driver": "v4l2_camera"}
    nodes = [
        start("simulated_lens", cameras=["good", "stuck"], stuck=["stuck"], **FRAMES),
        start("simulated_lens", cameras=["slow"], speed=SLOW, **FRAMES),
        start("simulated_lens", cameras=["loose"], backlash=0.25, **FRAMES),
        start("simulated_lens", cameras=["mute"], metadata=False, **FRAMES),
        start("simulated_lens", **webcams),
        start("simulated_lens", "/rig_1", **BOX, reports="position", stuck=["lower"]),
        start("lens_adapter", cameras=["good", "slow"], **UNDER_WAY),
        start("lens_adapter", "/", cameras=["stuck", "loose", "mute"], **QUICK),
        start("lens_adapter", "/rig_1", **BOX, measures=True, unit="dioptres", **QUICK),
        start("lens_adapter", cameras=["absent"], **UNDER_WAY | {"timeout": 3.0}),
        start("lens_adapter", **webcams, **QUICK, lens_tables=tables),
        start("lens_adapter", cameras=["unknown"], driver="v4l2_camera", **QUICK),
    ]
    for node in nodes:
        node.wait_for_log("ready")
    return nodes


@pytest.mark.processes
def test_a_name_that_resembles_a_parameter_is_told_what_was_meant(start):
    for module, given, meant in (
        ("lens_adapter", "tolerence", "tolerance"),
        ("simulated_lens", "failure_rte", "failure_rate"),
    ):
        process = start(module, "/misspelt", cameras=["a"], **{given: 0.1})
        process.wait_for_log("ready")
        assert f"there is no parameter {given}: did you mean {meant}?" in process.log


@pytest.mark.processes
def test_a_plan_is_sent_and_verified(rig, orchestrator):
    orchestrator.plan("good", "a", focus_distance=0.5)
    state = orchestrator.wait_for("good", "a", VERIFIED)
    assert [s.status for s in orchestrator.states("good", "a")] == [SENT, VERIFIED]
    assert (state.planned_distance, state.unit, state.sent_value) == (0.5, "dioptres", 2.0)
    assert (state.read_value, state.read_distance) == (2.0, 0.5)
    assert state.message == ""
    assert 0 < state.sent_at.sec <= state.read_at.sec <= state.header.stamp.sec


@pytest.mark.processes
def test_beyond_the_limits_it_fails_with_the_drivers_reason(rig, orchestrator):
    orchestrator.plan("good", "near", focus_distance=0.05)
    state = orchestrator.wait_for("good", "near", FAILED)
    assert state.sent_value == 20.0
    assert math.isnan(state.read_value)
    assert (
        "/good/camera refused AfMode = 0, LensPosition = 20.0: Parameter LensPosition out of range"
        in state.message
    )


@pytest.mark.processes
def test_a_lens_that_is_stuck_differs(rig, orchestrator):
    orchestrator.plan("stuck", "a", focus_distance=0.5)
    state = orchestrator.wait_for("stuck", "a", DIFFERS)
    assert (state.sent_value, state.read_value, state.read_distance) == (2.0, 0.0, math.inf)
    assert VERIFIED not in [s.status for s in orchestrator.states("stuck", "a")]


@pytest.mark.processes
def test_where_only_parameters_can_be_read_it_is_accepted(rig, orchestrator):
    orchestrator.plan("mute", "a", focus_distance=0.5)
    state = orchestrator.wait_for("mute", "a", ACCEPTED)
    assert (state.sent_value, state.read_value, state.read_distance) == (2.0, 2.0, 0.5)
    assert "expected 3 frames on /diagnostics" in state.message


@pytest.mark.processes
def test_autofocus_that_another_node_switches_on_is_ended_again(rig, orchestrator, make_node):
    orchestrator.plan("loose", "watched", focus_distance=10.0)
    orchestrator.wait_for("loose", "watched", VERIFIED)
    set_of(make_node(), "/loose/camera", AfMode=2)
    orchestrator.wait_for("loose", "watched", VERIFIED, after=DIFFERS)


@pytest.mark.processes
def test_in_a_namespace_relative_names_are_its_own_and_a_node_has_several_lenses(rig, context):
    there = Orchestrator(context, "/rig_1/focus_planner")
    try:
        there.plan("upper", "a", focus_distance=2.0)
        there.plan("lower", "a", focus_distance=4.0)
        assert there.wait_for("upper", "a", VERIFIED).read_value == 0.5
        state = there.wait_for("lower", "a", DIFFERS)
        assert (state.sent_value, state.read_value) == (0.25, 0.0)
        assert "/rig_1/box: expected lower.ring = 0.25, read 0; the lens is slow" in state.message
    finally:
        there.close()


@pytest.mark.processes
def test_backlash_differs_from_one_side_only(rig, orchestrator):
    orchestrator.plan("loose", "up", focus_distance=0.25)
    assert orchestrator.wait_for("loose", "up", VERIFIED).read_value == 4.0
    orchestrator.plan("loose", "down", focus_distance=0.5)
    state = orchestrator.wait_for("loose", "down", DIFFERS, read_value=2.25)
    assert state.sent_value == 2.0
    assert state.read_distance == pytest.approx(1 / 2.25)
    assert "expected the lens at 2, its frames say LensPosition = 2.25" in state.message


@pytest.mark.processes
def test_a_slow_lens_is_sent_then_verified_and_a_newer_plan_goes_first(rig, orchestrator):
    orchestrator.plan("slow", "far away", focus_distance=0.1)
    orchestrator.wait_for("slow", "far away", SENT)
    orchestrator.plan("slow", "near by", focus_distance=4.0)
    state = orchestrator.wait_for("slow", "near by", VERIFIED)
    sent = orchestrator.states("slow", "near by")[0]
    assert sent.status == SENT
    assert (state.sent_value, state.read_value) == (0.25, 0.25)
    assert [s.status for s in orchestrator.states("slow", "far away")] == [SENT]


@pytest.mark.processes
def test_whole_values_by_the_adapters_table_or_the_planners(rig, orchestrator):
    orchestrator.plan("webcam", "a", focus_distance=0.5)
    state = orchestrator.wait_for("webcam", "a", ACCEPTED)
    assert (state.unit, state.sent_value) == ("steps", 100.0)
    assert (state.read_value, state.read_distance) == (100.0, pytest.approx(0.5))
    planned = {"focus_distance": 1 / 3, "device_value": 150.0, "device_unit": "steps"}
    orchestrator.plan("webcam", "b", **planned)
    assert orchestrator.wait_for("webcam", "b", ACCEPTED).read_value == 150.0
    assert VERIFIED not in [s.status for s in orchestrator.states("webcam", "b")]


@pytest.mark.processes
def test_what_is_no_order_costs_nothing_of_the_one_in_force(rig, orchestrator):
    orchestrator.plan("mute", "in force", focus_distance=0.5)
    orchestrator.wait_for("mute", "in force", ACCEPTED)
    for plan_id, bad in {
        "another's": {"name": "good"},
        "unknown": {"status": 77},
        "negative": {"focus_distance": -0.5},
        "not finite": {"focus_distance": math.inf},
        "contradicting": {"dioptres": 4.0},
    }.items():
        orchestrator.plan("mute", plan_id, **bad)
        state = orchestrator.wait_for("mute", plan_id, FAILED)
        assert (math.isnan(state.sent_value), state.unit) == (True, "")
        assert next(iter(bad)) in state.message
    good = {"name": "mute", "plan_id": "in force", "status": 1, "focus_distance": 0.5}
    for payload in orders(np.random.default_rng(5), 100, good):
        orchestrator.publish("mute", payload)
    orchestrator.plan("mute", "next", focus_distance=0.25)
    assert orchestrator.wait_for("mute", "next", ACCEPTED).read_value == 4.0


@pytest.mark.processes
def test_what_cannot_be_told_says_why(rig, orchestrator):
    orchestrator.plan("unknown", "a")
    assert "lens tables" in orchestrator.wait_for("unknown", "a", FAILED).message
    orchestrator.plan("unknown", "b", status=0)
    assert "not from a plan" in orchestrator.wait_for("unknown", "b", FAILED).message


@pytest.mark.processes
def test_a_driver_that_is_started_later_is_told_and_one_that_is_killed_too(
    rig, orchestrator, start
):
    orchestrator.plan("absent", "a", focus_distance=0.2)
    assert "found none; start it" in orchestrator.wait_for("absent", "a", FAILED).message
    slow = start("simulated_lens", cameras=["absent"], speed=SLOW / 2, **FRAMES)
    orchestrator.wait_for("absent", "a", SENT)
    slow.kill()
    state = orchestrator.wait_for("absent", "a", FAILED)
    assert state.sent_value == 5.0
    start("simulated_lens", cameras=["absent"], **FRAMES)
    assert orchestrator.wait_for("absent", "a", VERIFIED).read_value == 5.0


@pytest.mark.processes
def test_who_comes_late_hears_the_newest_of_all_cameras(rig, orchestrator, context):
    orchestrator.plan("good", "last", focus_distance=0.25)
    orchestrator.wait_for("good", "last", VERIFIED)
    late = Orchestrator(context)
    try:
        late.wait_for("good", "last", VERIFIED)
        late.wait_for("stuck", "a", DIFFERS)
        late.wait_for("webcam", "b", ACCEPTED)
    finally:
        late.close()


@pytest.mark.processes
@pytest.mark.parametrize(
    ("module", "number"), [("lens_adapter", signal.SIGINT), ("simulated_lens", signal.SIGTERM)]
)
def test_signals_end_it_well(rig, module, number):
    node = next(node for node in rig if node.module.endswith(module))
    node.signal(number)
    assert node.wait() == 0
    assert "Traceback" not in node.log


@pytest.mark.parametrize(
    ("module", "arguments", "error"),
    [
        (
            "lens_adapter",
            ["--ros-args"],
            (
                "lens_adapter: cameras: expected the names of cameras, got none; name them, as in"
                " cameras:=[cam_0, cam_1]"
            ),
        ),
        (
            "lens_adapter",
            ["cameras:=[a]"],
            "lens_adapter: arguments: expected none but those after --ros-args, got cameras:=[a];",
        ),
        (
            "lens_adapter",
            ["--ros-args", "-p", "cameras:=[a]", "-p", "timeout:=-1.0"],
            "lens_adapter: Invalid parameter value (-1.0) for",
        ),
        (
            "lens_adapter",
            ["--ros-args", "-p", "cameras:=['a b']"],
            "lens_adapter: camera name: expected letters, digits and underscores,",
        ),
        (
            "simulated_lens",
            ["--ros-args", "-p", "cameras:=[a]", "-p", "driver_node:=/{camera}/my-node"],
            "simulated_lens: Invalid node name: node name must not",
        ),
    ],
)
def test_bad_arguments_end_it_with_one_line(module, arguments, error, signals, capsys):
    assert import_module(f"focus_planner.ros.{module}").main(arguments, signals) == 2
    told = capsys.readouterr().err
    assert told.startswith(error)
    assert len(told.splitlines()) == 1
