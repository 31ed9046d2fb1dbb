# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Which inputs are in force, which are refused, and what callers are told: without a node."""

from __future__ import annotations

import gc
import re
import weakref
from dataclasses import replace
from datetime import datetime, timedelta, timezone

import numpy as np
import pytest

from focus_planner.core.planning.kept import KEPT
from focus_planner.core.planning.plan_focus import plan_focus
from focus_planner.core.planning.request import PlanRequest
from focus_planner.core.rig.camera import CameraIntrinsics
from focus_planner.core.rig.layouts import cylinder_rig
from focus_planner.core.rig.lens import Lens
from focus_planner.core.rig.lens_table import LensTable
from focus_planner.core.rig.rig import Rig
from focus_planner.core.surface.scene import Scene
from focus_planner.core.surface.surface import Mesh
from focus_planner.core.validation import InputError
from focus_planner.io.lens_tables import LensTables
from focus_planner.messages.reading import Optics
from focus_planner.runtime.inputs import Arrival
from focus_planner.runtime.planner import NotReady, Planner
from testing.messages import Log

REQUEST = PlanRequest(method="em", samples=300)
RIG = cylinder_rig(rows=2, columns=6, radius=1.0, bottom=-0.1, top=0.1)
FAR_RIG = cylinder_rig(rows=2, columns=6, radius=9.0, bottom=9.0, top=9.1)


