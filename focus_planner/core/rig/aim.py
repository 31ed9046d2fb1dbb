# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Orientations of cameras that look in a given direction, upright."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from focus_planner.core.arrays import FloatArray
from focus_planner.core.validation import InputError

# A direction this close to the vertical (the sine of the angle) has no horizontal to go by.
_VERTICAL = 1e-6


def looking_along(directions: FloatArray) -> Rotation:
    """Return upright orientations of cameras that look in these directions.

    A camera is upright if its image's x axis is horizontal and the y axis points down, z being up
    (REP 103). One that looks straight down or up has +y at the top of its image.

    Parameters
    ----------
    directions : (N, 3) array
        In the rig's frame; of any length above 0.

    Returns
    -------
    Rotation
        N rotations from the optical frames to the rig's.

    Raises
    ------
    InputError
        If a direction has no length: a camera is where it is to look.
    """
    lengths = np.linalg.norm(directions, axis=1)
    if not (lengths > 0).all():
        first = int(np.argmin(lengths > 0))
        raise InputError(f"pose {first + 1}", "a point elsewhere to look at", "its own position")
    z = directions / lengths[:, None]
    # z forward × up is right.
    x = np.stack([z[:, 1], -z[:, 0], np.zeros(len(z))], axis=1)
    level = np.linalg.norm(x, axis=1)
    vertical = level < _VERTICAL
    x[vertical] = [1.0, 0.0, 0.0] * np.ones((int(vertical.sum()), 1))
    x[~vertical] /= level[~vertical, None]
    # Straight down, right is +x and down is -y; straight up, right is -x, so that +y stays on top.
    x[vertical & (z[:, 2] > 0)] *= -1
    y = np.cross(z, x)
    y /= np.linalg.norm(y, axis=1)[:, None]
    return Rotation.from_matrix(np.stack([np.cross(y, z), y, z], axis=2))
