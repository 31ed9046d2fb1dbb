# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Runs planned again: the same to the bit, or what differs is named."""

from __future__ import annotations

import math
from dataclasses import replace
from datetime import datetime, timedelta, timezone

import numpy as np
import pytest

from focus_planner.core.planning import formulation
from focus_planner.core.planning import solving as planning
from focus_planner.core.planning.fingerprint import Fingerprint
from focus_planner.core.planning.request import METHODS, PlanRequest
from focus_planner.core.planning.stop_log import StopLog
from focus_planner.core.problem.cost_model import CostModel
from focus_planner.core.progress import never_stop
from focus_planner.core.rig.layouts import cylinder_rig
from focus_planner.core.rig.rig import Rig
from focus_planner.core.surface.scene import Scene
from focus_planner.core.surface.surface import Mesh
from focus_planner.messages.reading import Optics, mesh_from_bytes
from focus_planner.messages.typestore import deserialize, fields_of, serialize
from focus_planner.messages.writing import mesh_to_bytes
from focus_planner.parameters.planner_settings import Recording
from focus_planner.recording.recorder import Recorder
from focus_planner.recording.replay import differences, outcome_differences, plan_run
from focus_planner.recording.run_inputs import input_messages
from focus_planner.recording.run_reading import read_run
from focus_planner.recording.run_writing import inputs_of
from focus_planner.recording.what_if import parse_changes, with_changes
from focus_planner.runtime.inputs import Arrival
from focus_planner.runtime.planner import NotReady, Planner, internal_error
from testing.clock import Clock
from testing.contents import in_full
from testing.problems import box
from testing.runs import (
    REQUEST,
    RIG,
    TORUS,
    Log,
    beginning_with,
    cloud,
    partial_copy,
    record,
    record_failure,
    rewritten,
    solved,
    with_payload,
)

PLAN, RESULT = "focus_planner_msgs/msg/FocusPlan", "focus_planner_msgs/msg/RunResult"
RIG_TYPE = "focus_planner_msgs/msg/CameraRig"
STAGES = ["fresh samples", "fresh visibility", "fresh costs", "samples", "visibility", "costs"]


def replayed(path, on_progress=never_stop):
    run = read_run(path)
    return run, plan_run(run, on_progress)


def found(path):
    return differences(*replayed(path))


def stages(differences_):
    return [difference.stage for difference in differences_]


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    """A run, and its plan."""
    return record(tmp_path_factory.mktemp("runs"))


@pytest.fixture(scope="module")
def run(path):
    return read_run(path)


# --- the same ----------------------------------------------------------------------------------

SMALL = PlanRequest("em", 250, fresh_samples=200)


def test_a_rig_of_different_cameras_is_reproduced(tmp_path):
    plain = RIG.cameras[0].intrinsics
    images = (
        plain,
        replace(plain, distortion_model="plumb_bob", distortion=(-0.2, 0.05, 1e-3, 0, 0.1)),
        replace(plain, distortion_model="equidistant", distortion=(0.0, 0.1, 0.0, 0.0)),
        replace(plain, region=(100, 60, 301, 300), binning=(2, 4)),
    )
    cameras = tuple(replace(c, intrinsics=images[i % 4]) for i, c in enumerate(RIG.cameras))
    rig = replace(RIG, cameras=cameras)
    path = record(tmp_path, SMALL, rig=rig)
    run, again = replayed(path)
    assert differences(run, again) == []
    assert [a.read(Optics()) for a in run.rigs()] == [rig]
    assert run.ending.plan.cost != solved(beginning_with(SMALL)).cost
    changed = with_changes(run, parse_changes(["f_number=8"])).run
    (arrival,) = changed.rigs()
    assert [c.intrinsics for c in arrival.read(Optics()).cameras] == [c.intrinsics for c in cameras]


@pytest.mark.parametrize("method", METHODS)
def test_every_method_is_reproduced(tmp_path, method):
    path = record(tmp_path, replace(SMALL, method=method, seed=3))
    run, again = replayed(path)
    assert differences(run, again) == []
    assert again.ending.plan.method == method
    assert again.ending.plan.seed == 3


