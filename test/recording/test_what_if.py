# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A recorded run with changes is what a plan with these changes is."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from focus_planner.core.notes import Note
from focus_planner.core.planning.plan_focus import plan_focus
from focus_planner.core.planning.request import PlanRequest
from focus_planner.core.problem.cost_model import CostModel
from focus_planner.core.rig.camera import CameraIntrinsics
from focus_planner.core.rig.lens import Lens
from focus_planner.core.rig.lens_table import LensTable
from focus_planner.core.rig.optics import hyperfocal_distance
from focus_planner.core.rig.rig import Rig
from focus_planner.core.surface.scene import Scene
from focus_planner.core.validation import InputError
from focus_planner.messages.typestore import POSES, RIG, serialize
from focus_planner.messages.writing import poses_to_fields, rig_to_fields
from focus_planner.parameters.planner import DECLARATIONS
from focus_planner.parameters.planner_settings import Recording, Settings
from focus_planner.recording.bag import BagMessage
from focus_planner.recording.recorder import Recorder
from focus_planner.recording.replay import differences, plan_run
from focus_planner.recording.run import Run
from focus_planner.recording.run_inputs import surface_messages
from focus_planner.recording.run_reading import read_run
from focus_planner.recording.run_writing import inputs_of
from focus_planner.recording.what_if import parse_changes, settable_names, with_changes
from testing.contents import in_full
from testing.runs import REQUEST, TORUS, Log, beginning_with, record
from testing.runs import RIG as SMALL_RIG

OWN = SMALL_RIG.cameras[0].lens
#: F²/H of the rig's lenses: f-number times circle of confusion.
PRODUCT = OWN.focal_length**2 / OWN.hyperfocal_distance


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return read_run(record(tmp_path_factory.mktemp("runs")))


def lens_fields(**values):
    return {"focal_length": 0.05, "min_focus": 0.3, **values}


def run_of(messages, **values):
    """A run on these inputs, not written anywhere."""
    beginning = beginning_with(**values)
    surface = surface_messages(beginning.planner, TORUS, "world", beginning.at)
    inputs = (*surface, *(replace(m, at=beginning.at) for m in messages))
    return Run(None, inputs, beginning, (), None, "")


def poses_run(**values):
    payload = serialize(POSES, poses_to_fields(SMALL_RIG))
    message = BagMessage("/focus_planner/camera_poses", POSES, payload, 0)
    return run_of([message], **values)


def rig_run(*lenses, **values):
    """A run on a rig message whose cameras' lenses, in turn, say these fields."""
    fields = rig_to_fields(SMALL_RIG)
    for k, camera in enumerate(fields["cameras"]):
        camera["lens"] = lenses[k % len(lenses)]
    message = BagMessage("/focus_planner/rig", RIG, serialize(RIG, fields), 0)
    return run_of([message], **values)


def rig_of(run):
    (arrival,) = run.rigs()
    return arrival.read(run.beginning.settings.optics)


def lenses_of(run):
    return [camera.lens for camera in rig_of(run).cameras]


def changed(run, *assignments):
    return with_changes(run, parse_changes(list(assignments)))


# --- what is asked for -------------------------------------------------------------------------

TEXTS = {
    str: ("optimal", "optimal"),
    bool: ("True", True),
    int: ("7", 7),
    float: ("2.5e-1", 0.25),
    tuple: ("0.5,1.25", (0.5, 1.25)),
}


def test_all_that_a_plan_depends_on_can_be_set():
    names = settable_names()
    assert len(set(names)) == len(names)
    fixed = {"frame_id", "subjects", "warm_start"}
    for declaration in DECLARATIONS:
        assert (declaration.name in names) is (declaration.name not in fixed and declaration.plans)
        if declaration.name.startswith("lens."):
            assert declaration.name.removeprefix("lens.") in names


