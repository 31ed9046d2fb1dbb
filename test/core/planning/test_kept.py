# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Problems that are kept between plans."""

import dataclasses
import gc
import weakref
from dataclasses import replace

import numpy as np
import pytest

from focus_planner import CostModel, Grid, Lens, PlanRequest, PointCloud, Rig, Scene, plan_focus
from focus_planner.core.notes import Note
from focus_planner.core.planning import many_subjects, solving
from focus_planner.core.planning.kept import KEPT, Kept, KeptProblem
from focus_planner.core.planning.request import METHODS
from focus_planner.core.planning.resource_limits import ResourceLimits
from focus_planner.core.planning.subjects import Subject
from focus_planner.core.problem import derived
from focus_planner.core.problem.derived import bytes_with_derived
from focus_planner.core.problem.problem import Problem
from focus_planner.core.rig.lens_table import LensTable
from testing.plans import RIG, SCENE, without_seconds
from testing.problems import sphere, torus

REQUEST = PlanRequest(samples=150, fresh_samples=120)
OTHER = Scene(sphere(0.4))
CLOUD = Scene(PointCloud(torus(0.4, 0.15).vertices))


@pytest.fixture(autouse=True)
def nothing_kept():
    """Each test begins with nothing kept."""
    KEPT.forget()


@pytest.fixture
def formulated(monkeypatch):
    """Whether each problem that was formulated is on fresh samples, one after the other."""
    monkeypatch.setattr("numba.config.NUMBA_NUM_THREADS", 1)
    calls = []
    formulate = many_subjects.formulate_problem

    def formulate_problem(*arguments, fresh=False, **options):
        calls.append(fresh)
        return formulate(*arguments, fresh=fresh, **options)

    monkeypatch.setattr(many_subjects, "formulate_problem", formulate_problem)
    return calls


def same(one, other):
    """Whether two plans are the same bit for bit, and made from the same problems."""
    assert without_seconds(one) == without_seconds(other)
    assert one.stop_log == other.stop_log
    assert (one.prices is None) == (other.prices is None)
    assert one.prices is None or one.prices.tobytes() == other.prices.tobytes()
    for name in ("problem", "fresh_problem"):
        assert content(getattr(one, name)) == content(getattr(other, name))


def content(problem):
    """All that is in a problem."""
    samples = {f"samples.{k}": v for k, v in vars(problem.samples).items()}
    fields = {each.name: getattr(problem, each.name) for each in dataclasses.fields(problem)}
    return {
        name: value.tobytes() if isinstance(value, np.ndarray) else value
        for name, value in (fields | samples).items()
        if name != "samples"
    }


def cold(*arguments, **options):
    """The plan with nothing kept before or after it."""
    KEPT.forget()
    plan = plan_focus(*arguments, **options)
    KEPT.forget()
    return plan


# --- the same plans ------------------------------------------------------------------------------


REQUESTS = {
    **{method: replace(REQUEST, method=method) for method in METHODS},
    "triples": replace(REQUEST, k=3),
    "assigned": replace(REQUEST, scope="assigned"),
    "shots": replace(REQUEST, shots=2),
    "views": replace(REQUEST, views=2),
    "pictures": replace(REQUEST, shots=2, images=8),
    "tolerance": replace(REQUEST, depth_tolerance=0.01),
    "no bound": replace(REQUEST, bound="none"),
    "as many as it takes": replace(REQUEST, samples=0, standard_error=20.0),
    "coarse": replace(REQUEST, max_mm_per_pixel=4.0),
}


@pytest.mark.parametrize("is_asked", [False, True])
@pytest.mark.parametrize("name", REQUESTS)
def test_a_warm_plan_is_the_cold_one(name, is_asked, formulated):
    options = {"on_progress": lambda _: True} if is_asked else {}
    expected = cold(SCENE, RIG, REQUESTS[name], **options)
    plan_focus(SCENE, RIG, replace(REQUESTS[name], method="em"), **options)
    formulated.clear()
    same(plan_focus(SCENE, RIG, REQUESTS[name], **options), expected)
    same(plan_focus(SCENE, RIG, REQUESTS[name], **options), expected)
    assert formulated == []


