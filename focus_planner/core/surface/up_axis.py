# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Turning a surface so that z is up."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from focus_planner.core.arrays import FloatArray
from focus_planner.core.surface.surface import Mesh, Surface
from focus_planner.core.validation import check_choice


class Turn(NamedTuple):
    """A rotation by quarter turns.

    Attributes
    ----------
    axes : tuple of int
        Which old coordinate becomes the new x, y, z.
    signs : tuple of int
        1 or -1 for each.
    """

    axes: tuple[int, int, int]
    signs: tuple[int, int, int]

    def __str__(self) -> str:
        old = ("x", "y", "z")
        new = (("-" if s < 0 else "") + old[a] for a, s in zip(self.axes, self.signs, strict=True))
        return f"({', '.join(new)})"

    def apply(self, vectors: FloatArray) -> FloatArray:
        """Return (n, 3) the turned vectors, without rounding."""
        turned: FloatArray = vectors[:, self.axes] * np.array(self.signs)
        return turned

    def matrix(self) -> FloatArray:
        """Return the (3, 3) rotation matrix."""
        return self.apply(np.eye(3)).T


#: By the axis that is up before the turn.
TURNS = {
    "z": Turn((0, 1, 2), (1, 1, 1)),
    "y": Turn((0, 2, 1), (1, -1, 1)),
    "x": Turn((2, 1, 0), (-1, 1, 1)),
    "-z": Turn((0, 1, 2), (1, -1, -1)),
    "-y": Turn((0, 2, 1), (1, 1, -1)),
    "-x": Turn((2, 1, 0), (1, 1, -1)),
}


def with_z_up(surface: Surface, up: str) -> Surface:
    """Return the surface, turned about the origin so that its axis ``up`` becomes z.

    Parameters
    ----------
    surface : Mesh or PointCloud
    up : {"z", "y", "x", "-z", "-y", "-x"}
        Its axis that is up in the world.

    Raises
    ------
    InputError
        If there is no such axis.
    """
    turn = TURNS[check_choice("up", up, tuple(TURNS))]
    if up == "z":
        return surface
    if isinstance(surface, Mesh):
        normals = surface.vertex_normals
        return replace(
            surface,
            vertices=turn.apply(surface.vertices),
            vertex_normals=None if normals is None else turn.apply(normals),
        )
    normals = surface.normals
    return replace(
        surface,
        points=turn.apply(surface.points),
        normals=None if normals is None else turn.apply(normals),
    )