@pytest.mark.parametrize(
    "request_",
    [
        replace(SMALL, method="k_view", k=3),
        replace(SMALL, method="k_view", scope="assigned"),
        replace(SMALL, method="k_view", k=3, scope="assigned", bound="tight", gap=1e-3),
        replace(SMALL, method="k_view", tuples="grid", bound="none"),
        replace(SMALL, shots=2, depth_tolerance=0.01),
        replace(SMALL, method="optimal", shots=3, gap=0.02),
        replace(SMALL, samples=0, standard_error=6.0),
        replace(SMALL, method="k_view", views=3, max_mm_per_pixel=4.0, bound="none"),
    ],
    ids=lambda request: f"{request.method}-{request.k}-{request.scope}-{request.shots}",
)
def test_every_kind_of_request_is_reproduced(tmp_path, request_):
    rig = cylinder_rig(2, 5, radius=2.5, bottom=-0.3, top=0.3)
    path = record(tmp_path, request_, rig=rig)
    run, again = replayed(path)
    assert differences(run, again) == []
    assert run.beginning.request == request_
    plan = again.ending.plan
    assert (plan.shots, plan.views) == (request_.shots, request_.views)
    assert plan.max_mm_per_pixel == request_.max_mm_per_pixel
    assert run.ending.plan.sharp_areas == plan.sharp_areas != ()
    assert run.ending.plan.resolution == plan.resolution is not None


@pytest.mark.parametrize("normals", [False, True])
@pytest.mark.parametrize("samples", [0, 300])
def test_a_cloud_is_reproduced(tmp_path, normals, samples):
    surface = cloud(normals, importance=normals)
    path = record(tmp_path, replace(SMALL, samples=samples), surface)
    run, again = replayed(path)
    assert differences(run, again) == []
    assert again.ending.plan.samples == (samples or len(surface.points))


def test_a_mesh_with_normals_and_importance_is_reproduced(tmp_path):
    random = np.random.default_rng(0)
    normals = TORUS.vertices / np.linalg.norm(TORUS.vertices, axis=1)[:, None]
    normals += random.normal(0, 0.1, normals.shape)
    surface = Mesh(TORUS.vertices, TORUS.triangles, normals, random.random(len(normals)))
    path = record(tmp_path, SMALL, surface)
    run, again = replayed(path)
    assert differences(run, again) == []
    plain = plan_run(read_run(record(tmp_path, SMALL)))
    assert plain.ending.plan.cost != again.ending.plan.cost


def test_another_cost_model_is_reproduced(tmp_path):
    values = {"cost__focus_weight": 0.8, "cost__projected_area_weight": 0.1}
    path = record(tmp_path, SMALL, cost__axis_deviation_weight=0.05, **values)
    run, again = replayed(path)
    assert run.beginning.settings.model == CostModel(0.1, 0.05, 0.8)
    assert differences(run, again) == []


def stop_after(count, stages_=None):
    """A watch that says no after so many steps of these stages."""
    heard = []

    def on_progress(progress):
        if stages_ is None or progress.stage in stages_:
            heard.append(progress)
        return len(heard) < count

    return on_progress


@pytest.mark.parametrize(
    ("method", "on_progress"),
    [
        ("em", stop_after(2, ["em"])),
        ("k_view", stop_after(6, ["solving", "em", "2-view", "k_view"])),
        ("optimal", stop_after(3, ["solving", "optimal", "prices"])),
        ("em", stop_after(1, ["prices"])),
        ("em", stop_after(1, ["fresh"])),
        ("k_view", stop_after(2, ["visibility"])),
        ("optimal", stop_after(1)),
        ("k_view", stop_after(1, ["cells"])),
        ("optimal", stop_after(3, ["cells"])),
        *((method, stop_after(1, ["solving"])) for method in METHODS),
        # At the first step after "solving", whatever its stage.
        *((method, stop_after(2, ["solving", *METHODS])) for method in METHODS),
    ],
)
def test_a_plan_that_was_ended_is_reproduced_without_being_ended(tmp_path, method, on_progress):
    path = record(
        tmp_path, PlanRequest(method, 3000, fresh_samples=3000, gap=0.01), on_progress=on_progress
    )
    run, again = replayed(path)
    assert run.ending.stop_log.stopped
    assert differences(run, again) == []
    # It really was ended, and would not be now.
    to_its_end = plan_run(run, stop_as_recorded=False)
    assert differences(run, to_its_end) != []
    assert not to_its_end.ending.stop_log.stopped