@pytest.fixture
def sorts(monkeypatch):
    """Have problems sorted by place as large ones are; the list tells how often."""
    sorts, sort_by_place = [], solving.sort_by_place
    monkeypatch.setattr(solving, "_LARGE", 0)
    monkeypatch.setattr(solving, "sort_by_place", lambda p: sorts.append(p) or sort_by_place(p))
    return sorts


@pytest.mark.parametrize("name", [name for name in REQUESTS if name != "optimal"])
def test_what_is_sorted_by_place_is_kept_with_all_that_is_derived_of_it(name, sorts):
    expected = cold(SCENE, RIG, REQUESTS[name])
    sorts.clear()
    same(plan_focus(SCENE, RIG, REQUESTS[name]), expected)
    (problem,) = sorts
    of_original, of_sorted = derived._derived[problem], derived._derived[sorted_of(problem)]
    assert list(of_original.found) == ["sorted by place"]  # the others are of no use
    found = set(of_sorted.found)
    same(plan_focus(SCENE, RIG, REQUESTS[name]), expected)
    assert sorts == [problem]
    assert set(of_sorted.found) == found
    assert ("gains", None) in found or REQUESTS[name].bound == "none" or REQUESTS[name].images
    assert KEPT.bytes == sum(bytes_with_derived(p) for p in kept_problems())


def test_what_is_derived_of_a_sorted_problem_counts(sorts):
    plan_focus(SCENE, RIG, REQUEST)
    (problem,) = sorts
    placed, whole = sorted_of(problem), bytes_with_derived(problem)
    tuples = derived._derived[placed].found["tuples", 2, "all", None, 1].tuples
    of_tuples = sum(array.nbytes for array in arrays_in(tuples))
    assert whole > bytes_with_derived(placed) > of_tuples
    derived._derived[placed].found.clear()
    assert bytes_with_derived(problem) <= whole - of_tuples


def sorted_of(problem):
    return derived._derived[problem].found["sorted by place"].problem


def kept_problems():
    return [e.value.problem for _, e in KEPT._all() if isinstance(e.value, KeptProblem)]


def test_a_callback_is_told_the_same_whatever_is_kept():
    told = [[], [], []]
    for steps in told:
        plan_focus(SCENE, RIG, REQUEST, on_progress=lambda p, to=steps: to.append(p) or True)
    assert told[0] == told[1] == told[2]


def test_who_is_asked_after_a_plan_without_questions_is_asked_all_of_them():
    told = [[], []]
    plan_focus(SCENE, RIG, REQUEST)
    for steps in told:
        plan_focus(SCENE, RIG, REQUEST, on_progress=lambda p, to=steps: to.append(p) or True)
    assert told[0] == told[1]
    assert [p.stage for p in told[0]][:1] == ["cells"]  # so few samples are one part
    more = replace(REQUEST, samples=3000, fresh_samples=3000)
    plan_focus(SCENE, RIG, more)
    stages = []
    plan_focus(SCENE, RIG, more, on_progress=lambda p: stages.append(p.stage) or True)
    assert stages[:2] == ["fresh", "fresh"]


@pytest.mark.parametrize("last", range(0, 24, 3))
def test_plans_that_are_stopped_can_be_made_again_whatever_is_kept(last):
    request = replace(REQUEST, samples=3000, fresh_samples=3000)

    def stopped():
        left = iter(range(last))
        return plan_focus(SCENE, RIG, request, on_progress=lambda _: next(left, None) is not None)

    expected = stopped()
    KEPT.forget()
    plan_focus(SCENE, RIG, request, on_progress=lambda _: True)
    warm = stopped()
    same(warm, expected)
    same(cold(SCENE, RIG, request, stop_log=warm.stop_log), expected)


def test_several_subjects_are_kept_together(formulated):
    subjects = [Subject(SCENE, "a"), Subject(OTHER, "b", 2.0)]
    expected = cold(subjects, RIG, REQUEST)
    plan_focus(subjects, RIG, REQUEST)
    formulated.clear()
    same(plan_focus(subjects, RIG, REQUEST), expected)
    assert formulated == []
    heavier = [subjects[0], replace(subjects[1], weight=3.0)]
    renamed = [subjects[0], replace(subjects[1], name="c")]
    for changed in (heavier, renamed, subjects[::-1]):
        same(plan_focus(changed, RIG, REQUEST), cold(changed, RIG, REQUEST))