@pytest.mark.parametrize("name", settable_names())
def test_every_name_takes_a_value_of_its_kind(name):
    defaults = {d.name: d.default for d in DECLARATIONS}
    full = name if name in defaults else f"lens.{name}"
    text, value = TEXTS[type(defaults[full])]
    assert parse_changes([f"{name}={text}"]) == {full: value}
    assert type(parse_changes([f"{name}={text}"])[full]) is type(defaults[full])


@pytest.mark.parametrize(
    ("assignment", "value"),
    [
        ("focus_distances=[0.5, 1, 2]", (0.5, 1.0, 2.0)),
        ("focus_distances=0.75", (0.75,)),
        ("max_focus=-0", -0.0),
        ("seed= 12", 12),
        ("samples=65_536", 65536),
    ],
)
def test_values_may_be_written_as_people_do(assignment, value):
    assert list(parse_changes([assignment]).values()) == [value]


def test_several_changes_are_taken_together():
    assignments = ["method=optimal", "f_number=8", "samples=65536", "cost.focus_weight=0.5"]
    assert parse_changes(assignments) == {
        "method": "optimal",
        "lens.f_number": 8.0,
        "samples": 65536,
        "cost.focus_weight": 0.5,
    }
    assert parse_changes([]) == {}


@pytest.mark.parametrize(
    ("assignments", "told"),
    [
        (["samples"], "--set: expected NAME=VALUE, got 'samples'"),
        (["=3"], "--set: expected a parameter .*, got ''; these can be: method, samples, "),
        (["sample=3"], r"--set: expected .*, got 'sample'; did you mean samples\?$"),
        (["f_nmber=8"], r"got 'f_nmber'; did you mean f_number\?$"),
        (["lens.f_nmber=8"], r"got 'lens.f_nmber'; did you mean lens.f_number\?$"),
        (["record_directory=/tmp"], "got 'record_directory'"),
        (["warm_start=true"], "got 'warm_start'"),
        (["frame_id=booth"], "got 'frame_id'"),
        (["samples=many"], "--set samples: expected a whole number, got 'many'"),
        (["samples=1e3"], "--set samples: expected a whole number, got '1e3'"),
        (["samples="], "--set samples: expected a whole number, got ''"),
        (["f_number=f/8"], "--set lens.f_number: expected a number, got 'f/8'"),
        (["lens.focus_distances=a,b"], "expected numbers separated by commas, got 'a,b'"),
        (["focus_distances="], "expected numbers separated by commas, got ''"),
        (["f_number=8", "lens.f_number=4"], "--set: expected lens.f_number once, got twice"),
        (["k=2", "k=2"], "--set: expected k once, got twice"),
    ],
)
def test_what_cannot_be_set_is_told_in_one_line(assignments, told):
    with pytest.raises(InputError, match=told) as error:
        parse_changes(assignments)
    assert "\n" not in str(error.value)


# --- the request -------------------------------------------------------------------------------


def test_without_changes_it_is_the_same_under_another_name(run):
    again = with_changes(run, {})
    assert again.notes == ()
    assert again.run.inputs == run.inputs
    assert again.run.beginning.request == run.beginning.request
    assert again.run.beginning.run_id != run.beginning.run_id
    assert again.run.ending is None
    assert again.run.fault


