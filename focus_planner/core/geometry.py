"""Poses of cameras."""

from __future__ import annotations

import numpy as np

from focus_planner.core.types import Camera, FloatArray, Rig


def rotation_from_quaternion(quaternion: FloatArray) -> FloatArray:
    """Return (n, 3, 3) rotation matrices of (n, 4) unit quaternions x, y, z, w."""
    x, y, z, w = np.moveaxis(np.asarray(quaternion, dtype=np.float64), -1, 0)
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
        (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
        (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
    )
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


def camera_positions(rig: Rig) -> FloatArray:
    """Return (C, 3) centres of projection in the rig's frame, metres."""
    return np.array([camera.position for camera in rig.cameras])


def camera_rotations(rig: Rig) -> FloatArray:
    """Return (C, 3, 3) matrices whose columns are each camera's x, y, z axis in the rig's frame."""
    return rotation_from_quaternion(np.array([camera.orientation for camera in rig.cameras]))


def image_corners(camera: Camera, depth: float) -> FloatArray:
    """Return (4, 3) the points at a depth that the image's corners show, in the rig's frame.

    From the first pixel's corner with the rows: top left, top right, bottom right, bottom left.

    Parameters
    ----------
    camera : Camera
    depth : float
        Along the optical axis, metres.
    """
    image = camera.image
    u = np.array([0, image.width, image.width, 0]) - 0.5
    v = np.array([0, 0, image.height, image.height]) - 0.5
    rays = np.stack([(u - image.cx) / image.fx, (v - image.cy) / image.fy, np.ones(4)], axis=-1)
    rotation = rotation_from_quaternion(np.array(camera.orientation))
    corners: FloatArray = np.array(camera.position) + depth * rays @ rotation.T
    return corners