def test_clouds_are_kept_too(formulated):
    request = replace(REQUEST, samples=0)
    expected = cold(CLOUD, RIG, request)
    plan_focus(CLOUD, RIG, request)
    formulated.clear()
    same(plan_focus(CLOUD, RIG, request), expected)
    assert formulated == []


# --- what it depends on --------------------------------------------------------------------------

# Changed value, and which problems are formulated for it: fresh samples (True) or those to plan on.
BOTH, NONE = [True, False], []
OF_REQUESTS = {
    "method": ("em", NONE),
    "samples": (151, [False]),
    "seed": (1, BOTH),
    "k": (3, NONE),
    "scope": ("assigned", NONE),
    "tuples": ("grid", NONE),
    "time_budget": (1e6, BOTH),  # which asks on the way
    "shots": (2, BOTH),
    "views": (2, BOTH),
    "images": (3, NONE),
    "depth_tolerance": (0.01, BOTH),
    "max_mm_per_pixel": (4.0, BOTH),
    "fresh_samples": (121, [True]),
    "standard_error": (3.0, BOTH),
    "bound": ("none", NONE),
    "gap": (0.5, NONE),
    "worst": (True, NONE),
}
OF_MODELS = {
    "projected_area_weight": 0.2,
    "axis_deviation_weight": 0.2,
    "focus_weight": 0.2,
    "projected_area_scale": 0.5,
    "axis_deviation_limit": 0.5,
}
OF_CAMERAS = {
    "name": "another",
    "intrinsics": replace(RIG.cameras[0].intrinsics, fx=301.0),
    "position": (1.01, 0.0, 0.3),
    "orientation": RIG.cameras[1].orientation,
    "lens": Lens(0.05, 9.0),
}
OF_INTRINSICS = {
    "width": 630,
    "height": 470,
    "fx": 310.0,
    "fy": 310.0,
    "cx": 300.0,
    "cy": 200.0,
    "distortion_model": "equidistant",
    "distortion": (0.1, 0.0, 0.0, 0.0),
    "binning": (2, 2),
    "region": (0, 0, 400, 400),
}
OF_LENSES = {
    "focal_length": 0.035,
    "hyperfocal_distance": 8.0,
    "min_focus": 0.8,
    "max_focus": 0.9,
    "focus_distances": (0.6, 0.8, 1.0),
    "focus_steps": 40,
    "table": LensTable("metres", distances=(0.5, 2.0), values=(0.5, 2.0)),
    "hiatus": 0.01,
    "circle_of_confusion": 3e-5,
}
OF_RIGS = {"cameras": RIG.cameras[:5], "frame_id": "map", "grid": Grid(1, 6), "sequence": True}


def named(data):
    return {each.name for each in dataclasses.fields(data)}


def test_all_that_can_be_changed_is_changed_below():
    assert named(PlanRequest) == set(OF_REQUESTS)
    assert named(CostModel) == set(OF_MODELS)
    assert named(RIG.cameras[0]) == set(OF_CAMERAS)
    assert named(RIG.cameras[0].intrinsics) == set(OF_INTRINSICS)
    assert named(RIG.cameras[0].lens) == set(OF_LENSES)
    assert named(Rig) == {*OF_RIGS, "notes", "assumed"}  # which no problem depends on


@pytest.mark.parametrize("field", OF_REQUESTS)
def test_a_changed_request_is_formulated_anew_where_it_has_to_be(field, formulated):
    value, expected = OF_REQUESTS[field]
    rig = replace(RIG, grid=Grid(1, 6))
    plan_focus(SCENE, rig, REQUEST)
    formulated.clear()
    request = replace(REQUEST, **{field: value})
    plan = plan_focus(SCENE, rig, request)
    assert formulated == expected
    same(plan, cold(SCENE, rig, request))


