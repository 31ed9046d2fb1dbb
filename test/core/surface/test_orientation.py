# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Signs of estimated normals, against shapes whose outer sides are known."""

import numpy as np
import pytest

from focus_planner import PointCloud, Scene
from focus_planner.core.surface.cloud_shape import cloud_shape, nearest_neighbours
from focus_planner.core.surface.orientation import find_patches, refine_normals
from focus_planner.core.surface.sampling import sample_mesh
from focus_planner.core.surface.visibility import visible_pairs
from testing.problems import around, box, merged, sphere, torus, with_threads


def directions(count, seed=0):
    random = np.random.default_rng(seed)
    vectors = random.standard_normal((count, 3))
    return vectors / np.linalg.norm(vectors, axis=1)[:, None]


def folded_sheet(count=6000):
    """A sheet folded like a U: two flat halves 0.1 apart and half a tube between them."""
    random = np.random.default_rng(3)
    along, across = random.uniform(-1, 1, count), random.uniform(0, 0.5, count)
    middle = np.abs(along) < 0.05 * np.pi / 2
    turn = np.where(middle, along / 0.05, np.sign(along) * np.pi / 2)
    length = np.where(middle, 0.0, np.abs(along) - 0.05 * np.pi / 2)
    normals = np.stack([-np.cos(turn), np.zeros(count), np.sin(turn)], axis=1)
    points = 0.05 * normals + np.stack([length, across, np.zeros(count)], axis=1)
    return points, normals


def drawn(mesh, count=6000):
    samples = sample_mesh(mesh, count, 1)
    return samples.points, samples.normals


def with_random_signs(normals):
    signs = np.random.default_rng(2).choice([-1.0, 1.0], len(normals))
    return signs[:, None] * normals


SHAPES = {
    "sphere": lambda: (0.3 * directions(6000), directions(6000)),
    "box": lambda: drawn(box()),
    "torus": lambda: drawn(torus()),
    "folded sheet": folded_sheet,
    "two spheres, nearly touching": lambda: drawn(
        merged(sphere(0.3, subdivisions=4), sphere(0.2, (0.53, 0, 0), subdivisions=4))
    ),
    "nested spheres": lambda: drawn(
        merged(sphere(0.3, subdivisions=4), sphere(0.2, subdivisions=4))
    ),
}


@pytest.mark.parametrize("shape", SHAPES)
def test_true_normals_of_random_signs_get_one_sign_per_patch(shape):
    points, normals = SHAPES[shape]()
    index = nearest_neighbours(points).index
    patches = find_patches(points, with_random_signs(normals), index)
    signs = np.sign((patches.normals * normals).sum(axis=1))
    sizes = np.bincount(patches.labels)
    assert sizes.max() > 0.3 * len(points)
    of_patch = np.bincount(patches.labels, weights=signs)
    assert np.abs(of_patch).sum() > 0.995 * len(points)


@pytest.mark.parametrize("shape", ["sphere", "box", "torus", "folded sheet"])
def test_a_shape_in_one_piece_is_one_patch(shape):
    points, normals = SHAPES[shape]()
    patches = find_patches(points, with_random_signs(normals), nearest_neighbours(points).index)
    assert np.bincount(patches.labels).max() > 0.99 * len(points)


def test_pieces_apart_are_patches_of_their_own_numbered_by_their_first_points():
    ball = 0.2 * directions(500)
    points = np.concatenate([ball, ball + [3.0, 0, 0], ball + [0, 3.0, 0]])
    shape = cloud_shape(PointCloud(points))
    np.testing.assert_array_equal(shape.patches, np.repeat([0, 1, 2], 500))


def test_points_that_coincide_or_are_alone_are_patches():
    points = np.concatenate([np.zeros((30, 3)), [[5.0, 0, 0]]])
    normals = np.tile([0.0, 0.0, 1.0], (31, 1))
    patches = find_patches(points, normals, nearest_neighbours(points).index)
    assert patches.labels.min() == 0
    assert sorted(np.unique(patches.labels)) == list(range(patches.labels.max() + 1))
    assert np.isfinite(patches.normals).all()


def test_the_other_sheet_does_not_bend_normals():
    # Two sheets, closer to one another than the sixteenth neighbour.
    random = np.random.default_rng(0)
    flat = np.concatenate([random.uniform(0, 1, (4000, 2)), np.zeros((4000, 1))], axis=1)
    points = np.concatenate([flat[:2000], flat[2000:] + [0, 0, 0.03]])
    normals = np.repeat([[0.0, 0, -1], [0, 0, 1.0]], 2000, axis=0)
    index = nearest_neighbours(points).index
    refined, on_sheet = refine_normals(points, normals, index)
    np.testing.assert_allclose(refined, normals, atol=1e-9)
    expected = [np.sum((row >= 2000) == (i >= 2000)) - 1 for i, row in enumerate(index)]
    np.testing.assert_array_equal(on_sheet, np.where(np.array(expected) < 4, 16, expected))


def test_cameras_turn_whole_patches():
    points, _ = SHAPES["two spheres, nearly touching"]()
    scene = Scene(PointCloud(points))
    samples = scene.sample(0, 0)
    turned = visible_pairs(scene, around(6, 2.0), samples).normals
    centres = np.where((np.linalg.norm(points, axis=1) < 0.31)[:, None], 0.0, [0.53, 0, 0])
    outward = ((points - centres) * turned).sum(axis=1) > 0
    assert outward.mean() > 0.99
    same = (turned * samples.normals).sum(axis=1) > 0
    for label in range(samples.patches.max() + 1):
        assert len(np.unique(same[samples.patches == label])) == 1


def test_the_far_side_of_something_thin_is_turned_away():
    # A hollow ball whose wall is thinner than rays stop short of their ends.
    outer, inner = 0.3 * directions(4600, 1), 0.263 * directions(3400, 2)
    scene = Scene(PointCloud(np.concatenate([outer, inner])))
    assert scene.stop_short > 0.037
    samples = scene.sample(0, 0)
    turned = visible_pairs(scene, around(8, 2.0), samples).normals
    outward = (samples.points * turned).sum(axis=1) > 0
    far = np.linalg.norm(samples.points, axis=1) > 0.28
    assert outward[far].mean() > 0.99
    assert outward[~far].mean() < 0.01


def test_signs_do_not_depend_on_the_number_of_threads():
    points, _ = SHAPES["torus"]()
    points = points + 0.004 * np.random.default_rng(4).standard_normal(points.shape)
    cloud = PointCloud(points)
    one, many = (with_threads(threads, lambda: cloud_shape(cloud)) for threads in (1, 2))
    for name in ("normals", "areas", "patches"):
        assert getattr(one, name).tobytes() == getattr(many, name).tobytes()
