# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

import dataclasses
import math
from dataclasses import replace

import numpy as np
import pytest

from focus_planner import InputError, Mesh, PlanRequest, PointCloud, Rig, Scene, plan_focus
from focus_planner.core.planning.diagnosis import round_up
from focus_planner.core.planning.formulation import formulate_problem
from focus_planner.core.planning.plan import CameraStatus, FocusPlan
from focus_planner.core.planning.subject import PlannedSubject, requested
from testing import reference
from testing.problems import around, camera, forward, merged, plane, torus

#: Two cameras before a wall: 2 mm per pixel from 0.6 m, 4 mm per pixel from 1.2 m.
WALL = Scene(plane(0.2, 0.2, 0.6))
TWO = Rig((forward("near"), forward("far", (0.0, 0.0, -0.6))))
REQUEST = PlanRequest("em", samples=200, fresh_samples=200)


def plan(scene=WALL, rig=TWO, **changes):
    return plan_focus(scene, rig, replace(REQUEST, **changes))


def told(one):
    """All that a plan tells, but for its duration and the limit."""
    apart = {"solve_seconds", "total_seconds", "max_mm_per_pixel", "notes"}
    names = [each.name for each in dataclasses.fields(FocusPlan) if each.name not in apart]
    return {name: getattr(one, name) for name in names}


def test_what_a_camera_images_more_coarsely_counts_as_unseen_by_it():
    both, near = plan(max_mm_per_pixel=4.001), plan(max_mm_per_pixel=2.5)
    assert [each.status for each in both.cameras] != [each.status for each in near.cameras]
    assert near.cameras[0].status is CameraStatus.PLANNED
    assert near.cameras[1].status is CameraStatus.SEES_NOTHING
    assert set(near.problem.camera_index) == set(near.fresh_problem.camera_index) == {0}
    assert [each.area for each in both.sharp_areas[:2]] == pytest.approx([0.04, 0.04])
    assert [each.area for each in near.sharp_areas[:2]] == pytest.approx([0.04, 0.0])
    assert near.max_mm_per_pixel == 2.5
    assert near.covered_area == pytest.approx(0.04)
    assert both.notes == ()
    (note,) = near.notes
    assert note.code == "resolution"
    assert "1 of 2 cameras image nothing that finely (far)" in note.text
    assert "of the surface" not in note.text


def test_surface_that_is_imaged_only_more_coarsely_is_not_covered():
    # A wall twice as far beside the first, seen by the same camera.
    walls = plane(0.2, 0.2, 0.6), plane(0.2, 0.2, 1.2)
    beside = Mesh(walls[1].vertices + [0.4, 0, 0], walls[1].triangles)
    scene = Scene(merged(walls[0], beside))
    rig = Rig((forward("near"),))
    both, half = plan(scene, rig), plan(scene, rig, max_mm_per_pixel=3.0)
    assert both.covered_area == pytest.approx(0.08)
    fresh = half.fresh_problem.samples
    share = fresh.areas[fresh.points[:, 2] < 1].sum() / fresh.areas.sum()
    assert half.covered_area == pytest.approx(0.08 * share)
    assert half.cameras[0].focus_distance == pytest.approx(0.6, abs=0.05)
    (note,) = half.notes
    assert "of the surface is imaged only more coarsely and counts as unseen" in note.text
    assert "cameras image" not in note.text


@pytest.mark.parametrize("shots", [1, 2])
@pytest.mark.parametrize("fresh", [False, True])
def test_the_pairs_that_remain_are_those_imaged_finely_enough(fresh, shots):
    scene, rig = Scene(torus(0.4, 0.15)), around(6, 1.0)
    request = replace(REQUEST, samples=80, fresh_samples=80, shots=shots)
    whole, fine = (
        formulate_problem(scene, rig, replace(request, max_mm_per_pixel=most), fresh=fresh)
        for most in (math.inf, 3.6)
    )
    expected = [
        (p, c)
        for p, c in zip(whole.sample_index, whole.camera_index, strict=True)
        if 1000
        * reference.metres_per_pixel(
            rig.cameras[c // shots], whole.samples.points[p], whole.samples.normals[p]
        )
        <= 3.6
    ]
    assert 0 < len(expected) < len(whole.depth)
    assert list(zip(fine.sample_index, fine.camera_index, strict=True)) == expected
    assert fine.sample_offsets[-1] == len(expected)
    assert np.array_equal(fine.samples.areas, whole.samples.areas)


def test_without_a_limit_and_with_one_that_leaves_all_plans_are_the_same_bit_for_bit():
    scene, rig = Scene(torus(0.4, 0.15)), around(6, 1.0)
    without, none, wide = (
        plan(scene, rig, **given)
        for given in ({}, {"max_mm_per_pixel": 0.0}, {"max_mm_per_pixel": 1e8})
    )
    assert none.max_mm_per_pixel == math.inf
    assert told(without) == told(none) == told(wide)


def test_a_limit_that_nothing_meets_names_the_finest():
    with pytest.raises(
        InputError,
        match=r"^max_mm_per_pixel: expected at least 2, the finest that any camera images the"
        r" surface, got 0\.5; it is in millimetres per pixel",
    ):
        plan(max_mm_per_pixel=0.5)
    assert plan(max_mm_per_pixel=2.000001).covered_area == pytest.approx(0.04)


@pytest.mark.parametrize(
    ("length", "text"),
    [
        (2.0, "2"),
        (0.211, "0.211"),
        (0.21101, "0.212"),
        (1234.5, "1.24e+03"),
        (0.0999, "0.0999"),
        (math.inf, "inf"),
    ],
)
def test_what_is_told_to_be_enough_is_enough(length, text):
    assert round_up(length) == text
    assert float(round_up(length * (1 + 1e-9))) >= length


def test_what_is_asked_for_comes_back_from_the_plan():
    request = replace(REQUEST, views=3, max_mm_per_pixel=4.5, bound="none")
    made = plan_focus(WALL, TWO, request)
    again = requested(made, WALL)
    assert (again.views, again.max_mm_per_pixel) == (3, 4.5)
    near = requested(replace(made, max_mm_per_pixel=2.5), WALL)
    subject = PlannedSubject(WALL, TWO, near, made)
    assert set(subject.fresh_problem(50).camera_index) == {0}


def test_clouds_and_unsure_normals_are_limited_as_well():
    scene = Scene(torus(0.4, 0.15))
    cloud = Scene(PointCloud(scene.sample(4000, 1).points))
    rig = around(8, 1.0)
    coarse, fine = (plan(cloud, rig, max_mm_per_pixel=most) for most in (0.0, 3.6))
    assert 0 < fine.covered_area < 0.9 * coarse.covered_area


def test_the_camera_s_own_pixels_count():
    image = forward().intrinsics
    binned = Rig((camera(intrinsics=replace(image, binning=(2, 2))),))
    with pytest.raises(InputError, match="expected at least 4, the finest"):
        plan(WALL, binned, max_mm_per_pixel=3.0)
