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

import numpy as np
import pytest

from focus_planner import (
    InputError,
    Mesh,
    PointCloud,
)

TETRAHEDRON = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
FACES = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]


def test_a_mesh_keeps_its_own_read_only_arrays():
    vertices = TETRAHEDRON.copy()
    mesh = Mesh(vertices, FACES, 3 * np.ones((4, 3)))
    vertices[:] = 0
    np.testing.assert_array_equal(mesh.vertices, TETRAHEDRON)
    assert mesh.triangles.dtype == np.int32
    np.testing.assert_allclose(mesh.vertex_normals, 1 / np.sqrt(3))
    for array in (mesh.vertices, mesh.triangles, mesh.vertex_normals):
        with pytest.raises(ValueError, match="read-only"):
            array[0, 0] = 1
    with pytest.raises(dataclasses.FrozenInstanceError):
        mesh.vertices = TETRAHEDRON


def test_cross_products_point_outward_with_twice_the_area():
    crosses = Mesh(TETRAHEDRON, FACES).cross_products
    np.testing.assert_array_equal(crosses, [[0, 0, -1], [0, -1, 0], [-1, 0, 0], [1, 1, 1]])


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"triangles": np.zeros((0, 3), int)}, "mesh: expected at least one triangle, got none"),
        ({"triangles": [[0, 1]]}, r"mesh triangles: expected shape \(n, 3\), got shape \(1, 2\)"),
        ({"vertices": np.zeros((0, 3))}, "mesh vertices: expected at least one, got none"),
        ({"vertices": np.zeros((4, 2))}, r"mesh vertices: expected shape \(n, 3\)"),
        (
            {"triangles": [[0, 1, 2], [0, 1, 4]]},
            r"mesh triangles: expected vertex indices from 0 to 3, got \[0, 1, 4\] in triangle 1",
        ),
        ({"triangles": [[0, -1, 2]]}, r"vertex indices from 0 to 3, got \[0, -1, 2\]"),
        (
            {"triangles": [[0, 1, 2], [0, 1, 1]]},
            (
                r"mesh triangles: expected triangles with an area, got 1 of 2 degenerate "
                r"\(first: 1\); remove them"
            ),
        ),
        (
            {"vertices": np.where(TETRAHEDRON > 0, np.nan, TETRAHEDRON)},
            (
                r"mesh vertices: expected finite numbers, got NaN or infinity in 3 of 4 "
                r"\(first: vertex 1\); repair the mesh"
            ),
        ),
        ({"vertex_normals": np.ones((3, 3))}, r"mesh vertex_normals: expected shape \(4, 3\)"),
        (
            {"vertex_normals": np.zeros((4, 3))},
            (
                r"mesh vertex_normals: expected vectors with a length, got 4 of 4 of length zero "
                r"\(first: 0\); leave the normals out"
            ),
        ),
        (
            {"vertex_normals": np.full((4, 3), np.inf)},
            "mesh vertex_normals: expected finite numbers",
        ),
        (
            {"vertex_importance": np.ones(3)},
            r"mesh vertex_importance: expected shape \(4\), got shape \(3,\)",
        ),
        ({"vertex_importance": np.ones((4, 1))}, "mesh vertex_importance: expected shape"),
        (
            {"vertex_importance": [1, 2, np.nan, 3]},
            (
                "mesh vertex_importance: expected finite numbers, got NaN or infinity in 1 of 4 "
                r"\(first: vertex 2\)"
            ),
        ),
        ({"vertex_importance": [1, 2, np.inf, 3]}, "mesh vertex_importance: .*NaN or infinity"),
        (
            {"vertex_importance": [1, -2, 0, -1]},
            (
                "mesh vertex_importance: expected numbers of at least 0, got 2 of 4 below "
                r"\(first: -2 of vertex 1\)"
            ),
        ),
        (
            {"vertex_importance": np.zeros(4)},
            "mesh vertex_importance: expected some above 0, got 0 all over the surface; leave",
        ),
        (
            {"triangles": [[0, 1, 2]], "vertex_importance": [0, 0, 0, 5]},
            "mesh vertex_importance: expected some above 0, got 0 all over the surface",
        ),
        ({"vertex_importance": ["much"] * 4}, "mesh vertex_importance: expected numbers"),
    ],
)
def test_meshes_that_cannot_be(values, message):
    with pytest.raises(InputError, match=message):
        Mesh(**{"vertices": TETRAHEDRON, "triangles": FACES} | values)


