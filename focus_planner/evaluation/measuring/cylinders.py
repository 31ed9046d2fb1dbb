# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Cylinders of cameras with other numbers of rows and columns."""

from __future__ import annotations

import math

import numpy as np

from focus_planner.core.rig.geometry import camera_positions, camera_rotations
from focus_planner.core.rig.layouts import cylinder_rig
from focus_planner.core.rig.rig import Rig
from focus_planner.core.validation import InputError

# Positions, and the directions of the axes, of a rig that was written to a file and read again.
_TOLERANCE = 1e-3


def aspect_ratio(rows: int, columns: int, radius: float = 0.75, height: float = 1.6) -> float:
    """Return the distance between rows over that between columns, along the cylinder.

    Parameters
    ----------
    rows, columns : int
        At least 2 rows.
    radius, height : float
        Of the cylinder, metres; the paper's by default.
    """
    return (height / (rows - 1)) / (2 * math.pi * radius / columns)


def cylinder_like(rig: Rig, rows: int, columns: int) -> tuple[Rig, float]:
    """Return a cylinder with another grid of the same cameras, and its aspect ratio.

    Raises
    ------
    InputError
        If the rig is not a cylinder of at least two rows of equal cameras.
    """
    radius, bottom, top = _cylinder(rig)
    camera = rig.cameras[0]
    other = cylinder_rig(
        rows, columns, radius, bottom, top,
        intrinsics=camera.intrinsics, lens=camera.lens, frame_id=rig.frame_id,
    )  # fmt: skip
    return other, aspect_ratio(rows, columns, radius, top - bottom)


def _cylinder(rig: Rig) -> tuple[float, float, float]:
    """Return the radius of a cylinder of cameras, and the heights of its ends, metres."""
    positions, first = camera_positions(rig), rig.cameras[0]
    radius = float(np.hypot(*positions[0, :2]))
    bottom, top = float(positions[0, 2]), float(positions[-1, 2])
    equal = all((c.intrinsics, c.lens) == (first.intrinsics, first.lens) for c in rig.cameras)
    if rig.grid is None or not equal or radius < _TOLERANCE or top - bottom < _TOLERANCE:
        raise _not_a_cylinder()
    same = cylinder_rig(rig.grid.rows, rig.grid.columns, radius, bottom, top)
    turned = camera_rotations(rig) - camera_rotations(same)
    if max(np.abs(positions - camera_positions(same)).max(), np.abs(turned).max()) > _TOLERANCE:
        raise _not_a_cylinder()
    return radius, bottom, top


def _not_a_cylinder() -> InputError:
    return InputError(
        "rig",
        "a cylinder of equal cameras about the z axis, in at least 2 rows, with its grid",
        "another rig",
        "give one as `focus_planner rig cylinder` makes them, or leave out the experiment cameras",
    )