@pytest.mark.parametrize("seconds", [0.5, 3.5, 20.5])
def test_a_plan_that_its_time_budget_ended_is_reproduced(tmp_path, seconds):
    request = PlanRequest("optimal", 3000, time_budget=seconds, gap=0.0)
    path = record(tmp_path, request, clock=Clock(1.0))
    run, again = replayed(path)
    assert not run.ending.plan.converged
    assert differences(run, again) == []


def test_a_warm_start_is_reproduced(tmp_path):
    first = solved(beginning_with(SMALL))
    assert first.prices is not None
    path = record(tmp_path, replace(SMALL, seed=5), warm_start=first.warm_start)
    run, again = replayed(path)
    assert differences(run, again) == []
    cold = plan_run(replace(run, beginning=replace(run.beginning, warm_start=None)))
    assert differences(run, cold) != []


def test_replaying_calls_back_and_stops_when_told(run):
    told = []
    whole = plan_run(run, lambda step: told.append(step) or True)
    assert repr(tuple(told)) == repr(whole.progress) == repr(run.progress)
    ended = plan_run(run, stop_after(2, ["em"]))
    assert len(ended.progress) < len(run.progress)
    assert differences(run, ended) != []


def test_a_replay_has_what_a_recorder_needs(run):
    again = plan_run(run)
    assert again.plan.problem.sample_count == REQUEST.samples
    assert in_full(again.rig) == in_full(RIG)


def test_a_partial_run_can_be_planned(path, tmp_path, run):
    partial = read_run(partial_copy(path, tmp_path / path.name))
    assert partial.ending is None
    assert plan_run(partial).ending.plan.cameras == run.ending.plan.cameras


# --- what had no plan --------------------------------------------------------------------------


class Bench:
    """A planner, a clock that ticks with every message, and its recorder."""

    def __init__(self):
        self.planner = Planner(Log())
        self._now = datetime(2026, 1, 1, tzinfo=timezone.utc)

    def surface(self, mesh):
        self.planner.surface.receive(self._arrival("mesh", mesh))
        self.planner.digest(Optics())

    def rig(self, rig):
        message = inputs_of(beginning_with(rig=rig), TORUS, rig)[-1]
        read = read_run_rig(message)
        self._now += timedelta(seconds=1)
        topic = "/focus_planner/rig"
        arrival = Arrival(topic, message.type_name, message.payload, read, self._now)
        self.planner.rig.receive(arrival)
        self.planner.digest(Optics())

    def _arrival(self, name, mesh):
        self._now += timedelta(seconds=1)
        payload = mesh if isinstance(mesh, bytes) else mesh_to_bytes(mesh)
        kind = "shape_msgs/msg/Mesh"
        topic = f"/focus_planner/{name}"
        return Arrival(topic, kind, payload, lambda _: mesh_from_bytes(payload), self._now)

    def call(self, folder, request=SMALL):
        """Plan and record, as the node does; return the run's folder."""
        self.planner.digest(Optics())
        inputs = [
            each
            for arrival in self.planner.arrivals()
            for each in input_messages("/focus_planner", arrival)
        ]
        recorder = Recorder(Log())
        run = recorder.begin(Recording(folder), inputs, beginning_with(request))
        try:
            plan, rig, _ = self.planner.plan(request, CostModel(), run.wrap_callback(never_stop))
        except (NotReady, ValueError) as error:
            run.finish(False, str(error))
        else:
            run.finish(True, plan.summary(), plan, rig)
        assert recorder.close(240)
        return run.path


def read_run_rig(message):
    from focus_planner.messages.reading import rig_from_message  # noqa: PLC0415 - beside its use

    return lambda optics: rig_from_message(message.read(), optics, "world")


FAR = box((0.3, 0.3, 0.3), (0.0, 0.0, 90.0))
FAR_RIG = Rig(
    tuple(replace(c, position=(*c.position[:2], c.position[2] + 90.0)) for c in RIG.cameras)
)