@pytest.mark.parametrize(
    ("assignment", "change"),
    [
        ("method=optimal", {"method": "optimal"}),
        ("samples=640", {"samples": 640}),
        ("seed=0", {"seed": 0}),
        ("seed=9", {"seed": 9}),
        ("k=3", {"k": 3}),
        ("scope=assigned", {"scope": "assigned"}),
        ("tuples=grid", {"tuples": "grid"}),
        ("shots=2", {"shots": 2}),
        ("depth_tolerance=0.01", {"depth_tolerance": 0.01}),
        ("depth_tolerance=0", {"depth_tolerance": 0.0}),
        ("views=3", {"views": 3}),
        ("views=1", {"views": 1}),
        ("max_mm_per_pixel=0.5", {"max_mm_per_pixel": 0.5}),
        ("max_mm_per_pixel=0", {"max_mm_per_pixel": math.inf}),
        ("time_budget=0", {"time_budget": math.inf}),
        ("time_budget=2.5", {"time_budget": 2.5}),
        ("bound=none", {"bound": "none"}),
        ("gap=0", {"gap": 0.0}),
        ("fresh_samples=77", {"fresh_samples": 77}),
        ("standard_error=0.5", {"standard_error": 0.5}),
    ],
)
def test_what_the_request_said_gives_way(tmp_path, assignment, change):
    limits = {"time_budget": 3.0, "depth_tolerance": 0.02, "max_mm_per_pixel": 2.0}
    request = PlanRequest("em", 300, 5, fresh_samples=90, gap=0.01, views=2, **limits)
    run = run_of([], request=request)
    assert run.beginning.request == request
    assert changed(run, assignment).run.beginning.request == replace(request, **change)


def test_what_the_request_left_to_the_parameters_is_changed_too(run):
    beginning = replace(run.beginning, asked={"samples": 55})
    run = replace(run, beginning=beginning)
    after = changed(run, "method=average", "fresh_samples=60").run.beginning
    assert after.request == replace(REQUEST, method="average", samples=55, fresh_samples=60)


def test_the_cost_is_changed(run):
    model = changed(run, "cost.focus_weight=0.25", "cost.axis_deviation_limit=0.5").run
    assert model.beginning.settings.model == CostModel(focus_weight=0.25, axis_deviation_limit=0.5)


@pytest.mark.parametrize(
    ("assignments", "told"),
    [
        (["method=best"], "method: expected one of closest"),
        (["samples=-3"], "samples: expected a whole number of at least 0"),
        (["k=4"], "k: expected 2 or 3, got 4"),
        (["cost.focus_weight=0.9"], "cost weights: expected a sum of at most 1"),
        (["image.width=0"], "image.width: expected a whole number of at least 1"),
        (["min_focus=3", "max_focus=2"], "lens.min_focus: expected at most max_focus"),
        (["f_number=-1"], "f_number: expected a number above 0"),
        (["f_number=0"], "f_number: expected a number above 0"),
        (["f_number=nan"], "f_number: expected a number above 0"),
        (["circle_of_confusion=0"], "circle_of_confusion: expected a number above 0"),
        (["hyperfocal_distance=inf"], "hyperfocal_distance: expected a number, got inf"),
        (["gap=nan"], "gap: expected a number of at least 0"),
        (["focal_length=0"], "focal_length: expected a number above 0"),
        (["hyperfocal_distance=-1"], "hyperfocal_distance: expected a number above"),
        (
            ["f_number=8", "hyperfocal_distance=5"],
            "expected either hyperfocal_distance or f_number",
        ),
        (["circle_of_confusion=3e-5", "hyperfocal_distance=5"], "got both"),
        (
            ["focus_steps=5"],
            r"^--set lens.focus_steps: expected lens.min_focus to be a number above focal_length",
        ),
        (
            ["focal_length=50"],
            r"^--set lens.focal_length: .* got 50; 50 is probably in millimetres: write 0.05$",
        ),
        (
            ["f_number=8", "circle_of_confusion=0.03"],
            r"^--set lens.circle_of_confusion: .*, got 0.03; 0.03 is .* write 3e-05$",
        ),
        (["f_number=0.125"], r"^--set lens.f_number: .* got 0.125; for 1/8 write 8$"),
        (["min_focus=350"], r"^--set lens.min_focus: .* in millimetres: write 0.35$"),
        (["focus_distances=0.5,1", "focus_steps=5", "min_focus=0.2"], "got both"),
    ],
)
def test_what_is_out_of_range_is_told_in_one_line(run, assignments, told):
    with pytest.raises(InputError, match=told) as error:
        changed(run, *assignments)
    assert "\n" not in str(error.value)


# --- lenses and images -------------------------------------------------------------------------


