# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Triangles of polygons, against areas and against points within them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from focus_planner.core.arrays import FloatArray
from focus_planner.io.formats.polygons import triangulate


def areas(points: FloatArray, triangles: NDArray[np.int64]) -> FloatArray:
    """Return the areas of triangles in the plane z = 0, below 0 where clockwise."""
    a, b, c = (points[triangles[:, i]] for i in range(3))
    return np.cross(b - a, c - a)[:, 2] / 2


def polygon_area(points: FloatArray) -> float:
    x, y = points[:, 0], points[:, 1]
    return float((x * np.roll(y, -1) - y * np.roll(x, -1)).sum() / 2)


def star(radii: list[float]) -> FloatArray:
    """Return a polygon around the origin, counter-clockwise, concave where a radius is short."""
    angles = 2 * np.pi * np.arange(len(radii)) / len(radii)
    return np.column_stack([radii * np.cos(angles), radii * np.sin(angles), np.zeros(len(radii))])


@given(
    st.lists(st.floats(0.1, 1), min_size=5, max_size=12),
    st.integers(0, 11),
    st.booleans(),
)
def test_they_cover_it_once(radii: list[float], first: int, reverse: bool) -> None:
    points = np.roll(star(radii), first, axis=0)
    order = np.arange(len(points))[:: -1 if reverse else 1]
    triangles = triangulate(points, order, np.array([len(points)]))
    parts = areas(points, triangles) * (-1 if reverse else 1)
    assert (parts > -1e-12).all()  # all turn as the polygon does
    assert parts.sum() == pytest.approx(polygon_area(points), rel=1e-9)


@pytest.mark.parametrize("first", range(4))
def test_an_arrowhead_is_cut_where_it_turns_back(first: int) -> None:
    points = np.roll([[0.0, 0, 0], [2, 1, 0], [0, 2, 0], [0.5, 1, 0]], first, axis=0)
    parts = areas(points, triangulate(points, np.arange(4), np.array([4])))
    assert (parts > 0).all()
    assert parts.sum() == pytest.approx(1.5)


def test_polygons_of_all_sizes_keep_their_order() -> None:
    points = np.column_stack([star([1.0] * 8)[:, :2], np.arange(8) / 100])
    corners = np.concatenate([np.arange(n) for n in (5, 3, 4, 2, 1, 3)])
    triangles = triangulate(points, corners, np.array([5, 3, 4, 2, 1, 3]))
    assert triangles.tolist() == [
        *([0, 1, 2], [0, 2, 3], [0, 3, 4]),
        [0, 1, 2],
        *([0, 1, 2], [0, 2, 3]),
        *([0, 0, 1], [0, 0, 0]),  # a line and a point, which have no area
        [0, 1, 2],
    ]


def test_a_concave_polygon_may_stand_anywhere() -> None:
    flat = np.array([[0.0, 0], [2, 0], [2, 2], [1, 0.5], [0, 2]])
    for axis in range(3):
        points = np.insert(flat, axis, 7.0, axis=1)
        triangles = triangulate(points, np.arange(5), np.array([5]))
        a, b, c = (points[triangles[:, i]] for i in range(3))
        crosses = np.cross(b - a, c - a)
        assert np.abs(crosses.sum(axis=0)).max() / 2 == pytest.approx(2.5)
        assert (np.abs(crosses).sum() / 2) == pytest.approx(2.5)


def test_corners_that_do_not_exist_stay_for_the_mesh_to_refuse() -> None:
    triangles = triangulate(np.zeros((3, 3)), np.array([0, 1, 2, 9]), np.array([4]))
    assert triangles.max() == 9