def test_where_there_was_nothing_to_plan_with_there_is_nothing_now(tmp_path):
    bench = Bench()
    nothing = bench.call(tmp_path)
    bench.surface(TORUS)
    no_rig = bench.call(tmp_path)
    for path in (nothing, no_rig):
        run, again = replayed(path)
        assert not run.ending.success
        assert "rig: expected poses on ~/camera_poses" in again.ending.message
        assert differences(run, again) == []


def test_what_was_refused_is_refused_again(tmp_path):
    bench = Bench()
    bench.surface(TORUS)
    bench.rig(RIG)
    bench.surface(b"no mesh")
    run, again = replayed(bench.call(tmp_path))
    assert "stays in force: call again to plan with that one" in again.ending.message
    assert "at 00:00:03 UTC" in again.ending.message
    assert differences(run, again) == []
    # And the next caller got a plan for the old one.
    run, again = replayed(bench.call(tmp_path))
    assert run.ending.success
    assert differences(run, again) == []


def test_nothing_good_was_in_force(tmp_path):
    bench = Bench()
    bench.rig(RIG)
    bench.surface(b"no mesh")
    for _ in range(2):
        run, again = replayed(bench.call(tmp_path))
        assert "none that can be used: the surface received on" in again.ending.message
        assert differences(run, again) == []


@pytest.mark.parametrize("republished", [False, True])
def test_what_did_not_fit_does_not_fit_again(tmp_path, republished):
    bench = Bench()
    bench.surface(TORUS)
    bench.rig(RIG)
    bench.surface(FAR)
    if republished:
        bench.rig(RIG)
    for success in (False, True):
        run, again = replayed(bench.call(tmp_path))
        assert run.ending.success is success
        assert differences(run, again) == []


def test_a_surface_and_a_rig_that_never_fitted_do_not_fit_now(tmp_path):
    bench = Bench()
    bench.surface(TORUS)
    bench.rig(FAR_RIG)
    run, again = replayed(bench.call(tmp_path))
    assert not run.ending.success
    assert differences(run, again) == []


@pytest.mark.parametrize(
    "request_",
    [
        replace(SMALL, method="k_view", tuples="grid"),
        replace(SMALL, depth_tolerance=9.0),
        replace(SMALL, samples=0, standard_error=1e-9),
    ],
)
def test_a_request_that_failed_fails_again(tmp_path, request_):
    beginning = beginning_with(request_)
    with pytest.raises(ValueError, match="expected") as told:
        solved(beginning)
    inputs = inputs_of(beginning, TORUS, RIG)
    run, again = replayed(record_failure(tmp_path, beginning, inputs, str(told.value)))
    assert again.ending.message == str(told.value)
    assert again.plan is None
    assert differences(run, again) == []


def test_a_request_that_says_what_there_is_not_fails_again(tmp_path):
    beginning = replace(beginning_with(), asked={"method": "best"})
    with pytest.raises(ValueError, match="method: expected one of closest") as told:
        _ = beginning.request
    inputs = inputs_of(beginning, TORUS, RIG)
    assert found(record_failure(tmp_path, beginning, inputs, str(told.value))) == []


RESULT = "focus_planner_msgs/msg/RunResult"


# --- what differs ------------------------------------------------------------------------------


def test_a_failure_that_is_none_now_is_told(tmp_path):
    beginning = beginning_with()
    inputs = inputs_of(beginning, TORUS, RIG)
    (difference,) = found(record_failure(tmp_path, beginning, inputs, "no idea"))
    assert difference.stage == "outcome"
    assert difference.what.startswith("recorded: no idea; now: a plan of cost 8")


def test_another_failure_is_told(tmp_path):
    beginning = beginning_with(replace(SMALL, depth_tolerance=9.0))
    inputs = inputs_of(beginning, TORUS, RIG)
    (difference,) = found(record_failure(tmp_path, beginning, inputs, "no idea"))
    assert difference.stage == "outcome"
    assert difference.what.startswith("recorded: no idea; now: depth_tolerance: expected")


def test_a_plan_that_is_none_now_is_told(run):
    beginning = replace(run.beginning, asked={**run.beginning.asked, "depth_tolerance": 9.0})
    changed = replace(run, beginning=beginning)
    (difference,) = differences(changed, plan_run(changed))
    assert difference.stage == "outcome"
    assert difference.what.startswith(f"recorded: a plan of cost {run.ending.plan.cost:.2f}; now:")
    assert "depth_tolerance: expected" in difference.what


