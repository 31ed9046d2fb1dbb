# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What is left out of surfaces, and what is computed, with a note for each."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from focus_planner.core.arrays import FloatArray
from focus_planner.core.surface.cleaning import clean_cloud, clean_mesh
from focus_planner.core.validation import InputError

TETRAHEDRON = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
FACES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
NAN = np.full(3, np.nan)


def ball(count: int = 400, seed: int = 0) -> FloatArray:
    """Return points on the unit sphere, which are their own normals."""
    points = np.random.default_rng(seed).normal(size=(count, 3))
    return np.asarray(points / np.sqrt((points**2).sum(axis=1))[:, None])


def test_what_is_right_stays_as_it_is() -> None:
    vertices = np.concatenate([TETRAHEDRON, [[9, 9, 9]]])  # one in no triangle
    mesh = clean_mesh(vertices, FACES, vertices + 1, np.arange(5))
    np.testing.assert_array_equal(mesh.vertices, vertices)
    np.testing.assert_array_equal(mesh.triangles, FACES)
    np.testing.assert_array_equal(mesh.vertex_importance, np.arange(5))
    cloud = clean_cloud(ball(), ball(), np.arange(400))
    np.testing.assert_array_equal(cloud.points, ball())
    np.testing.assert_array_equal(cloud.importance, np.arange(400))
    assert mesh.notes == cloud.notes == ()


def test_triangles_without_area_and_with_nan_are_left_out() -> None:
    vertices = np.concatenate([TETRAHEDRON, [NAN, [np.inf, 0, 0], [0.5, 0, 0]]])
    faces = [*FACES.tolist(), [0, 1, 4], [0, 1, 5], [0, 6, 1], [2, 2, 3]]
    mesh = clean_mesh(vertices, np.array(faces), importance=np.array([1, 2, 3, 4, np.nan, -1, 5]))
    np.testing.assert_array_equal(mesh.vertices[mesh.triangles], TETRAHEDRON[FACES])
    assert mesh.vertex_importance is not None
    np.testing.assert_array_equal(mesh.vertex_importance[mesh.triangles], FACES + 1)
    assert [note.code for note in mesh.notes] == ["left_out"] * 2
    assert mesh.notes[0].text == (
        "left out: 2 of 8 triangles, with corners that are not finite numbers; repair the mesh, or"
        " expect a hole there"
    )
    assert mesh.notes[1].text == (
        "left out: 2 of 8 triangles, which have no area; the rest is planned for"
    )


@pytest.mark.parametrize(
    ("vertices", "faces", "telling"),
    [
        (TETRAHEDRON, [[0, 1, 4]], r"vertex indices from 0 to 3, got \[0, 1, 4\]"),
        (TETRAHEDRON, [[0, 1, -1]], "vertex indices from 0 to 3"),
        (TETRAHEDRON, [[0, 1, 1]], "triangles with an area, got 1 of 1 degenerate"),
        (TETRAHEDRON * np.nan, [[0, 1, 2]], "NaN or infinity in 4 of 4"),
        (TETRAHEDRON, np.empty((0, 3), int), "at least one triangle, got none"),
        (np.empty((0, 3)), [[0, 1, 2]], "mesh vertices: expected at least one, got none"),
        (TETRAHEDRON * 1e300, FACES, "metres up to 1e"),
    ],
)
def test_a_mesh_of_nothing_right_is_refused(
    vertices: FloatArray, faces: list[list[int]], telling: str
) -> None:
    with pytest.raises(InputError, match=telling):
        clean_mesh(vertices, np.array(faces))


def test_an_importance_of_nonsense_is_refused_where_it_counts() -> None:
    with pytest.raises(InputError, match="vertex_importance: expected finite numbers"):
        clean_mesh(TETRAHEDRON, FACES, importance=np.array([1, np.nan, 1, 1]))
    with pytest.raises(InputError, match="cloud importance: expected numbers of at least 0"):
        clean_cloud(ball(), importance=-np.arange(400))


@pytest.mark.parametrize("bad", [[0.0, 0, 0], NAN, [np.inf, 0, 0], [1e200, 0, 0], [1e-170, 0, 0]])
def test_some_normals_of_vertices_are_computed_by_area(bad: FloatArray) -> None:
    # A box corner: three faces, one of them in two triangles.
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 2], [1, 1, 0]])
    faces = np.array([[0, 2, 4], [0, 4, 1], [0, 1, 3], [0, 3, 2]])
    normals = np.tile([0.0, 0, -1], (5, 1))
    normals[0] = bad
    mesh = clean_mesh(vertices, faces, normals)
    assert mesh.vertex_normals is not None
    expected = np.array([-2.0, -2, -2])  # twice the areas: 1 + 1, 2, 2
    np.testing.assert_allclose(mesh.vertex_normals[0], expected / np.sqrt((expected**2).sum()))
    np.testing.assert_array_equal(mesh.vertex_normals[1:], normals[1:])
    (note,) = mesh.notes
    assert note.text == (
        "left out: the normals of 1 of 5 vertices, which are missing, zero or not finite;"
        " they are computed from the triangles around instead"
    )


def test_normals_that_are_all_none_are_as_if_there_were_none() -> None:
    mesh = clean_mesh(TETRAHEDRON, FACES, np.zeros((4, 3)))
    cloud = clean_cloud(ball(), ball() * np.nan)
    assert mesh.vertex_normals is cloud.normals is None
    (of_mesh,), (of_cloud,) = mesh.notes, cloud.notes
    assert of_mesh.text == (
        "left out: the normals of all 4 vertices, which are missing, zero or not finite;"
        " those of the triangles are used instead"
    )
    assert of_cloud.text == (
        "left out: the normals of all 400 points, which are missing, zero or not finite;"
        " estimates from the points are used instead"
    )


@given(st.sets(st.integers(0, 399), min_size=1, max_size=399))
def test_some_normals_of_points_agree_with_their_neighbours(missing: set[int]) -> None:
    normals = 3 * ball()
    normals[sorted(missing)] = 0
    cloud = clean_cloud(ball(), normals)
    assert cloud.normals is not None
    if len(missing) < 200:  # with fewer left they may be of another side of the ball
        assert ((cloud.normals * ball()).sum(axis=1) > 0.8).all()
    given_ = np.delete(np.arange(400), sorted(missing))
    np.testing.assert_allclose(cloud.normals[given_], ball()[given_])
    (note,) = cloud.notes
    assert note.text.startswith(f"left out: the normals of {len(missing)} of 400 points, which are")


def test_points_that_are_not_finite_are_left_out_with_all_they_say() -> None:
    points = ball(30)
    points[4, 1], points[7, 2] = np.nan, -np.inf
    normals, importance = ball(30), np.arange(30.0)
    normals[4], importance[7] = 0, np.nan
    cloud = clean_cloud(points, normals, importance)
    kept = np.delete(np.arange(30), [4, 7])
    np.testing.assert_array_equal(cloud.points, points[kept])
    np.testing.assert_allclose(cloud.normals, ball(30)[kept])
    np.testing.assert_array_equal(cloud.importance, kept)
    (note,) = cloud.notes
    assert note.text == (
        "left out: 2 of 30 points, which are not finite numbers; the rest is planned for"
    )
    points[:20] = np.nan
    with pytest.raises(InputError, match="at least 16 points, got 10 that are finite, of 30"):
        clean_cloud(points)