def box(size, centre=(0.0, 0.0, 0.0)):
    corners = np.stack(np.meshgrid(*[[-0.5, 0.5]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = [t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))]
    return Mesh(size * corners + np.array(centre), np.array(triangles))


BOX, OTHER = box(0.3), box(0.4)
FAR_BOX = box(0.3, (0.0, 0.0, 9.05))


class Bench:
    """A planner, and a clock that ticks with every message."""

    def __init__(self):
        self.log = Log()
        self.rigs = []
        self.planner = Planner(self.log, self.rigs.append)
        self._now = datetime(2025, 1, 1, tzinfo=timezone.utc)

    def _arrival(self, topic, content, payload):
        self._now += timedelta(seconds=1)

        def read(optics):
            if isinstance(content, Exception):
                raise content
            return content(optics) if callable(content) else content

        return Arrival(topic, "a type", payload or str(id(content)).encode(), read, self._now)

    def surface(self, content, payload=None, *, digest=True):
        self.planner.surface.receive(self._arrival("~/mesh", content, payload))
        if digest:
            self.planner.digest(Optics())

    def rig(self, content, payload=None, *, digest=True):
        self.planner.rig.receive(self._arrival("~/rig", content, payload))
        if digest:
            self.planner.digest(Optics())

    def plan(self, optics=Optics()):  # noqa: B008 - frozen
        self.planner.digest(optics)
        return self.planner.plan(REQUEST)[0]

    def reminder(self):
        self.planner.digest(Optics())
        return self.planner.plan(REQUEST)[2]


@pytest.fixture
def bench():
    return Bench()


@pytest.fixture
def ready(bench):
    bench.surface(BOX)
    bench.rig(RIG)
    return bench


def same(plan, surface, rig):
    return plan.cameras == plan_focus(Scene(surface), rig, REQUEST).cameras


BAD = InputError("mesh", "a good one", "a bad one")


def test_it_says_what_is_missing(bench):
    with pytest.raises(NotReady, match=r"surface: expected a mesh on ~/mesh.*none yet\. rig: exp"):
        bench.plan()
    bench.surface(BOX)
    with pytest.raises(NotReady, match=r"^rig: expected poses on ~/camera_poses or a rig on ~/rig"):
        bench.plan()
    bench.rig(RIG)
    assert same(bench.plan(), BOX, RIG)


def test_the_newest_surface_and_rig_are_planned_for(ready):
    ready.surface(OTHER)
    assert same(ready.plan(), OTHER, RIG)
    other_rig = cylinder_rig(rows=2, columns=7, radius=1.0, bottom=-0.1, top=0.1)
    ready.rig(other_rig)
    assert same(ready.plan(), OTHER, other_rig)
    assert ready.rigs == [RIG, other_rig]


def test_input_received_during_a_plan_counts_for_the_next(ready):
    ready.surface(OTHER, digest=False)
    assert same(ready.plan(), OTHER, RIG)


def test_a_refused_surface_is_reported_once_and_the_last_valid_one_stays(ready):
    ready.surface(BAD)
    assert ready.log.warnings == [f"refused the surface received on ~/mesh at 00:00:03 UTC: {BAD}"]
    with pytest.raises(NotReady) as refused:
        ready.plan()
    assert str(refused.value) == (
        f"{BAD}. So the surface received on ~/mesh at 00:00:03 UTC was refused, and the surface"
        " received on ~/mesh at 00:00:01 UTC stays in force: call again to plan with that one"
    )
    assert same(ready.plan(), BOX, RIG)


def test_without_a_valid_input_every_caller_is_told(bench):
    bench.rig(RIG)
    bench.surface(BAD)
    for _ in range(2):
        with pytest.raises(NotReady, match=r"none that can be used: the surface .* was refused \("):
            bench.plan()


def test_a_valid_surface_after_a_refused_one_is_not_mentioned(ready):
    ready.surface(BAD)
    ready.surface(OTHER)
    assert same(ready.plan(), OTHER, RIG)


def test_the_one_in_force_sent_again_after_a_refused_one_is_not_mentioned(ready):
    ready.surface(BAD)
    ready.surface(BOX)
    assert same(ready.plan(), BOX, RIG)


def test_both_refusals_are_reported_at_once(ready):
    ready.surface(BAD)
    ready.rig(InputError("rig", "one", "none"))
    with pytest.raises(NotReady, match=r"mesh: expected.* call again .*\. rig: expected one, got"):
        ready.plan()
    assert same(ready.plan(), BOX, RIG)


def test_of_a_backlog_the_newest_valid_one_counts_and_an_invalid_newer_one_is_reported(ready):
    ready.surface(box(0.2), digest=False)
    ready.surface(OTHER, digest=False)
    ready.surface(BAD, digest=False)
    with pytest.raises(NotReady, match="a bad one"):
        ready.plan()
    assert same(ready.plan(), OTHER, RIG)


def test_a_message_received_while_another_is_parsed_is_not_lost(ready):
    def slow(_):
        ready.surface(OTHER, digest=False)
        return box(0.2)

    ready.surface(slow)
    assert same(ready.plan(), OTHER, RIG)


def test_a_surface_sent_again_is_not_built_again(ready):
    ready.surface(OTHER, b"the same bytes")
    scene = ready.planner.surface.in_force.value
    ready.surface(RuntimeError("is not read again"), b"the same bytes")
    assert ready.planner.surface.in_force.value is scene
    assert ready.log.errors == []


@pytest.mark.parametrize(
    ("surface", "suspicion"),
    [
        (box(300.0), "millimetres"),
        (Mesh(BOX.vertices, BOX.triangles[:, ::-1]), "normals are probably inverted"),
        (FAR_BOX, "expected cameras that see the surface, got none that does"),
    ],
)
def test_a_surface_that_does_not_fit_the_rig_is_refused_at_once(ready, surface, suspicion):
    ready.surface(surface)
    assert re.search(suspicion, ready.log.warnings[0])
    with pytest.raises(NotReady, match=suspicion):
        ready.plan()
    assert same(ready.plan(), BOX, RIG)


def test_a_rig_that_does_not_fit_the_surface_is_refused_at_once(ready):
    ready.rig(FAR_RIG)
    with pytest.raises(NotReady, match="the rig received on ~/rig at 00:00:02 UTC stays in force"):
        ready.plan()
    assert same(ready.plan(), BOX, RIG)
    assert ready.rigs == [RIG]


@pytest.mark.parametrize("rig_first", [False, True])
def test_a_surface_and_a_rig_that_fit_only_each_other_replace_both(ready, rig_first):
    if rig_first:
        ready.rig(FAR_RIG)
        ready.surface(FAR_BOX)
    else:
        ready.surface(FAR_BOX)
        ready.rig(FAR_RIG)
    assert same(ready.plan(), FAR_BOX, FAR_RIG)


def test_a_surface_and_a_rig_in_one_backlog_replace_both(ready):
    ready.surface(FAR_BOX, digest=False)
    ready.rig(FAR_RIG, digest=False)
    assert same(ready.plan(), FAR_BOX, FAR_RIG)


def test_of_a_backlog_the_half_that_fits_is_taken(ready):
    ready.surface(OTHER, digest=False)
    ready.rig(FAR_RIG, digest=False)
    with pytest.raises(NotReady, match="the rig received on ~/rig at 00:00:04 UTC was refused"):
        ready.plan()
    assert same(ready.plan(), OTHER, RIG)


def test_a_pair_that_never_fitted_is_reported_until_a_better_one_arrives(bench):
    bench.surface(BOX)
    bench.rig(FAR_RIG)
    assert "do not fit each other" in bench.log.warnings[0]
    for _ in range(2):
        with pytest.raises(InputError, match="got none that does"):
            bench.plan()
    bench.rig(RIG)
    assert same(bench.plan(), BOX, RIG)


def test_cameras_follow_the_optics(bench):
    def read(optics):
        return cylinder_rig(
            rows=2,
            columns=6,
            radius=1.0,
            bottom=-0.1,
            top=0.1,
            lens=optics.lens,
            intrinsics=optics.intrinsics,
        )

    bench.surface(BOX)
    bench.rig(read)
    assert same(bench.plan(), BOX, RIG)
    optics = Optics(CameraIntrinsics(width=500), Lens(hyperfocal_distance=4.0))
    assert same(bench.plan(optics), BOX, read(optics))
    assert same(bench.plan(), BOX, RIG)


def with_tables(unit, camera="cam_0_00", **values):
    return Optics(tables=LensTables({camera: LensTable(unit, **values)}))


def completed(lens=None):
    """What reads the rig as messages are read."""
    rig = RIG if lens is None else Rig((replace(RIG.cameras[0], lens=lens),))
    return lambda optics: optics.complete(rig)


def test_tables_are_given_to_the_rig_in_force(bench):
    bench.surface(BOX)
    bench.rig(completed())
    assert bench.plan().cameras[0].device_unit is None
    assert bench.plan(with_tables("dioptres")).cameras[0].device_unit == "dioptres"
    assert bench.plan(with_tables("m")).cameras[0].device_unit == "m"
    assert bench.plan().cameras[0].device_unit is None


def test_a_rig_that_contradicts_the_tables_is_not_used_until_they_change(bench):
    bench.surface(BOX)
    bench.rig(completed(Lens(max_focus=2.0)))
    bad = with_tables("s", distances=(3.0, 4.0), values=(0.0, 1.0))
    for _ in range(2):
        with pytest.raises(NotReady, match=r"none that can be used: .*camera cam_0_00: lens.table"):
            bench.plan(bad)
    assert [arrival.topic for arrival in bench.planner.arrivals()] == ["~/mesh", "~/rig"]
    with pytest.raises(NotReady, match="cameras: expected some of the rig's 1: cam_0_00, got x"):
        bench.plan(with_tables("m", camera="x"))
    plan = bench.plan(with_tables("m"))
    assert plan.cameras[0].device_value == plan.cameras[0].focus_distance
    assert bench.planner.plan(REQUEST)[2] == ""
    assert bench.log.errors == []
    # It fits the surface again, so what does not is refused.
    bench.surface(FAR_BOX, digest=False)
    with pytest.raises(NotReady, match=r"and the surface .* stays in force"):
        bench.plan(with_tables("m"))
    # And a newer rig that goes with the tables takes its place.
    with pytest.raises(NotReady):
        bench.plan(bad)
    bench.planner.rig.receive(bench._arrival("~/rig", RIG, None))
    assert same(bench.plan(bad), BOX, RIG)


def test_a_rig_refused_because_of_tables_is_accepted_with_others(bench):
    bench.surface(BOX)
    bench.planner.digest(bad := with_tables("m", camera="x"))
    bench.planner.rig.receive(bench._arrival("~/rig", completed(), None))
    with pytest.raises(NotReady, match="got x"):
        bench.plan(bad)
    assert bench.rigs == []
    assert same(bench.plan(), BOX, RIG)
    assert bench.rigs == [RIG]
    assert bench.reminder() == ""


def test_a_surface_that_raises_anything_is_refused(ready):
    ready.surface(RuntimeError("no idea"))
    with pytest.raises(NotReady, match=r"internal error: RuntimeError\('no idea'\)"):
        ready.plan()
    assert "Traceback" in ready.log.errors[0]
    assert same(ready.plan(), BOX, RIG)


def what_shows_its_start(plan):
    """Bounds go on from the last one's prices, even where plans are the same."""
    return plan.cameras, plan.lower_bound


def test_a_warm_start_is_from_the_last_plan_that_asked_for_one(ready):
    first, second = (PlanRequest("em", 300, seed=seed) for seed in (1, 2))

    def planned(request, warm_start):
        return ready.planner.plan(request, warm_start=warm_start)[0]

    def check(plan, surface, request, before):
        scene = Scene(surface)
        expected = plan_focus(scene, RIG, request, warm_start=before and before.warm_start)
        assert what_shows_its_start(plan) == what_shows_its_start(expected)
        cold = plan_focus(scene, RIG, request)
        assert before is None or not np.array_equal(plan.prices, cold.prices)

    one = planned(first, warm_start=True)
    check(one, BOX, first, None)
    two = planned(second, warm_start=True)
    check(two, BOX, second, one)
    ready.surface(OTHER)
    check(planned(first, warm_start=True), OTHER, first, two)
    # Without one, nothing is kept for later either.
    check(planned(second, warm_start=False), OTHER, second, None)
    check(planned(first, warm_start=True), OTHER, first, None)


def test_a_request_that_fails_keeps_the_warm_start(ready):
    first, second = (PlanRequest("em", 300, seed=seed) for seed in (1, 2))
    one = ready.planner.plan(first, warm_start=True)[0]
    with pytest.raises(InputError, match="depth_tolerance: expected"):
        ready.planner.plan(replace(first, depth_tolerance=9.0), warm_start=True)
    two = ready.planner.plan(second, warm_start=True)[0]
    expected = plan_focus(Scene(BOX), RIG, second, warm_start=one.warm_start)
    assert what_shows_its_start(two) == what_shows_its_start(expected)


def test_progress_is_reported(ready):
    steps = []
    ready.planner.plan(REQUEST, on_progress=lambda progress: steps.append(progress) or True)
    assert steps


def test_a_plan_without_the_newest_input_comes_with_a_reminder(ready):
    assert ready.reminder() == ""
    ready.surface(BAD)
    with pytest.raises(NotReady):
        ready.plan()
    for _ in range(2):
        assert ready.reminder() == (
            "on the surface received on ~/mesh at 00:00:01 UTC, as a newer one was refused"
        )
    ready.surface(OTHER)
    assert ready.reminder() == ""


def arrived(bench):
    return [(arrival.topic, arrival.payload) for arrival in bench.planner.arrivals()]


def test_a_plan_depends_on_the_inputs_in_force_in_order_of_arrival(bench):
    assert arrived(bench) == []
    bench.rig(RIG, b"rig")
    assert arrived(bench) == [("~/rig", b"rig")]
    bench.surface(BOX, b"box")
    assert arrived(bench) == [("~/rig", b"rig"), ("~/mesh", b"box")]
    bench.surface(OTHER, b"other")
    assert arrived(bench) == [("~/rig", b"rig"), ("~/mesh", b"other")]


def test_an_objection_depends_on_the_refused_input_too(ready):
    before = arrived(ready)
    ready.surface(BAD, b"bad")
    assert arrived(ready) == [*before, ("~/mesh", b"bad")]
    with pytest.raises(NotReady):
        ready.plan()
    # The next plan is made without it.
    assert arrived(ready) == before
    ready.plan()
    assert arrived(ready) == before


def test_without_a_valid_input_every_objection_depends_on_the_invalid_one(bench):
    bench.surface(BAD, b"bad")
    for _ in range(2):
        assert arrived(bench) == [("~/mesh", b"bad")]
        with pytest.raises(NotReady):
            bench.plan()


def test_the_first_plan_may_start_from_one_made_elsewhere(ready):
    first, second = (PlanRequest("em", 300, seed=seed) for seed in (1, 2))
    one = plan_focus(Scene(BOX), RIG, first)
    planner = Planner(Log(), warm_start=one.warm_start)
    for of, into in ((ready.planner.surface, planner.surface), (ready.planner.rig, planner.rig)):
        into.receive(of.in_force.arrival)
    planner.digest(Optics())
    two = planner.plan(second, warm_start=True)[0]
    expected = plan_focus(Scene(BOX), RIG, second, warm_start=one.warm_start)
    assert what_shows_its_start(two) == what_shows_its_start(expected)
    assert planner.warm_start.prices is two.prices


def test_a_plan_is_made_again_from_its_stop_log(ready):
    steps = iter([True] * 3 + [False] * 99)
    ended = ready.planner.plan(REQUEST, on_progress=lambda _: next(steps))[0]
    again = ready.planner.plan(REQUEST, stop_log=ended.stop_log)[0]
    assert again.cameras == ended.cameras
    assert not ended.converged
    assert not again.converged


# --- several surfaces ----------------------------------------------------------------------------


class SubjectsBench(Bench):
    """A bench that keeps several surfaces in force."""

    def __init__(self, subjects):
        super().__init__()
        self.subjects = subjects
        self.planner.digest(Optics(), subjects)

    def digest(self):
        self.planner.digest(Optics(), self.subjects)

    def surface(self, content, payload=None, *, digest=True):
        super().surface(content, payload, digest=False)
        if digest:
            self.digest()

    def rig(self, content, payload=None, *, digest=True):
        super().rig(content, payload, digest=False)
        if digest:
            self.digest()

    @property
    def in_force(self):
        return [each.value.surface for each in self.planner.surface.all_in_force]


BOXES = [box(0.2 + 0.02 * i) for i in range(7)]


@pytest.mark.parametrize("at_once", [False, True])
def test_the_newest_surfaces_are_planned_for_together(at_once):
    bench = SubjectsBench(6)
    bench.rig(RIG)
    for surface in BOXES:
        bench.surface(surface, digest=not at_once)
    bench.digest()
    # Of those that wait, as many are kept as are planned for.
    assert bench.in_force == BOXES[1:]
    plan, _, _ = bench.planner.plan(REQUEST)
    assert [each.surface for each in plan.subjects] == [f"mesh {i}" for i in range(1, 7)]
    alone = plan_focus([Scene(each) for each in BOXES[1:]], RIG, REQUEST)
    assert plan.focus_distances.tolist() == alone.focus_distances.tolist()


def test_a_surface_that_comes_again_is_the_newest_and_counts_once():
    bench = SubjectsBench(2)
    bench.rig(RIG)
    bench.surface(BOX, b"box")
    bench.surface(OTHER, b"other")
    bench.surface(BOX, b"box")
    assert bench.in_force == [OTHER, BOX]


def test_fewer_surfaces_than_wanted_are_planned_for_with_a_note():
    bench = SubjectsBench(3)
    bench.rig(RIG)
    bench.surface(BOX)
    bench.surface(OTHER)
    plan, _, _ = bench.planner.plan(REQUEST)
    assert len(plan.subjects) == 2
    (note,) = (note for note in plan.notes if note.code == "subjects")
    assert note.text.startswith("planned for 2 surfaces, all that were received so far, of the 3 ")


def test_one_that_is_refused_takes_nobody_out_of_force():
    bench = SubjectsBench(2)
    bench.rig(RIG)
    bench.surface(BOX)
    bench.surface(OTHER)
    bench.surface(InputError("mesh", "triangles", "none"))
    assert bench.in_force == [BOX, OTHER]
    with pytest.raises(NotReady, match="was refused"):
        bench.planner.plan(REQUEST)
    assert len(bench.planner.plan(REQUEST)[0].subjects) == 2


def test_fewer_are_kept_once_fewer_are_wanted():
    bench = SubjectsBench(3)
    bench.rig(RIG)
    for surface in BOXES[:3]:
        bench.surface(surface)
    bench.subjects = 1
    bench.digest()
    assert bench.in_force == BOXES[2:3]
    assert bench.planner.plan(REQUEST)[0].subjects == ()


def test_surfaces_that_do_not_fit_a_new_rig_are_no_longer_planned_for():
    bench = SubjectsBench(2)
    bench.rig(RIG)
    bench.surface(BOX)
    bench.rig(FAR_RIG)
    bench.surface(FAR_BOX)
    assert bench.in_force == [FAR_BOX]
    assert any("does not fit the new rig" in line for line in bench.log.warnings)


def kept_problems(bench):
    bench.plan()
    return [weakref.ref(entry.value.problem) for _, entry in KEPT._all() if entry.bytes]


def test_problems_are_kept_from_plan_to_plan_and_go_with_their_inputs(bench):
    KEPT.forget()
    bench.rig(RIG)
    bench.surface(BOX)
    first = kept_problems(bench)
    assert len(first) == 2
    bench.rig(replace(RIG, cameras=tuple(map(replace, RIG.cameras))))  # of the same values
    bench.surface(box(0.3), payload=str(id(BOX)).encode())  # the same bytes
    assert kept_problems(bench) == first
    bench.rig(replace(RIG, cameras=RIG.cameras[1:], grid=None))
    gc.collect()
    assert not any(each() for each in first)
    second = kept_problems(bench)
    assert len(second) == 2
    bench.surface(OTHER)
    bench.plan()
    gc.collect()
    assert not any(each() for each in second)
