# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

import numpy as np
import pytest

from focus_planner import InputError, Mesh, PlanRequest, PointCloud, Scene, plan_focus
from focus_planner.core.surface.cloud_shape import CloudShape, cloud_shape, surfels
from focus_planner.core.surface.sampling import sample_around_cloud, sample_cloud, sample_mesh
from focus_planner.core.surface.visibility import visible_pairs
from testing.problems import around, box, merged, plane, sphere, torus


def areas(mesh):
    return np.linalg.norm(mesh.cross_products, axis=1) / 2


def barycentric(mesh, triangle, points):
    """Coordinates (u, v, w) of points in a triangle's plane, and their distance from it."""
    a, b, c = mesh.vertices[mesh.triangles[triangle]]
    basis = np.stack([b - a, c - a, np.cross(b - a, c - a)], axis=1)
    v, w, off = np.linalg.solve(basis, (points - a).T)
    return np.stack([1 - v - w, v, w], axis=1), off


def chi_square(counts, expected):
    """The statistic over its number of degrees of freedom: about 1 where the counts fit."""
    return ((counts - expected) ** 2 / expected).sum() / (len(counts) - 1)


def test_samples_are_uniform_by_area():
    # Two triangles in one plane, 1 : 7 by area, and one of 24 across.
    mesh = Mesh(
        [[0, 0, 0], [1, 0, 0], [0, 2, 0], [-7, 0, 0], [0, 0, 8], [0, 6, 0]],
        [[0, 1, 2], [0, 2, 3], [0, 4, 5]],
    )
    samples = sample_mesh(mesh, 32_000, 5)
    counts = [
        (samples.points[:, 0] > 0).sum(),
        (samples.points[:, 0] < 0).sum(),
        (samples.points[:, 2] > 0).sum(),
    ]
    assert sum(counts) == 32_000
    assert chi_square(np.array(counts), np.array([1000, 7000, 24000])) < 4
    np.testing.assert_allclose(samples.weights, 32.0 / 32_000)


def test_samples_are_uniform_in_a_triangle():
    mesh = Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    x, y, z = sample_mesh(mesh, 40_000, 3).points.T
    assert (z == 0).all()
    assert ((x >= 0) & (y >= 0) & (x + y <= 1)).all()
    # A triangle twice refined: 16 parts of one area.
    column, row = np.floor(4 * x), np.floor(4 * y)
    upper = (4 * x - column) + (4 * y - row) > 1
    _, counts = np.unique(np.stack([column, row, upper]), axis=1, return_counts=True)
    assert len(counts) == 16
    assert chi_square(counts, np.full(16, 40_000 / 16)) < 2


def test_samples_lie_on_the_triangles_with_their_normals():
    mesh = torus()
    samples = sample_mesh(mesh, 500, 1)
    crosses = mesh.cross_products
    units = crosses / np.linalg.norm(crosses, axis=1)[:, None]
    for point, normal in zip(samples.points, samples.normals, strict=True):
        matches = [
            triangle
            for triangle in np.flatnonzero(np.linalg.norm(units - normal, axis=1) < 1e-9)
            if np.abs(barycentric(mesh, triangle, point[None])[1]) < 1e-9
            and (barycentric(mesh, triangle, point[None])[0] > -1e-9).all()
        ]
        assert matches


def test_normals_are_interpolated_between_the_vertices():
    normals = np.array([[1.0, 0, 0], [0, 1, 0], [0, 0, 1]])
    mesh = Mesh([[0, 0, 0], [2, 0, 0], [0, 3, 0]], [[0, 1, 2]], 5 * normals)
    samples = sample_mesh(mesh, 100, 0)
    share, _ = barycentric(mesh, 0, samples.points)
    expected = share @ normals
    expected /= np.linalg.norm(expected, axis=1)[:, None]
    np.testing.assert_allclose(samples.normals, expected, atol=1e-12)