def tampered(path, to, type_name, change):
    """The run with the fields of one kind of message changed."""

    def changed(message):
        if message.type_name != type_name:
            return message
        fields = fields_of(deserialize(type_name, message.payload))
        change(fields)
        return with_payload(message, serialize(type_name, fields))

    return rewritten(path, to, changed)


def test_unchanged_it_is_the_same(path, tmp_path):
    assert found(rewritten(path, tmp_path / "same", lambda message: message)) == []
    assert found(tampered(path, tmp_path / "same too", PLAN, lambda _: None)) == []


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"success": False, "message": "no plan"}, "recorded: no plan, beside a plan of cost"),
        ({"success": False}, ", beside a plan of cost"),
        ({"message": "em, cost 1.0 on 300 samples"}, "; of the plan: em, cost"),
        ({"message": "no plan"}, "recorded: no plan; of the plan: em, cost"),
    ],
)
def test_another_outcome_of_the_same_plan_is_told(path, tmp_path, changes, told):
    run = tampered(path, tmp_path / "x", RESULT, lambda fields: fields.update(changes))
    difference = found(run)[-1]
    assert difference.stage == "outcome"
    assert told in difference.what


def test_a_success_without_a_plan_is_told(path, tmp_path):
    run = rewritten(path, tmp_path / "x", lambda m: None if m.type_name == PLAN else m)
    (difference,) = found(run)
    assert difference.what.startswith("recorded: success without a plan: em, cost")


@pytest.mark.parametrize(("metres", "told"), [(0.0125, "12.5 mm"), (1e-9, "1e-06 mm")])
def test_one_focus_distance_that_differs_is_told(path, tmp_path, metres, told):
    def change(fields):
        fields["cameras"][3]["focus_distance"] += metres

    (difference,) = found(tampered(path, tmp_path / "x", PLAN, change))
    assert difference.stage == "focus"
    assert difference.what == f"1 of 8 cameras; the farthest, c3, by {told}"


def test_the_least_bit_of_a_focus_distance_counts(path, tmp_path):
    def change(fields):
        one = fields["cameras"][0]
        one["focus_distance"] = math.nextafter(one["focus_distance"], 9.0)
        fields["cameras"][1]["shots"][0]["far_limit"] *= 1.5

    (difference,) = found(tampered(path, tmp_path / "x", PLAN, change))
    assert difference.stage == "focus"
    assert difference.what.startswith("2 of 8 cameras; the farthest, c0, by ")


def with_from_sensor(fields, change):
    for camera in fields["cameras"]:
        for each in (camera, *camera["shots"]):
            each["from_sensor"] = change(each["from_sensor"])


def test_a_run_older_than_distances_from_the_sensor_is_reproduced(path, tmp_path):
    old = tampered(
        path, tmp_path / "x", PLAN, lambda fields: with_from_sensor(fields, lambda _: 0.0)
    )
    assert all(camera.from_sensor is None for camera in read_run(old).ending.plan.cameras)
    run, again = replayed(old)
    assert differences(run, again) == []
    assert all(camera.from_sensor > camera.focus_distance for camera in again.plan.cameras)


def test_the_least_bit_of_a_distance_from_the_sensor_counts(path, tmp_path):
    def change(fields):
        with_from_sensor(fields, lambda metres: np.nextafter(metres, 9.0))

    (difference,) = found(tampered(path, tmp_path / "x", PLAN, change))
    assert difference.what == "8 of 8 cameras, at the same distances"


def test_cameras_that_differ_in_samples_only_are_told_so(path, tmp_path):
    def change(fields):
        fields["cameras"][5]["assigned_samples"] += 1

    (difference,) = found(tampered(path, tmp_path / "x", PLAN, change))
    assert difference.stage == "focus"
    assert difference.what == "1 of 8 cameras, at the same distances"


def test_other_cameras_are_told(path, tmp_path):
    (difference,) = found(tampered(path, tmp_path / "x", PLAN, lambda f: f["cameras"].pop()))
    assert (difference.stage, difference.what) == ("focus", "other cameras")


