# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Clouds with noise and strays, against surfaces whose areas are known."""

import numba
import numpy as np
import pytest

from focus_planner import InputError, PlanRequest, PointCloud, Scene, plan_focus
from focus_planner.core.surface import preparation
from focus_planner.core.surface.appearance import decode
from focus_planner.core.surface.cloud_shape import cloud_shape
from focus_planner.core.surface.noise import Scatter
from focus_planner.core.surface.preparation import prepare_cloud
from focus_planner.core.surface.sampling import sample_mesh
from focus_planner.core.surface.smoothing import smooth
from testing.problems import around, box, plane, sphere

COUNT = 30_000
RADIUS = 0.3
SPACING = np.sqrt(4 * np.pi * RADIUS**2 / COUNT)


def ball(noise, count=COUNT, seed=0):
    """Points that scatter about a sphere, and the true normals where they come from."""
    random = np.random.default_rng(seed)
    directions = random.standard_normal((count, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    return RADIUS * directions + noise * random.standard_normal((count, 3)), directions


def scattered(mesh, noise, count=COUNT):
    sampled = sample_mesh(mesh, count, 3)
    jitter = noise * np.random.default_rng(1).standard_normal((count, 3))
    return sampled.points + jitter, sampled.normals


def same(a, b):
    return all(
        getattr(a, name).tobytes() == getattr(b, name).tobytes()
        for name in ("normals", "areas", "importance")
    )


def test_a_cloud_without_noise_is_left_alone():
    for normals in (True, False):
        points, directions = ball(0.1 * SPACING)
        cloud = PointCloud(points, directions if normals else None)
        prepared = prepare_cloud(cloud)
        assert prepared.cloud is cloud
        assert prepared.notes == ()
        assert same(prepared.shape, cloud_shape(cloud))


@pytest.mark.parametrize("given", [True, False])
@pytest.mark.parametrize("ratio", [0.5, 1.0, 2.0])
def test_averaged_points_lie_on_the_surface_with_its_normals_and_area(ratio, given):
    points, directions = ball(ratio * SPACING)
    prepared = prepare_cloud(PointCloud(points, directions if given else None))
    averaged, shape = prepared.cloud.points, prepared.shape
    assert len(averaged) < COUNT
    distance = np.linalg.norm(averaged, axis=1)
    off = distance - RADIUS
    assert np.sqrt((off**2).mean()) < 0.4 * ratio * SPACING
    assert abs(off.mean()) < 0.1 * ratio * SPACING
    cosine = (shape.normals * averaged).sum(axis=1) / distance
    assert shape.oriented == given
    assert ((cosine if given else np.abs(cosine)) > 0.95).mean() > 0.99
    assert shape.areas.sum() == pytest.approx(4 * np.pi * RADIUS**2, rel=0.03)


@pytest.mark.parametrize(("mesh", "area"), [(plane(1, 1, 0), 1.0), (box((0.5, 0.5, 0.5)), 1.5)])
def test_the_area_of_planes_and_boxes(mesh, area):
    points, _ = scattered(mesh, 0.006)
    scene = Scene(PointCloud(points))
    assert scene.area == pytest.approx(area, rel=0.05)
    assert [note.code for note in scene.notes] == ["noise"]


def test_a_hole_is_not_filled():
    points, normals = scattered(plane(1, 1, 0), 0.006, 40_000)
    hole = (np.abs(points[:, :2]) < 0.2).all(axis=1)
    prepared = prepare_cloud(PointCloud(points[~hole], normals[~hole]))
    assert prepared.shape.areas.sum() == pytest.approx(1 - 0.16, rel=0.05)
    inside = (np.abs(prepared.cloud.points[:, :2]) < 0.18).all(axis=1)
    assert not inside.any()


def test_sheets_with_opposite_normals_stay_apart():
    # A board 2 cm thick, with a noise of 4 mm.
    front, back = plane(0.5, 0.5, 0), plane(0.5, 0.5, 0.02)
    points, normals = scattered(front, 0.004, 20_000)
    other, _ = scattered(back, 0.004, 20_000)
    colours = np.repeat(np.array([[255, 0, 0], [0, 0, 255]], np.uint8), 20_000, axis=0)
    cloud = PointCloud(
        np.concatenate([points, other]), np.concatenate([normals, -normals]), colours=colours
    )
    prepared = smooth(cloud, Scatter(0.004, 0.0035))
    assert prepared.shape.areas.sum() == pytest.approx(0.5, rel=0.05)
    facing = np.sign(prepared.shape.normals[:, 2])
    depth = prepared.cloud.points[:, 2]
    assert np.median(np.abs(depth[facing == -1])) < 0.001
    assert np.median(np.abs(depth[facing == 1] - 0.02)) < 0.001
    assert (prepared.cloud.colours[facing == -1] == (255, 0, 0)).all()
    assert (prepared.cloud.colours[facing == 1] == (0, 0, 255)).all()


def test_a_part_scanned_more_densely_gets_no_more_area():
    points, normals = scattered(plane(1, 1, 0), 0.008, 50_000)
    kept = (points[:, 0] < 0) | (np.random.default_rng(2).random(len(points)) < 0.25)
    prepared = prepare_cloud(PointCloud(points[kept], normals[kept]))
    left = prepared.cloud.points[:, 0] < 0
    assert prepared.shape.areas[left].sum() == pytest.approx(0.5, rel=0.05)
    assert prepared.shape.areas[~left].sum() == pytest.approx(0.5, rel=0.06)


def test_importance_is_carried_over():
    points, _ = ball(1.5 * SPACING)
    importance = np.where(points[:, 2] > 0, 2.0, 0.0)
    prepared = prepare_cloud(PointCloud(points, importance=importance))
    total = (prepared.shape.areas * prepared.cloud.importance).sum()
    assert total == pytest.approx(2 * 2 * np.pi * RADIUS**2, rel=0.03)
    # What is far from the border keeps its importance.
    high = prepared.cloud.points[:, 2] > 0.1
    np.testing.assert_allclose(prepared.cloud.importance[high], 2, rtol=1e-9)
    assert (prepared.cloud.importance[prepared.cloud.points[:, 2] < -0.1] == 0).all()


@pytest.mark.parametrize("given", [True, False])
def test_colours_are_averaged_in_linear_light(given):
    points, directions = ball(1.5 * SPACING)
    # Above, black and white points in turn; below, all of one colour.
    colours = np.where(np.arange(COUNT)[:, None] % 2, [255, 255, 255], [0, 0, 0]).astype(np.uint8)
    colours[points[:, 2] < 0] = (200, 100, 50)
    cloud = PointCloud(points, directions if given else None, colours=colours)
    prepared = prepare_cloud(cloud)
    low, high = (prepared.cloud.points[:, 2] * side > 0.1 for side in (-1, 1))
    assert (prepared.cloud.colours[low] == (200, 100, 50)).all()
    # Half of the light is 188 as sRGB, and 128 is a fifth of it.
    grey = prepared.cloud.colours[high]
    assert (grey == grey[:, :1]).all()
    assert 0.1 < (grey == 188).mean() < 0.9
    assert not (grey == 128).any()
    assert np.mean(decode(grey)) == pytest.approx(0.5, abs=0.02)
    assert Scene(cloud).colours.shape == (4 * len(prepared.cloud.points), 3)


def test_plans_do_not_depend_on_colours():
    points, directions = ball(1.5 * SPACING)
    colours = np.zeros((COUNT, 3), np.uint8)
    plain, coloured = (
        prepare_cloud(PointCloud(points, directions, colours=each)) for each in (None, colours)
    )
    assert plain.cloud.colours is None
    assert plain.cloud.points.tobytes() == coloured.cloud.points.tobytes()
    assert same(plain.shape, coloured.shape)


@pytest.mark.parametrize("noise", [0.0, SPACING])
@pytest.mark.parametrize("given", [True, False])
def test_strays_are_left_out(noise, given):
    points, directions = ball(noise)
    random = np.random.default_rng(5)
    strays = random.uniform(-0.6, 0.6, (COUNT // 100, 3))
    normals = random.standard_normal(strays.shape)
    cloud = PointCloud(
        np.concatenate([points, strays]),
        np.concatenate([directions, normals]) if given else None,
    )
    scene = Scene(cloud)
    assert scene.area == pytest.approx(4 * np.pi * RADIUS**2, rel=0.04)
    assert scene.notes[-1].code == "noise"
    assert "lie apart from any surface: they were left out" in scene.notes[-1].text
    samples = scene.sample(4000, 0)
    away = np.abs(np.linalg.norm(samples.points, axis=1) - RADIUS)
    assert (away > 0.02).mean() < 0.01


def test_a_part_scanned_sparsely_is_no_stray():
    points, _ = scattered(plane(1, 1, 0), 0.0)
    kept = (points[:, 0] < 0) | (np.random.default_rng(2).random(len(points)) < 0.02)
    cloud = PointCloud(points[kept])
    assert prepare_cloud(cloud).cloud is cloud


def test_the_same_cloud_is_averaged_to_the_same_bits_on_any_number_of_threads():
    points, directions = ball(SPACING)
    colours = np.random.default_rng(6).integers(0, 256, (COUNT, 3)).astype(np.uint8)
    before = numba.get_num_threads()
    results = []
    for threads in (1, before):
        numba.set_num_threads(threads)
        try:
            results.append(prepare_cloud(PointCloud(points, directions, colours=colours)))
        finally:
            numba.set_num_threads(before)
    first, second = results
    assert first.cloud.points.tobytes() == second.cloud.points.tobytes()
    assert first.cloud.colours.tobytes() == second.cloud.colours.tobytes()
    assert same(first.shape, second.shape)


def test_a_cloud_denser_than_plans_can_use_is_averaged(monkeypatch):
    monkeypatch.setattr(preparation, "MAX_POINTS_AS_GIVEN", 20_000)
    points, directions = ball(0.0)
    prepared = prepare_cloud(PointCloud(points, directions))
    assert len(prepared.cloud.points) < COUNT
    (note,) = prepared.notes
    assert note.code == "noise"
    assert note.text.startswith(
        "the cloud's 30,000 points lie closer than planning needs: they were averaged to"
        f" {len(prepared.cloud.points):,} points"
    )
    assert note.text.endswith("give at most 20,000 points to have them used as they are")
    assert prepared.shape.areas.sum() == pytest.approx(4 * np.pi * RADIUS**2, rel=0.02)
    off = np.linalg.norm(prepared.cloud.points, axis=1) - RADIUS
    assert np.abs(off).max() < 1e-3


def test_the_note_tells_noise_and_spacing():
    points, _ = ball(0.005)
    scene = Scene(PointCloud(points))
    (note,) = scene.notes
    assert note.code == "noise"
    words = note.text.split()
    assert words[:5] == ["the", "cloud's", "points", "scatter", "by"]
    assert float(words[5]) == pytest.approx(5, rel=0.1)
    assert f"averaged to {len(scene.sample(0, 0)):,} points" in note.text


def test_a_plan_for_a_noisy_cloud_is_judged_as_on_the_surface():
    rig = around(8, 1.2)
    request = PlanRequest(samples=3000, fresh_samples=6000)
    truth = plan_focus(Scene(sphere(RADIUS, subdivisions=4)), rig, request)
    for normals in (True, False):
        points, directions = ball(SPACING)
        plan = plan_focus(Scene(PointCloud(points, directions if normals else None)), rig, request)
        assert plan.fresh_cost == pytest.approx(truth.fresh_cost, rel=0.03)
        assert plan.surface_area == pytest.approx(truth.surface_area, rel=0.05)


def test_progress_is_told_as_a_growing_share():
    for noise in (0.0, SPACING):
        shares = []
        Scene(PointCloud(ball(noise)[0]), shares.append)
        assert shares[0] == 0
        assert shares == sorted(shares)
        assert shares[-1] == 1
    shares = []
    Scene(sphere(), shares.append)
    assert shares == [1]


def test_points_apart_from_one_another_are_no_surface():
    with pytest.raises(InputError, match="cloud: expected points on a surface, got points apart"):
        smooth(PointCloud(np.random.default_rng(0).random((500, 3))), Scatter(1e-4, 1e-4))


def seen_with_noise(noise, random):
    """Points on a sphere that four depth cameras saw, off along their rays by so much."""
    points, directions = ball(0.0)
    cameras = 1.2 * np.array([[1, 0, 0], [-1, 0, 0.5], [0, 1, -0.5], [0, -1, 0]])
    rays = cameras - points[:, None]
    rays /= np.linalg.norm(rays, axis=2)[..., None]
    facing = (rays * directions[:, None]).sum(axis=2)
    # Any of those that it faces; the one that it faces most at the poles, which none sees.
    choice = np.where(facing > 0.2, 1 + random.random(facing.shape), facing).argmax(axis=1)
    rays = rays[np.arange(len(points)), choice]
    return points + noise * random.standard_normal((len(points), 1)) * rays, directions


@pytest.mark.parametrize("given", [True, False])
def test_noise_along_the_rays_of_depth_cameras(given):
    points, directions = seen_with_noise(SPACING, np.random.default_rng(5))
    rig = around(8, 1.2)
    request = PlanRequest(samples=3000, fresh_samples=6000)
    truth = plan_focus(Scene(sphere(RADIUS, subdivisions=4)), rig, request)
    plan = plan_focus(Scene(PointCloud(points, directions if given else None)), rig, request)
    assert "noise" in {note.code for note in plan.notes}
    assert plan.fresh_cost == pytest.approx(truth.fresh_cost, rel=0.03)
    assert plan.surface_area == pytest.approx(truth.surface_area, rel=0.05)