@pytest.mark.parametrize("field", OF_MODELS)
def test_a_changed_model_is_formulated_anew(field, formulated):
    plan_focus(SCENE, RIG, REQUEST)
    plan_focus(SCENE, RIG, REQUEST, CostModel())  # the default
    assert formulated == BOTH
    model = replace(CostModel(), **{field: OF_MODELS[field]})
    same(plan_focus(SCENE, RIG, REQUEST, model), cold(SCENE, RIG, REQUEST, model))
    assert formulated == BOTH * 3


def rig_with(camera):
    return replace(RIG, cameras=(camera, *RIG.cameras[1:]))


def changed_rigs():
    first = RIG.cameras[0]
    for name, value in OF_RIGS.items():
        yield f"rig.{name}", replace(RIG, **{name: value})
    for name, value in OF_CAMERAS.items():
        yield f"camera.{name}", rig_with(replace(first, **{name: value}))
    for name, value in OF_INTRINSICS.items():
        both = {name: value}
        if name.startswith("distortion"):
            both = {each: OF_INTRINSICS[each] for each in ("distortion_model", "distortion")}
        intrinsics = replace(first.intrinsics, **both)
        yield f"intrinsics.{name}", rig_with(replace(first, intrinsics=intrinsics))
    for name, value in OF_LENSES.items():
        from_where = {"min_focus": 0.4} if name == "focus_steps" else {}
        lens = replace(first.lens, **{name: value}, **from_where)
        yield f"lens.{name}", rig_with(replace(first, lens=lens))


CHANGED_RIGS = dict(changed_rigs())


@pytest.mark.parametrize("what", CHANGED_RIGS)
def test_a_changed_rig_is_formulated_anew(what, formulated):
    plan_focus(SCENE, RIG, REQUEST)
    assert formulated == BOTH
    plan = plan_focus(SCENE, CHANGED_RIGS[what], REQUEST)
    assert formulated == BOTH * 2
    same(plan, cold(SCENE, CHANGED_RIGS[what], REQUEST))


def test_a_rig_of_equal_values_is_the_same(formulated):
    plan_focus(SCENE, RIG, REQUEST)
    plan_focus(SCENE, replace(RIG, cameras=tuple(map(replace, RIG.cameras))), REQUEST)
    assert formulated == BOTH


def test_another_scene_is_formulated_anew(formulated):
    plan_focus(SCENE, RIG, REQUEST)
    plan_focus(Scene(SCENE.surface), RIG, REQUEST)
    assert formulated == BOTH * 2


def test_notes_are_those_of_the_rig_at_hand():
    plan_focus(SCENE, RIG, REQUEST)
    noted = replace(RIG, notes=(Note("default_lens", "a lens was assumed"),))
    assert noted == RIG
    assert plan_focus(SCENE, noted, REQUEST).notes == noted.notes
    assert plan_focus(SCENE, RIG, REQUEST).notes == ()


# --- what cannot be changed ----------------------------------------------------------------------


def test_who_writes_to_a_plans_problem_changes_no_other_plan():
    expected = cold(SCENE, RIG, REQUEST)
    for _ in range(2):
        plan = plan_focus(SCENE, RIG, REQUEST)
        for problem in (plan.problem, plan.fresh_problem):
            arrays = {**vars(problem), **vars(problem.samples)}.values()
            for array in arrays:
                if isinstance(array, np.ndarray):
                    array[:] = 0
    same(plan_focus(SCENE, RIG, REQUEST), expected)


@pytest.mark.parametrize("name", REQUESTS)
def test_no_solver_writes_to_what_is_kept_sorted(name, sorts):
    test_no_solver_writes_to_what_is_kept(name)


@pytest.mark.parametrize("name", REQUESTS)
def test_no_solver_writes_to_what_is_kept(name):
    request = REQUESTS[name]
    plan_focus(SCENE, RIG, request)
    entries = [entry.value.problem for _, entry in KEPT._all() if entry.bytes]
    before = [everything(problem) for problem in entries]
    plan_focus(SCENE, RIG, request)
    assert len(entries) == 2
    assert [everything(problem) for problem in entries] == before


def everything(problem):
    """The bytes of all arrays of a problem, and of what was derived of it."""
    return [array.tobytes() for array in arrays_in(problem)]