def test_a_cost_that_differs_is_told(path, tmp_path, run):
    def change(fields):
        fields["cost"] = math.nextafter(fields["cost"], 0.0)
        fields["converged"] = False
        fields["total_seconds"] = 99.0

    (difference,) = found(tampered(path, tmp_path / "x", PLAN, change))
    assert difference.stage == "plan"
    cost = run.ending.plan.cost
    assert difference.what == (
        f"cost {math.nextafter(cost, 0.0)!r} then, {cost!r} now; converged False then, True now"
    )


def flip(visibility, camera=2):
    """The same visibility, but that one camera does not see what it saw first."""
    at = int(visibility.camera_offsets[camera])
    offsets = visibility.camera_offsets.copy()
    offsets[camera + 1 :] -= 1
    return replace(
        visibility, camera_offsets=offsets, sample_index=np.delete(visibility.sample_index, at)
    )


@pytest.fixture
def one_core(monkeypatch):
    """Problems are formulated one after the other: trials, fresh samples, and then the samples."""
    monkeypatch.setattr("numba.config.NUMBA_NUM_THREADS", 1)


def test_one_pair_that_is_not_seen_now_is_told(run, monkeypatch, one_core):
    visible_pairs = formulation.visible_pairs
    pairs = len(solved(beginning_with()).problem.depth)
    looks = []

    def other(scene, rig, samples, *how, **more):
        looks.append(len(samples))
        seen = visible_pairs(scene, rig, samples, *how, **more)
        return flip(seen) if looks.count(300) == 2 else seen

    monkeypatch.setattr(formulation, "visible_pairs", other)
    (first, *others) = differences(run, plan_run(run))
    assert looks == [500, 500, 300, 300]
    assert first.stage == "visibility"
    assert first.what == (f"1 of 8 cameras see other samples; pairs: {pairs} then, {pairs - 1} now")
    assert others[0].stage == "costs"
    assert others[0].what.startswith("1 of 8 cameras have other costs; pairs: ")


def test_one_ray_that_hits_now_is_told(run, monkeypatch, one_core):
    occluded, fresh_samples = Scene.occluded, Scene.fresh_samples
    drawn = []

    def draw(*how):
        drawn.append(fresh_samples(*how))
        return drawn[-1]

    def other(scene, rays):
        hidden = occluded(scene, rays)
        if len(drawn) == 1:
            hidden[np.flatnonzero(~hidden)[5]] = True
            drawn.append(None)
        return hidden

    monkeypatch.setattr(Scene, "fresh_samples", draw)
    monkeypatch.setattr(Scene, "occluded", other)
    found_ = differences(run, plan_run(run))
    assert stages(found_)[:2] == ["fresh visibility", "fresh costs"]
    assert found_[0].what.startswith("1 of 8 cameras see other samples; pairs: ")
    # The plan itself does not know the fresh samples.
    assert set(stages(found_)[2:]) <= {"plan"}


def test_other_samples_are_told(run):
    changed = replace(
        run, beginning=replace(run.beginning, asked={**run.beginning.asked, "seed": 4})
    )
    found_ = differences(changed, plan_run(changed))
    assert stages(found_)[:6] == STAGES
    assert found_[0].what == "not the same bits; 300 then, 300 now"
    assert stages(found_)[6:] == ["steps", "plan", "focus"]
    assert "seed 0 then, 4 now" in found_[7].what


def test_more_samples_are_told(run):
    asked = {**run.beginning.asked, "samples": 310}
    changed = replace(run, beginning=replace(run.beginning, asked=asked))
    found_ = differences(changed, plan_run(changed))
    assert stages(found_)[:3] == ["samples", "visibility", "costs"]
    assert found_[0].what == "not the same bits; 300 then, 310 now"


