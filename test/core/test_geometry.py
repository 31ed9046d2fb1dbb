import numpy as np
import reference
from core.build import around, forward
from scipy.spatial.transform import Rotation

from focus_planner import Rig
from focus_planner.core.geometry import (
    camera_positions,
    camera_rotations,
    rotation_from_quaternion,
)


def test_rotations_are_scipys():
    quaternions = Rotation.random(200, rng=np.random.default_rng(1)).as_quat()
    matrices = rotation_from_quaternion(quaternions)
    assert matrices.shape == (200, 3, 3)
    np.testing.assert_allclose(
        matrices, Rotation.from_quat(quaternions).as_matrix(), rtol=0, atol=1e-14
    )


def test_columns_are_the_cameras_axes():
    rig = around(5, 1.0)
    for camera, rotation in zip(rig.cameras, camera_rotations(rig), strict=True):
        np.testing.assert_allclose(rotation.T, reference.camera_axes(camera), atol=1e-14)


def test_a_camera_turned_nowhere_looks_along_z():
    rig = Rig((forward("a", (1, 2, 3)), forward("b")))
    np.testing.assert_array_equal(camera_rotations(rig), [np.eye(3), np.eye(3)])
    np.testing.assert_array_equal(camera_positions(rig), [[1, 2, 3], [0, 0, 0]])
