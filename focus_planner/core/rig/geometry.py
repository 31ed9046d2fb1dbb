# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Cameras' poses as matrices, and where the corners of their images lie in space."""

from __future__ import annotations

import numpy as np

from focus_planner.core.arrays import FloatArray
from focus_planner.core.rig.camera import Camera
from focus_planner.core.rig.distortion import corner_rays
from focus_planner.core.rig.remembered import remembered
from focus_planner.core.rig.rig import Rig


def rotation_from_quaternion(quaternion: FloatArray) -> FloatArray:
    """Return (n, 3, 3) rotation matrices of (n, 4) unit quaternions x, y, z, w."""
    x, y, z, w = np.moveaxis(np.asarray(quaternion, dtype=np.float64), -1, 0)
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
        (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
        (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
    )
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


@remembered
def camera_positions(rig: Rig) -> FloatArray:
    """Return (C, 3) centres of projection in the rig's frame, metres."""
    return np.array([camera.position for camera in rig.cameras])


@remembered
def camera_rotations(rig: Rig) -> FloatArray:
    """Return (C, 3, 3) matrices whose columns are each camera's x, y, z axis in the rig's frame."""
    quaternions = np.array([camera.orientation for camera in rig.cameras])
    return np.ascontiguousarray(rotation_from_quaternion(quaternions))


def image_corners(camera: Camera, depth: float) -> FloatArray:
    """Return (4, 3) the points that the image's corners show at a depth, in the rig's frame.

    The corners of the pixels that are read out: top left, top right, bottom right, bottom left.
    See :func:`focus_planner.core.rig.distortion.corner_rays` for corners that show nothing.

    Parameters
    ----------
    camera : Camera
    depth : float
        Along the optical axis, metres.
    """
    rays = np.column_stack([corner_rays(camera.intrinsics), np.ones(4)])
    rotation = rotation_from_quaternion(np.array(camera.orientation))
    corners: FloatArray = np.array(camera.position) + depth * rays @ rotation.T
    return corners


def corner_directions(rig: Rig) -> FloatArray:
    """Return (C, 4, 3) the rays through each image's corners, of depth 1, in the rig's frame.

    In the order of :func:`image_corners`: at a depth d the corners are at the camera's position
    + d · these.
    """
    flat = np.array([corner_rays(camera.intrinsics) for camera in rig.cameras])
    rays = np.concatenate([flat, np.ones((len(rig), 4, 1))], axis=2)
    directions: FloatArray = rays @ camera_rotations(rig).transpose(0, 2, 1)
    return directions