def arrays_in(value):
    if isinstance(value, np.ndarray):
        yield value
    elif dataclasses.is_dataclass(value) or isinstance(value, dict):
        for each in (value if isinstance(value, dict) else vars(value)).values():
            yield from arrays_in(each)
        if isinstance(value, Problem) and value in derived._derived:
            yield from arrays_in(derived._derived[value].found)
    elif isinstance(value, (tuple, list)):
        for each in value:
            yield from arrays_in(each)


# --- how much, and how long ----------------------------------------------------------------------


@pytest.fixture
def little_room(monkeypatch):
    """Keep a few small problems at most."""
    plan_focus(SCENE, RIG, REQUEST)
    few = Kept(4 * KEPT.bytes)
    for module in (many_subjects, solving):
        monkeypatch.setattr(module, "KEPT", few)
    return few


def test_what_was_used_longest_ago_makes_room(little_room, formulated):
    most = little_room._most_bytes
    for seed in range(12):
        plan_focus(SCENE, RIG, replace(REQUEST, seed=seed))
        plan_focus(SCENE, RIG, REQUEST)
        assert 0 < little_room.bytes <= most
    assert formulated == BOTH * 12  # that of seed 0 was used all the time
    formulated.clear()
    plan_focus(SCENE, RIG, replace(REQUEST, seed=1))
    assert formulated == BOTH


def test_what_is_too_large_is_not_kept(little_room, formulated):
    large = replace(REQUEST, samples=4000, fresh_samples=4000)
    for _ in range(2):
        plan = plan_focus(SCENE, RIG, large)
    assert formulated == BOTH * 2
    assert bytes_with_derived(plan.problem) * 4 > little_room._most_bytes
    assert little_room.bytes == 0


def test_what_is_derived_counts():
    plan_focus(SCENE, RIG, replace(REQUEST, method="closest", bound="none"))
    without = KEPT.bytes
    plan_focus(SCENE, RIG, REQUEST)
    pair = next(
        e.value.problem for _, e in KEPT._all() if e.bytes and "cells" in vars(e.value.problem)
    )
    cells = sum(a.nbytes for a in vars(pair.cells).values() if isinstance(a, np.ndarray))
    assert KEPT.bytes > without + cells / 2  # their tuples, and gains


def test_a_plan_is_left_the_memory_that_it_may_take(formulated):
    plan_focus(SCENE, RIG, REQUEST)
    kept = KEPT.bytes
    other = replace(REQUEST, seed=1)
    plan_focus(SCENE, RIG, other, limits=ResourceLimits(max_memory=1e9))
    assert KEPT.bytes > kept
    KEPT.forget()
    plan_focus(SCENE, RIG, REQUEST)
    plan_focus(SCENE, RIG, other, limits=ResourceLimits(max_memory=6 * kept))
    formulated.clear()
    plan_focus(SCENE, RIG, REQUEST)
    assert formulated  # something had to go


def test_what_is_kept_goes_with_its_scene():
    scene = Scene(torus(0.4, 0.15))
    plan_focus(scene, RIG, REQUEST)
    problems = [weakref.ref(entry.value.problem) for _, entry in KEPT._all() if entry.bytes]
    assert len(problems) == 2
    assert all(each() for each in problems)
    del scene
    gc.collect()
    assert not any(each() for each in problems)
    assert KEPT.bytes == 0


@pytest.mark.parametrize("gone", [0, 1])
def test_what_is_kept_of_several_goes_with_any(gone):
    scenes = [Scene(torus(0.4, 0.15)), Scene(sphere(0.4))]
    plan_focus(scenes, RIG, REQUEST)
    joined = [weakref.ref(e.value.problem) for _, e in KEPT._all() if e.others and e.bytes]
    assert len(joined) == 2
    del scenes[gone]
    plan_focus(SCENE, RIG, REQUEST)
    gc.collect()
    assert not any(each() for each in joined)


def test_forgetting_lets_go():
    plan_focus(SCENE, RIG, REQUEST)
    problems = [weakref.ref(entry.value.problem) for _, entry in KEPT._all() if entry.bytes]
    KEPT.forget()
    gc.collect()
    assert not any(each() for each in problems)


def test_a_fork_finds_the_lock_open():
    locked = Kept()
    locked._lock.acquire()
    locked.unlock()
    assert locked._lock.acquire(blocking=False)