def test_lens_and_image_change_on_cameras_that_bring_their_own(run):
    after = changed(run, "min_focus=1.5", "max_focus=2.2", "image.width=500")
    assert after.notes == ()
    expected = replace(OWN, min_focus=1.5, max_focus=2.2)
    cameras = [
        replace(c, lens=expected, intrinsics=replace(c.intrinsics, width=500))
        for c in SMALL_RIG.cameras
    ]
    expected_rig = Rig(tuple(cameras), SMALL_RIG.frame_id, SMALL_RIG.grid)
    assert in_full(rig_of(after.run)) == in_full(expected_rig)


def test_lens_and_image_change_on_cameras_that_are_poses_only():
    run = poses_run(lens__hyperfocal_distance=7.0, image__height=333)
    after = changed(run, "lens.hyperfocal_distance=9", "image.fx=700")
    rig = rig_of(after.run)
    assert {camera.lens for camera in rig.cameras} == {Lens(hyperfocal_distance=9.0)}
    assert {camera.intrinsics for camera in rig.cameras} == {CameraIntrinsics(height=333, fx=700.0)}
    names = [camera.name for camera in rig_of(run).cameras]
    assert [camera.name for camera in rig.cameras] == names
    before = [(c.position, c.orientation) for c in SMALL_RIG.cameras]
    assert [(c.position, c.orientation) for c in rig.cameras] == before


def test_limits_and_steps_can_be_taken_away():
    lens = lens_fields(hyperfocal_distance=6.0, max_focus=2.0, focus_steps=20)
    run = rig_run(lens)
    assert lenses_of(run)[0].focus_steps == 20
    assert set(lenses_of(changed(run, "focus_steps=0", "max_focus=0", "min_focus=0").run)) == {
        Lens(0.05, 6.0)
    }
    listed = rig_run(lens_fields(hyperfocal_distance=6.0, focus_distances=[0.5, 1.0]))
    assert set(lenses_of(changed(listed, "focus_distances=0").run)) == {Lens(0.05, 6.0, 0.3)}
    assert set(lenses_of(changed(listed, "focus_distances=2,1").run)) == {
        Lens(0.05, 6.0, 0.3, focus_distances=(1.0, 2.0))
    }


def test_lens_tables_can_be_given_and_taken_away(run, tmp_path):
    file = tmp_path / "lenses.yaml"
    file.write_text("default: {unit: steps, whole: true, distances: [1, 5], values: [0, 64]}")
    after = changed(run, f"lens_tables={file}").run
    table = LensTable("steps", True, (1.0, 5.0), (0.0, 64.0))
    assert {lens.table for lens in lenses_of(after)} == {table}
    file.unlink()  # what it said is in the run
    told = plan_run(after, stop_as_recorded=False).plan
    for camera in told.cameras:
        assert camera.device_value == table.value_at(camera.focus_distance)
        assert camera.focus_distance in table.settable_distances
    again = changed(after, "f_number=8").run
    assert {lens.table for lens in lenses_of(again)} == {table}
    assert set(lenses_of(changed(after, "lens_tables=").run)) == {OWN}
    with pytest.raises(InputError, match=r"lenses\.yaml: expected lens tables \(YAML\), got no"):
        changed(run, f"lens_tables={file}")


def test_f_number_and_circle_may_both_be_changed(run):
    after = changed(run, "f_number=8", "circle_of_confusion=3e-5")
    assert after.notes == ()
    expected = hyperfocal_distance(OWN.focal_length, 8.0, 3e-5)
    assert {lens.hyperfocal_distance for lens in lenses_of(after.run)} == {expected}


def test_an_f_number_takes_the_circle_that_each_camera_says():
    said = [
        lens_fields(f_number=4.0, circle_of_confusion=2e-5),
        lens_fields(f_number=5.6, circle_of_confusion=4e-5),
    ]
    after = changed(rig_run(*said), "f_number=8")
    assert after.notes == ()
    expected = [hyperfocal_distance(0.05, 8.0, circle) for circle in (2e-5, 4e-5)]
    assert [lens.hyperfocal_distance for lens in lenses_of(after.run)] == pytest.approx(
        expected * 4, rel=1e-12
    )


