# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
import trimesh

from focus_planner import InputError, Mesh, PlanRequest, Scene, cylinder_rig, plan_focus
from shapes.command import KINDS
from shapes.gallery import gear
from shapes.parts import solid
from shapes.solids import HEIGHT, WIDTH, mesh

# The seeds of every family: plate, bracket, flange, gear, housing; figure, bust, draped figure;
# broad leaves, rosette, fronds.
FAMILIES = [
    *(("parts", seed) for seed in range(5)),
    *(("statues", seed) for seed in range(3)),
    *(("plants", seed) for seed in range(3)),
]


@cache
def made(kind: str, seed: int) -> Mesh:
    return KINDS[kind](seed, HEIGHT)


@pytest.fixture(params=FAMILIES, ids=lambda family: "-".join(map(str, family)))
def subject(request):
    return made(*request.param)


def as_trimesh(subject: Mesh) -> trimesh.Trimesh:
    return trimesh.Trimesh(subject.vertices, subject.triangles, process=False)


def contents(subject: Mesh) -> tuple[bytes, bytes]:
    return subject.vertices.tobytes(), subject.triangles.tobytes()


def test_a_subject_is_one_closed_solid_with_outward_normals(subject):
    shape = as_trimesh(subject)
    assert shape.is_watertight
    assert shape.is_volume
    assert shape.volume > 0
    assert shape.body_count == 1


def test_a_subject_has_a_surface_and_as_many_triangles_as_a_scan_may_have(subject):
    assert 1.0 < as_trimesh(subject).area < 6.0
    assert 10_000 <= len(subject.triangles) <= 80_000


def test_a_subject_stands_on_the_ground_around_the_axis(subject):
    low, high = subject.vertices.min(axis=0), subject.vertices.max(axis=0)
    assert low[2] == pytest.approx(0, abs=1e-6)
    assert (low + high)[:2] == pytest.approx([0, 0], abs=1e-5)


def test_a_subject_is_as_large_as_its_height_and_the_width_with_it_allow(subject):
    high = subject.vertices[:, 2].max() / HEIGHT
    wide = 2 * np.hypot(*subject.vertices.T[:2]).max() / (WIDTH * HEIGHT)
    assert max(high, wide) == pytest.approx(1)


def test_files_hold_a_subject_as_it_is(subject):
    np.testing.assert_array_equal(subject.vertices, subject.vertices.astype(np.float32))


def test_the_default_rig_sees_a_subject(subject):
    request = PlanRequest(method="closest", samples=1000, bound="none")
    plan = plan_focus(Scene(subject), cylinder_rig(7, 24), request)
    assert plan.covered_area > 0.7 * plan.surface_area
    assert plan.notes == ()


@pytest.mark.parametrize("kind", KINDS)
def test_a_seed_is_always_the_same_subject_and_another_one_another(kind):
    assert contents(KINDS[kind](1, HEIGHT)) == contents(made(kind, 1))
    assert contents(KINDS[kind](61, HEIGHT)) != contents(made(kind, 1))  # of the same family


@pytest.mark.parametrize("kind", KINDS)
def test_the_height_scales_a_subject(kind):
    large, small = made(kind, 1), KINDS[kind](1, HEIGHT / 8)
    extents = [as_trimesh(shape).extents for shape in (large, small)]
    assert extents[1] == pytest.approx(extents[0] / 8, rel=1e-5)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("height", [0.0, -1.0, float("nan")])
def test_a_height_is_positive(kind, height):
    with pytest.raises(InputError, match=r"^height: expected a number above 0, got"):
        KINDS[kind](1, height)


@pytest.mark.parametrize("seed", range(5))
def test_giant_triangles_have_the_same_area_and_cost_the_same(seed):
    few, many = mesh(solid(seed)), made("parts", seed)
    assert len(few.triangles) < len(many.triangles) / 2
    assert as_trimesh(few).area == pytest.approx(as_trimesh(many).area, rel=1e-4)
    request = PlanRequest(method="closest", samples=16384, bound="none")
    costs = [plan_focus(Scene(m), cylinder_rig(3, 8), request).cost for m in (few, many)]
    assert costs[0] == pytest.approx(costs[1], rel=0.02)  # four standard deviations


def test_the_gear_of_the_gallery_is_closed():
    assert as_trimesh(gear()).is_volume