def test_indices_of_vertices_are_whole():
    with pytest.raises(InputError, match="mesh triangles"):
        Mesh(TETRAHEDRON, [[0.0, 1.5, 2.0]])


def test_a_thin_triangle_has_an_area_and_one_on_a_line_has_none():
    Mesh([[0, 0, 0], [1, 0, 0], [0.5, 1e-9, 0]], [[0, 1, 2]])
    with pytest.raises(InputError, match="1 of 1 degenerate"):
        Mesh([[0, 0, 0], [1, 1, 1], [3, 3, 3]], [[0, 1, 2]])
    # The smallest scenes are not degenerate for being small.
    Mesh(1e-6 * TETRAHEDRON, FACES)


def test_a_cloud_keeps_its_own_read_only_arrays():
    points = np.random.default_rng(0).random((16, 3))
    cloud = PointCloud(points, 2 * np.ones((16, 3)))
    np.testing.assert_array_equal(cloud.points, points)
    np.testing.assert_allclose((cloud.normals**2).sum(axis=1), 1)
    for array in (cloud.points, cloud.normals):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


@pytest.mark.parametrize(
    ("points", "normals", "message"),
    [
        (np.zeros((0, 3)), None, "cloud: expected at least 16 points, got an empty cloud"),
        (np.zeros((15, 3)), None, "cloud: expected at least 16 points, got 15"),
        (np.zeros((16, 2)), None, r"cloud points: expected shape \(n, 3\), got shape \(16, 2\)"),
        (
            np.full((16, 3), np.nan),
            None,
            (
                r"cloud points: expected finite numbers, got NaN or infinity in 16 of 16 "
                r"\(first: point 0\); remove the invalid points first"
            ),
        ),
        (np.ones((16, 3)), np.ones((15, 3)), r"cloud normals: expected shape \(16, 3\)"),
        (np.ones((16, 3)), np.zeros((16, 3)), "cloud normals: expected vectors with a length"),
        (np.ones((16, 3)), np.full((16, 3), np.nan), "cloud normals: expected finite numbers"),
        (np.ones((16, 3)), np.full((16, 3), 1e200), "cloud normals: expected components up to 1e"),
        (np.ones((16, 3)), np.full((16, 3), 1e-160), "16 of 16 of length zero"),
    ],
)
def test_clouds_that_cannot_be(points, normals, message):
    with pytest.raises(InputError, match=message):
        PointCloud(points, normals)


@pytest.mark.parametrize(
    ("importance", "message"),
    [
        (np.ones(15), r"cloud importance: expected shape \(16\), got shape \(15,\)"),
        (np.full(16, np.nan), r"cloud importance: .* in 16 of 16 \(first: point 0\)"),
        (-np.arange(16), r"numbers of at least 0, got 15 of 16 below \(first: -1 of point 1\)"),
        (np.zeros(16), "cloud importance: expected some above 0, got 0 all over the surface"),
    ],
)
def test_an_importance_of_points_that_cannot_be(importance, message):
    with pytest.raises(InputError, match=message):
        PointCloud(np.random.default_rng(0).random((16, 3)), importance=importance)


def test_importance_is_kept_as_it_is_given():
    importance = np.array([0.0, 7.0, 1e-300, 1e300])
    mesh = Mesh(TETRAHEDRON, FACES, vertex_importance=importance)
    cloud = PointCloud(np.random.default_rng(0).random((16, 3)), importance=np.arange(16))
    for kept, expected in ((mesh.vertex_importance, importance), (cloud.importance, range(16))):
        np.testing.assert_array_equal(kept, expected)
        with pytest.raises(ValueError, match="read-only"):
            kept[0] = 1