def test_where_vertex_normals_cancel_the_triangles_own_is_taken():
    mesh = Mesh(
        [[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], [[1, 0, 0], [-0.5, 0.75**0.5, 0], [0, 0, 1]]
    )
    assert np.isfinite(sample_mesh(mesh, 100, 0).normals).all()
    opposite = Mesh(mesh.vertices, mesh.triangles, [[1, 0, 0], [1, 0, 0], [1, 0, 0]])
    object.__setattr__(opposite, "vertex_normals", np.zeros((3, 3)))
    np.testing.assert_array_equal(
        sample_mesh(opposite, 10, 0).normals, np.tile([0.0, 0, 1], (10, 1))
    )


def test_a_seed_repeats_bit_for_bit():
    mesh = torus()
    first, again, other = (sample_mesh(mesh, 1000, seed) for seed in (7, 7, 8))
    for a, b in zip(
        (first.points, first.normals, first.weights),
        (again.points, again.normals, again.weights),
        strict=True,
    ):
        assert a.tobytes() == b.tobytes()
    assert not np.array_equal(first.points, other.points)


def test_sampling_is_numpys_own():
    # What a seed gives must not change unnoticed: recorded runs rely on it.
    mesh = Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 1, 2], [0, 1, 3]])
    samples = sample_mesh(mesh, 3, 42)
    random = np.random.default_rng(42)
    triangle = (random.random(3) >= 0.5).astype(int)
    root, v = np.sqrt(random.random(3)), random.random(3)
    third = np.array([[0, 1, 0], [0, 0, 1]])[triangle]
    expected = (root * (1 - v))[:, None] * [1.0, 0, 0] + (root * v)[:, None] * third
    np.testing.assert_allclose(samples.points, expected, atol=1e-15)


# The unit triangle with an importance of 1 + 3x + 5y, one of 0 all over, and one behind them of
# the integral 3: the first's is 1/2 · (1 + 4 + 6)/3.
CORNERS = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
WEIGHTED = Mesh(
    [*CORNERS, [0, 0, 1], [9, 0, 1], [0, 9, 1], [0, 0, 2], [1, 0, 2], [0, 2, 2]],
    np.arange(9).reshape(3, 3)[[0, 2, 1]],
    vertex_importance=[1, 4, 6, 0, 0, 0, 3, 3, 3],
)
INTEGRAL = 11 / 6 + 3


def importance_at(points):
    x, y, z = points.T
    return np.select([z < 0.5, z > 1.5], [1 + 3 * x + 5 * y, 3.0], 0.0)


def test_samples_are_as_dense_as_the_surface_is_important():
    points = sample_mesh(WEIGHTED, 40_000, 3).points
    first = points[points[:, 2] < 0.5]
    counts = np.array([len(first), (points[:, 2] > 1.5).sum()])
    assert counts.sum() == 40_000
    assert chi_square(counts, 40_000 * np.array([11 / 6, 3]) / INTEGRAL) < 4
    x, y, _ = first.T
    assert ((x >= 0) & (y >= 0) & (x + y <= 1 + 1e-15)).all()
    # A triangle twice refined: each part gets its area times the importance in its middle.
    column, row = np.floor(4 * x), np.floor(4 * y)
    upper = (4 * x - column) + (4 * y - row) > 1
    parts, counts = np.unique(np.stack([column, row, upper]), axis=1, return_counts=True)
    middles = (parts[:2] + np.where(parts[2], 2 / 3, 1 / 3)) / 4
    expected = (1 + 3 * middles[0] + 5 * middles[1]) / 32 / (11 / 6) * len(first)
    assert expected.sum() == pytest.approx(len(first))
    assert chi_square(counts, expected) < 2


def test_samples_by_importance_weigh_the_same_and_stand_for_areas():
    samples = sample_mesh(WEIGHTED, 40_000, 4)
    assert len(set(samples.weights)) == 1
    # The greatest importance, 6, counts as 1.
    assert samples.weights.sum() == pytest.approx(INTEGRAL / 6)
    shares = samples.areas * importance_at(samples.points)
    np.testing.assert_allclose(shares, shares[0])
    assert samples.areas.sum() == pytest.approx(1.5)
    # They estimate any integral over what counts.
    x, y, z = samples.points.T
    assert samples.areas[z < 0.5].sum() == pytest.approx(1 / 2, rel=0.02)
    assert (samples.areas * x * y)[z < 0.5].sum() == pytest.approx(1 / 24, rel=0.03)