def test_an_f_number_takes_the_circle_of_the_parameters():
    values = {"lens__hyperfocal_distance": 0.0, "lens__f_number": 4.0}
    run = poses_run(**values, lens__circle_of_confusion=2.5e-5)
    before = lenses_of(run)[0]
    assert before.hyperfocal_distance == hyperfocal_distance(0.05, 4.0, 2.5e-5)
    after = changed(run, "f_number=8")
    assert after.notes == ()
    assert lenses_of(after.run)[0].hyperfocal_distance == pytest.approx(
        before.hyperfocal_distance / 2, rel=1e-12
    )


def test_an_f_number_takes_the_usual_circle_of_the_sensor_and_says_so(run):
    after = changed(run, "f_number=8")
    intrinsics = SMALL_RIG.cameras[0].intrinsics
    diagonal = OWN.focal_length * math.hypot(
        intrinsics.width / intrinsics.fx, intrinsics.height / intrinsics.fy
    )
    expected = hyperfocal_distance(OWN.focal_length, 8.0, diagonal / 1500)
    for lens in lenses_of(after.run):
        assert lens.hyperfocal_distance == pytest.approx(expected, rel=1e-12)
    (note,) = after.notes
    assert f": {1e6 * diagonal / 1500:.3g} µm is assumed, the sensor's diagonal / 1500" in note
    assert "--set circle_of_confusion=" in note
    # Its plan has it too, and so has what is made of that one.
    assert after.run.beginning.input_notes == (Note("default_lens", note),)
    again = changed(after.run, "f_number=11")
    assert again.run.beginning.input_notes == after.run.beginning.input_notes
    told = changed(after.run, "circle_of_confusion=3e-5")
    assert told.run.beginning.input_notes == ()


def test_what_was_assumed_is_no_longer_said_of_what_was_changed(run):
    lens, image, other = Note("default_lens", "10 m"), Note("default_image", "580"), Note("up", "z")
    noted = replace(run, beginning=replace(run.beginning, input_notes=(lens, image, other)))

    def notes(*assignments):
        return changed(noted, *assignments).run.beginning.input_notes

    assert notes("samples=100") == (lens, image, other)
    half, *rest = notes("f_number=8")
    assert rest[:2] == [image, other]
    assert rest[2].text.startswith("nothing tells the circle of confusion of ")
    assert half.code == "default_lens"
    assert "10 m" not in half.text
    assert "not changed" in half.text
    both = ("f_number=8", "focal_length=0.035")
    assert notes(*both, "circle_of_confusion=3e-5") == (image, other)
    assert [note.text for note in notes("image.width=500")][::2] == ["10 m", "z"]


def test_a_hiatus_is_that_of_every_lens_and_changes_nothing_else(run):
    after = changed(run, "hiatus=0.0125")
    assert after.notes == ()
    for lens, before in zip(lenses_of(after.run), lenses_of(run), strict=True):
        assert lens == replace(before, hiatus=0.0125)


def test_a_circle_alone_keeps_the_f_number():
    said = lens_fields(f_number=4.0, circle_of_confusion=2e-5)
    after = changed(rig_run(said), "circle_of_confusion=3e-5")
    assert after.notes == ()
    for lens in lenses_of(after.run):
        assert lens.hyperfocal_distance == pytest.approx(hyperfocal_distance(0.05, 4.0, 3e-5))


def test_a_focal_length_alone_keeps_f_number_and_circle(run):
    after = changed(run, "focal_length=0.035")
    assert after.notes == ()
    for lens in lenses_of(after.run):
        assert lens.focal_length == 0.035
        assert lens.focal_length**2 / lens.hyperfocal_distance == pytest.approx(PRODUCT, rel=1e-12)