def test_other_costs_are_told(run, monkeypatch):
    build_problem = formulation.build_problem

    def other(samples, visibility, rig, model, tolerance):
        return build_problem(samples, visibility, rig, CostModel(focus_weight=0.3), tolerance)

    monkeypatch.setattr(formulation, "build_problem", other)
    found_ = differences(run, plan_run(run))
    # What is out of focus costs something else: the plan tells, no stage before the solver does.
    assert found_[0].stage == "steps"

    def others(samples, visibility, rig, model, tolerance):
        model = CostModel(axis_deviation_limit=0.8)
        return build_problem(samples, visibility, rig, model, tolerance)

    monkeypatch.setattr(formulation, "build_problem", others)
    found_ = differences(run, plan_run(run))
    assert stages(found_)[:2] == ["fresh costs", "costs"]
    assert "of 8 cameras have other costs; pairs: " in found_[1].what


def test_another_rig_is_told(path, tmp_path):
    def change(fields):
        fields["cameras"][6]["pose"]["position"]["x"] += 1e-6

    first, *_ = found(tampered(path, tmp_path / "x", RIG_TYPE, change))
    assert first.stage in ("fresh costs", "fresh visibility")
    assert "1 of 8 cameras" in first.what


def test_one_step_that_differs_is_told(run):
    k = len(run.progress) - 1
    steps = list(run.progress)
    steps[k] = replace(steps[k], cost=123.5)
    (difference,) = differences(replace(run, progress=tuple(steps)), plan_run(run))
    assert difference.stage == "steps"
    last = run.progress[k]
    assert difference.what == (
        f"step {k + 1}: {last.stage} {last.iteration} of cost 123.5, bound {last.lower_bound!r}"
        f" then, {last.stage} {last.iteration} of cost {last.cost!r}, bound {last.lower_bound!r}"
        " now"
    )


def test_one_bound_that_differs_is_told(run):
    k = next(k for k, step in enumerate(run.progress) if step.lower_bound is not None)
    steps = list(run.progress)
    steps[k] = replace(steps[k], lower_bound=1.5)
    (difference,) = differences(replace(run, progress=tuple(steps)), plan_run(run))
    assert difference.stage == "steps"
    assert "bound 1.5 then" in difference.what


def test_steps_that_are_missing_are_told(run):
    again = plan_run(run)
    count = len(run.progress)
    (fewer,) = differences(replace(run, progress=run.progress[:-1]), again)
    assert fewer.what.startswith(f"step {count}: none then, ")
    (more,) = differences(replace(run, progress=(*run.progress, run.progress[-1])), again)
    assert more.what.startswith(f"step {count + 1}: ")
    assert more.what.endswith(" then, none now")


def test_a_solver_that_does_something_else_is_told(run, monkeypatch):
    # As another version of the package would.
    monkeypatch.setattr(
        planning, "spread_start", lambda problem: np.full(problem.camera_count, 9.9)
    )
    found_ = differences(run, plan_run(run))
    assert stages(found_)[0] == "steps"
    assert found_[0].what.startswith("step ")


def test_a_stage_that_is_not_there_now_is_told(run):
    prints = (*run.ending.fingerprints, Fingerprint("cells", (1,), (2,)))
    changed = replace(run, ending=replace(run.ending, fingerprints=prints))
    (difference,) = differences(changed, plan_run(run))
    assert (difference.stage, difference.what) == ("cells", "no such stage now")


def test_an_outcome_from_elsewhere_is_compared_by_its_plan(run):
    again = plan_run(run)
    ending = replace(again.ending, fingerprints=(), stop_log=StopLog())
    assert outcome_differences(run, ending) == []
    plan = ending.plan
    moved = replace(plan.cameras[0], focus_distance=plan.cameras[0].focus_distance + 0.5)
    other = replace(ending, plan=replace(plan, cameras=(moved, *plan.cameras[1:])))
    (difference,) = outcome_differences(run, other)
    assert difference.what == "1 of 8 cameras; the farthest, c0, by 500 mm"


def test_what_should_not_happen_is_replayed_too(tmp_path, monkeypatch):
    path = record(tmp_path)
    broken = ZeroDivisionError("a bug")

    def fail(*_, **__):
        raise broken

    monkeypatch.setattr("focus_planner.runtime.planner.plan_focus", fail)
    run, again = replayed(path)
    assert not again.ending.success
    (difference,) = differences(run, again)
    assert "now: internal error: ZeroDivisionError('a bug')" in difference.what
    run_of_it = replace(run, ending=replace(again.ending, message=internal_error(broken)))
    assert differences(run_of_it, again) == []
