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

import numpy as np
import pytest

from focus_planner import InputError, Mesh, PointCloud
from focus_planner.core.surface.up_axis import TURNS, with_z_up
from testing.problems import sphere

UP = {
    "x": (1, 0, 0),
    "y": (0, 1, 0),
    "z": (0, 0, 1),
    "-x": (-1, 0, 0),
    "-y": (0, -1, 0),
    "-z": (0, 0, -1),
}


@pytest.mark.parametrize("up", TURNS)
def test_the_axis_becomes_z_by_a_rotation(up: str) -> None:
    turn = TURNS[up].matrix()
    np.testing.assert_array_equal(turn @ UP[up], (0, 0, 1))
    np.testing.assert_array_equal(turn @ turn.T, np.eye(3))
    assert np.linalg.det(turn) == pytest.approx(1)


@pytest.mark.parametrize("up", TURNS)
def test_points_and_normals_turn_without_rounding(up: str) -> None:
    mesh = sphere(0.3)
    turn = TURNS[up].matrix()
    noted = Mesh(mesh.vertices, mesh.triangles, mesh.vertices, np.arange(len(mesh.vertices)))
    turned = with_z_up(noted, up)
    assert isinstance(turned, Mesh)
    np.testing.assert_array_equal(turned.vertices, mesh.vertices @ turn.T)
    np.testing.assert_array_equal(turned.triangles, mesh.triangles)
    assert turned.vertex_normals is not None
    assert noted.vertex_normals is not None
    np.testing.assert_allclose(turned.vertex_normals, noted.vertex_normals @ turn.T, atol=1e-15)
    np.testing.assert_array_equal(turned.vertex_importance, noted.vertex_importance)
    cloud = with_z_up(PointCloud(mesh.vertices, mesh.vertices), up)
    assert isinstance(cloud, PointCloud)
    np.testing.assert_array_equal(cloud.points, turned.vertices)
    assert with_z_up(PointCloud(mesh.vertices), up).normals is None  # type: ignore[union-attr]


def test_z_up_is_as_it_was() -> None:
    mesh = sphere(0.3)
    assert with_z_up(mesh, "z") is mesh


def test_how_it_is_written() -> None:
    assert str(TURNS["y"]) == "(x, -z, y)"
    assert str(TURNS["-x"]) == "(z, y, -x)"


def test_no_such_axis() -> None:
    with pytest.raises(InputError, match="up: expected one of z, y, x, -z, -y, -x, got 'w'"):
        with_z_up(sphere(0.3), "w")