def test_samples_by_area_do_not_depend_on_the_importance():
    samples = sample_mesh(WEIGHTED, 4000, 5, by="area")
    plain = sample_mesh(Mesh(WEIGHTED.vertices, WEIGHTED.triangles), 4000, 5)
    for name in ("points", "normals", "areas"):
        assert getattr(samples, name).tobytes() == getattr(plain, name).tobytes()
    assert plain.weights.tobytes() == plain.areas.tobytes()
    expected = samples.areas * importance_at(samples.points) / 6
    np.testing.assert_allclose(samples.weights, expected)
    assert (samples.weights == 0).mean() == pytest.approx(40.5 / 42, abs=0.02)


def test_only_ratios_of_importance_matter():
    def drawn(factor):
        scaled = Mesh(
            WEIGHTED.vertices,
            WEIGHTED.triangles,
            vertex_importance=factor * WEIGHTED.vertex_importance,
        )
        return sample_mesh(scaled, 500, 6)

    one = drawn(1.0)
    for factor in (2.0, 3.0, 1e-300, 1e307):
        other = drawn(factor)
        np.testing.assert_allclose(other.points, one.points, atol=1e-12)
        np.testing.assert_allclose(other.areas, one.areas)
        np.testing.assert_allclose(other.weights, one.weights)


def test_importance_leaves_normals_and_repetition_alone():
    mesh = sphere()
    weighted = Mesh(
        mesh.vertices, mesh.triangles, mesh.vertices, vertex_importance=mesh.vertices[:, 2] + 1
    )
    first, again = sample_mesh(weighted, 1000, 7), sample_mesh(weighted, 1000, 7)
    for name in ("points", "normals", "areas", "weights"):
        assert getattr(first, name).tobytes() == getattr(again, name).tobytes()
    radial = first.points / np.linalg.norm(first.points, axis=1)[:, None]
    assert ((first.normals * radial).sum(axis=1) > 0.99).all()
    # Importance 1 + z on a sphere of radius 1: the mean of z is 1/3.
    assert first.points[:, 2].mean() == pytest.approx(1 / 3, abs=0.05)


def random_plane(count, seed=0):
    xy = np.random.default_rng(seed).random((count, 2))
    return np.concatenate([xy * [2.0, 1.0], np.zeros((count, 1))], axis=1)


