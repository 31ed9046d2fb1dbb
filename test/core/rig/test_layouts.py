import math

import numpy as np
import pytest

from focus_planner import CameraIntrinsics, Grid, InputError, Lens, cylinder_rig
from focus_planner.core.rig.geometry import camera_positions, camera_rotations
from testing import reference


def test_the_default_is_the_papers_rig():
    rig = cylinder_rig()
    positions = camera_positions(rig)
    assert len(rig) == 7 * 24
    assert rig.grid == Grid(7, 24)
    np.testing.assert_allclose(np.hypot(positions[:, 0], positions[:, 1]), 0.75)
    np.testing.assert_allclose(np.unique(positions[:, 2].round(9)), np.linspace(0.1, 1.7, 7))
    assert {camera.lens for camera in rig.cameras} == {Lens()}
    assert {camera.intrinsics for camera in rig.cameras} == {CameraIntrinsics()}


@pytest.mark.parametrize(("rows", "columns"), [(1, 1), (1, 3), (2, 4), (7, 24), (3, 101)])
def test_cameras_look_horizontally_at_the_axis(rows, columns):
    rig = cylinder_rig(rows, columns, radius=0.9, bottom=-1.0, top=2.0)
    rotations = camera_rotations(rig)
    np.testing.assert_allclose(
        rotations.transpose(0, 2, 1) @ rotations, np.tile(np.eye(3), (len(rig), 1, 1)), atol=1e-14
    )
    np.testing.assert_allclose(np.linalg.det(rotations), 1.0)
    for index, camera in enumerate(rig.cameras):
        angle = 2 * math.pi * (index % columns) / columns
        height = -1.0 + 3.0 * (index // columns) / (rows - 1) if rows > 1 else 0.5
        outward = np.array([math.cos(angle), math.sin(angle), 0.0])
        np.testing.assert_allclose(camera.position, 0.9 * outward + [0, 0, height], atol=1e-15)
        x, y, z = reference.camera_axes(camera)
        np.testing.assert_allclose(z, -outward, atol=1e-14)
        np.testing.assert_allclose(y, [0, 0, -1], atol=1e-14)
        np.testing.assert_allclose(x, np.cross(y, z), atol=1e-14)


def test_names_sort_as_the_cameras_stand():
    names = [camera.name for camera in cylinder_rig(2, 12).cameras]
    assert names[0] == "cam_0_00"
    assert names[-1] == "cam_1_11"
    assert names == sorted(names)
    wide = [camera.name for camera in cylinder_rig(1, 101).cameras]
    assert wide[7] == "cam_0_007"
    assert wide == sorted(wide)


def test_a_rig_takes_image_lens_and_frame():
    lens, intrinsics = Lens(0.035, 5.0), CameraIntrinsics(100, 200, 90.0, 90.0, 50.0, 100.0)
    rig = cylinder_rig(1, 2, lens=lens, intrinsics=intrinsics, frame_id="booth")
    assert rig.frame_id == "booth"
    assert all(camera.lens == lens and camera.intrinsics == intrinsics for camera in rig.cameras)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"rows": 0}, "rows: expected a whole number of at least 1, got 0"),
        ({"columns": 2.5}, "columns: expected a whole number of at least 1, got 2.5"),
        ({"radius": 0}, "radius: expected a number above 0, got 0"),
        ({"bottom": math.nan}, "bottom: expected a number, got nan"),
        ({"top": math.inf}, "top: expected a number, got inf"),
        ({"bottom": 1.0, "top": 0.5}, r"top: expected at least bottom \(1 m\), got 0.5 m"),
    ],
)
def test_rigs_that_cannot_be(values, message):
    with pytest.raises(InputError, match=message):
        cylinder_rig(**values)