def test_a_focal_length_and_a_circle_keep_the_f_number():
    said = lens_fields(f_number=4.0, circle_of_confusion=2e-5)
    after = changed(rig_run(said), "focal_length=0.035", "circle_of_confusion=3e-5")
    for lens in lenses_of(after.run):
        assert lens.hyperfocal_distance == pytest.approx(hyperfocal_distance(0.035, 4.0, 3e-5))


def test_a_rig_that_was_refused_is_left_as_it_is():
    fields = rig_to_fields(replace(SMALL_RIG, frame_id="elsewhere"))
    message = BagMessage("/focus_planner/rig", RIG, serialize(RIG, fields), 0)
    run = run_of([message])
    assert changed(run, "f_number=8").run.inputs == run.inputs


# --- what comes of it --------------------------------------------------------------------------


def without_seconds(plan):
    return replace(plan, solve_seconds=0.0, total_seconds=0.0)


@pytest.mark.parametrize(
    ("assignments", "request_", "lens", "model"),
    [
        (["method=k_view"], {"method": "k_view"}, {}, None),
        (["samples=450", "seed=3"], {"samples": 450, "seed": 3}, {}, None),
        (["hyperfocal_distance=30"], {}, {"hyperfocal_distance": 30.0}, None),
        (["min_focus=1.9", "method=optimal"], {"method": "optimal"}, {"min_focus": 1.9}, None),
        (["cost.focus_weight=0.1"], {}, {}, CostModel(focus_weight=0.1)),
        (["shots=2"], {"shots": 2}, {}, None),
    ],
)
def test_it_is_the_plan_that_these_changes_give(run, assignments, request_, lens, model):
    again = plan_run(changed(run, *assignments).run, stop_as_recorded=False)
    cameras = tuple(replace(c, lens=replace(OWN, **lens)) for c in SMALL_RIG.cameras)
    request = replace(REQUEST, **request_)
    expected = plan_focus(Scene(TORUS), replace(SMALL_RIG, cameras=cameras), request, model)
    assert without_seconds(again.plan) == without_seconds(expected)
    assert np.array_equal(again.plan.problem.base_cost, expected.problem.base_cost)
    assert again.plan.cameras != run.ending.plan.cameras


def test_the_changed_run_is_recorded_and_replayed_as_one_of_its_own(run, tmp_path):
    after = changed(run, "f_number=11", "method=k_view", "cost.focus_weight=0.2").run
    log = Log()
    recorder = Recorder(log)
    record_ = recorder.begin(Recording(tmp_path), after.inputs, after.beginning)
    again = plan_run(after, record_.wrap_callback(lambda _: True), stop_as_recorded=False)
    record_.finish(True, again.plan.summary(), again.plan, again.rig)
    assert recorder.close(240)
    assert log.errors == []
    read = read_run(record_.path)
    assert read.beginning.run_id == after.beginning.run_id != run.beginning.run_id
    assert read.beginning.request.method == "k_view"
    assert differences(read, plan_run(read)) == []
    # And its cameras say in full what they have, whatever the parameters say.
    assert lenses_of(read) == lenses_of(after)
    plain = Settings.from_values({})
    assert rig_of(replace(read, beginning=replace(read.beginning, settings=plain))) == rig_of(after)


def test_changes_of_changes_add_up(run):
    once = changed(run, "focal_length=0.035", "samples=100").run
    twice = changed(once, "max_focus=3").run
    assert twice.beginning.request.samples == 100
    assert set(lenses_of(twice)) == {replace(lenses_of(once)[0], max_focus=3.0)}


def test_inputs_of_a_file_keep_what_is_not_changed(run):
    after = changed(run, "samples=100").run
    assert after.inputs == run.inputs
    lens = changed(run, "max_focus=3").run
    assert [m.payload for m in lens.inputs][:-1] == [m.payload for m in run.inputs][:-1]
    beginning = beginning_with()
    assert inputs_of(beginning, TORUS, rig_of(lens))[-1].payload == lens.inputs[-1].payload