def test_areas_of_a_cloud_sum_to_the_surfaces():
    # 2 m² strewn at random, rim included, and a unit sphere's 4π m².
    assert cloud_shape(PointCloud(random_plane(20_000))).areas.sum() == pytest.approx(2, rel=0.06)
    points = np.random.default_rng(1).normal(size=(20_000, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    shape = cloud_shape(PointCloud(points))
    assert shape.areas.sum() == pytest.approx(4 * np.pi, rel=0.03)
    assert shape.spacing == pytest.approx(np.sqrt(4 * np.pi / 20_000), rel=0.05)


def test_estimated_normals_are_the_surfaces_but_for_their_sign():
    points = np.random.default_rng(2).normal(size=(20_000, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    shape = cloud_shape(PointCloud(points))
    assert not shape.oriented
    assert (np.abs((shape.normals * points).sum(axis=1)) > 0.99).all()


def test_given_normals_are_kept():
    normals = np.tile([0.0, 0.6, 0.8], (400, 1))
    shape = cloud_shape(PointCloud(random_plane(400), 7 * normals))
    assert shape.oriented
    np.testing.assert_allclose(shape.normals, normals)


def test_cameras_turn_estimated_normals_outward():
    points = np.random.default_rng(3).normal(size=(8_000, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    scene = Scene(PointCloud(points))
    assert not scene.oriented
    samples = scene.sample(0, 0)
    visibility = visible_pairs(scene, around(12, 4.0, height=3.0), samples)
    seen = np.unique(visibility.sample_index)
    assert len(seen) > 0.95 * len(points)
    outward = (visibility.normals[seen] * samples.points[seen]).sum(axis=1)
    assert (outward > 0.98).all()


def test_a_part_scanned_twice_as_densely_gets_no_more_samples():
    points = random_plane(40_000)
    left = points[:, 0] < 1
    # Half of the right half's points are missing.
    kept = left | (np.random.default_rng(1).random(len(points)) < 0.5)
    cloud = PointCloud(points[kept])
    samples = sample_cloud(cloud, cloud_shape(cloud), 20_000, 4)
    assert (samples.points[:, 0] < 1).mean() == pytest.approx(0.5, abs=0.02)
    np.testing.assert_allclose(samples.weights, cloud_shape(cloud).areas.sum() / 20_000)


def test_samples_of_a_cloud_are_its_points_with_their_normals():
    mesh_samples = sample_mesh(sphere(), 2000, 0)
    cloud = PointCloud(mesh_samples.points, mesh_samples.normals)
    samples = sample_cloud(cloud, cloud_shape(cloud), 300, 9)
    index = {tuple(point): i for i, point in enumerate(cloud.points)}
    chosen = [index[tuple(point)] for point in samples.points]
    np.testing.assert_array_equal(samples.normals, cloud.normals[chosen])
    again = sample_cloud(cloud, cloud_shape(cloud), 300, 9)
    assert samples.points.tobytes() == again.points.tobytes()


def test_zero_samples_are_all_points_each_with_its_area():
    cloud = PointCloud(random_plane(500))
    shape = cloud_shape(cloud)
    samples = sample_cloud(cloud, shape, 0, 0)
    np.testing.assert_array_equal(samples.points, cloud.points)
    np.testing.assert_array_equal(samples.areas, shape.areas)
    np.testing.assert_array_equal(samples.weights, shape.areas)


def test_points_of_a_cloud_are_drawn_by_area_and_importance():
    points = random_plane(40_000)
    # The right half has three times the importance of the left, its rear none.
    importance = np.where(points[:, 0] < 1, 2.0, 6.0) * (points[:, 1] < 0.5)
    cloud = PointCloud(points, importance=importance)
    shape = cloud_shape(cloud)
    samples = sample_cloud(cloud, shape, 20_000, 4)
    x, y, _ = samples.points.T
    assert (y < 0.5).all()
    assert (x > 1).mean() == pytest.approx(0.75, abs=0.02)
    assert len(set(samples.weights)) == 1
    assert samples.weights.sum() == pytest.approx((shape.areas * importance).sum() / 6)
    assert samples.areas.sum() == pytest.approx(shape.areas[importance > 0].sum())
    assert samples.areas[x > 1].sum() == pytest.approx(0.5, rel=0.06)
    by_area = sample_cloud(cloud, shape, 20_000, 4, by="area")
    plain = Scene(PointCloud(points)).sample(20_000, 4)
    assert by_area.points.tobytes() == plain.points.tobytes()
    assert by_area.areas.tobytes() == plain.areas.tobytes() == plain.weights.tobytes()
    x, y, _ = by_area.points.T
    expected = by_area.areas * np.where(x < 1, 1 / 3, 1.0) * (y < 0.5)
    np.testing.assert_allclose(by_area.weights, expected)


def test_all_points_of_a_cloud_that_count_weigh_their_area_times_their_importance():
    importance = np.arange(500) % 5
    cloud = PointCloud(random_plane(500), importance=importance)
    shape = cloud_shape(cloud)
    samples, count = sample_cloud(cloud, shape, 0, 0), importance > 0
    np.testing.assert_array_equal(samples.points, cloud.points[count])
    np.testing.assert_array_equal(samples.areas, shape.areas[count])
    np.testing.assert_allclose(samples.weights, (shape.areas * importance / 4)[count])
    everything = sample_cloud(cloud, shape, 0, 0, by="area")
    np.testing.assert_array_equal(everything.points, cloud.points)
    assert (everything.weights == 0).sum() == 100


def test_importance_only_where_points_coincide_is_none():
    points = np.concatenate([random_plane(400), np.zeros((30, 3))])
    with pytest.raises(InputError, match="cloud importance: expected some above 0 where points"):
        cloud_shape(PointCloud(points, importance=np.arange(430) >= 400))


def test_points_that_coincide_tell_no_surface():
    with pytest.raises(InputError, match="cloud: expected distinct points, got mostly points rep"):
        cloud_shape(PointCloud(np.repeat(random_plane(10), 40, axis=0)))


def test_the_smallest_cloud():
    shape = cloud_shape(PointCloud(random_plane(16)))
    assert np.isfinite(shape.areas).all()
    assert np.isfinite(shape.normals).all()


def test_surfels_are_squares_on_the_tangent_planes():
    on_sphere = sample_mesh(sphere(), 200, 0)
    cloud = PointCloud(on_sphere.points, on_sphere.normals)
    shape = cloud_shape(cloud)
    vertices, triangles = surfels(cloud, shape, 1.5)
    corners = vertices.reshape(200, 4, 3)
    offsets = corners - cloud.points[:, None]
    np.testing.assert_allclose(corners.mean(axis=1), cloud.points, atol=1e-12)
    np.testing.assert_allclose((offsets * cloud.normals[:, None]).sum(axis=2), 0, atol=1e-12)
    half = 1.5 * np.sqrt(shape.areas)
    np.testing.assert_allclose(np.linalg.norm(offsets, axis=2), np.tile(half[:, None], (1, 4)))
    # Half a diagonal of r: a square of 2r², in two triangles.
    square = Mesh(vertices, triangles)
    np.testing.assert_allclose(areas(square), np.tile(half**2, 2))


def test_a_scene_knows_its_size():
    scene = Scene(merged(box((1, 2, 3)), plane(4, 1, 5.0)))
    assert scene.area == pytest.approx(2 * (2 + 3 + 6) + 4)
    np.testing.assert_allclose(scene.centre, [0, 0, 1.75])
    assert scene.diagonal == pytest.approx(np.sqrt(4**2 + 2**2 + 6.5**2))
    assert scene.oriented


def test_what_a_scene_cannot_sample():
    scene = Scene(box())
    with pytest.raises(InputError, match="samples: expected at least 1 on a mesh, got 0; 0 takes"):
        scene.sample(0, 0)
    with pytest.raises(InputError, match="samples: expected a whole number of at least 0, got -1"):
        scene.sample(-1, 0)
    with pytest.raises(InputError, match="seed: expected a whole number of at least 0, got -2"):
        scene.sample(10, -2)
    with pytest.raises(InputError, match="by: expected one of importance, area, got 'volume'"):
        scene.sample(10, 0, by="volume")


def test_unused_vertices_do_not_count():
    mesh = box()
    far = np.concatenate([mesh.vertices, [[1000.0, 0, 0]]])
    scene = Scene(Mesh(far, mesh.triangles))
    np.testing.assert_allclose(scene.centre, 0, atol=1e-12)
    assert scene.diagonal == pytest.approx(np.sqrt(3))


def test_stray_points_stand_for_no_surface_and_hide_none():
    scan = sample_mesh(sphere(0.4, subdivisions=3), 20_000, 1)
    stray = np.random.default_rng(0).uniform(-1.0, 1.0, (20, 3))
    clean = PointCloud(scan.points)
    dirty = PointCloud(np.concatenate([scan.points, stray]))
    area = cloud_shape(clean).areas.sum()
    assert cloud_shape(dirty).areas.sum() == pytest.approx(area, rel=0.06)
    rig = around(6, 1.5)
    seen = [plan_focus(Scene(c), rig, PlanRequest("em", 2000)).covered_area for c in (clean, dirty)]
    assert seen[1] == pytest.approx(seen[0], rel=0.1)


def test_samples_around_points_fill_each_points_own_square():
    # Sixteen points far apart, of areas 1 : 2 : ... : 16, with normals every way.
    random = np.random.default_rng(0)
    normals = random.standard_normal((16, 3))
    cloud = PointCloud(100.0 * np.arange(48).reshape(16, 3), normals)
    shape = CloudShape(cloud.normals, None, np.arange(1.0, 17.0), np.ones(16), 3.0)
    samples = sample_around_cloud(cloud, shape, 68_000, 4)
    assert samples.weights == pytest.approx(136 / 68_000)
    point = np.abs(samples.points[:, None] - cloud.points[None]).sum(axis=2).argmin(axis=1)
    np.testing.assert_array_equal(samples.normals, cloud.normals[point])
    assert chi_square(np.bincount(point), 500 * shape.areas) < 2
    offset = samples.points - cloud.points[point]
    assert (offset * samples.normals).sum(axis=1) == pytest.approx(0, abs=1e-9)
    squared = (offset**2).sum(axis=1) / shape.areas[point]
    assert squared.max() == pytest.approx(1 / 2, rel=0.02)
    assert squared.max() <= 1 / 2 + 1e-9
    assert squared.mean() == pytest.approx(1 / 6, rel=0.02)
    # Half of a square lies within the circle of half its area.
    assert np.median(squared) == pytest.approx(1 / 2 / np.pi, rel=0.03)
