# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

import math

import numpy as np
import pytest

from focus_planner import (
    CameraIntrinsics,
    Grid,
    InputError,
    Lens,
    cylinder_rig,
    dome_rig,
    turntable_rig,
)
from focus_planner.core.rig.geometry import camera_positions, camera_rotations
from focus_planner.core.rig.walk import walking_order
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


def looks_at(camera, target):
    """Return whether a camera looks at a point, upright: its x axis is horizontal, y downward."""
    x, y, z = reference.camera_axes(camera)
    towards = np.subtract(target, camera.position)
    np.testing.assert_allclose(z, towards / np.linalg.norm(towards), atol=1e-14)
    assert abs(x[2]) < 1e-14
    assert y[2] <= 1e-14
    np.testing.assert_allclose(np.cross(z, x), y, atol=1e-14)


def elevations(rig, centre):
    offsets = camera_positions(rig) - centre
    return np.degrees(np.arctan2(offsets[:, 2], np.hypot(offsets[:, 0], offsets[:, 1])))


def test_a_dome_looks_at_its_centre_from_equal_distances():
    rig = dome_rig(4, 12, 1.5, -10.0, 90.0, 0.7, frame_id="dome")
    centre = np.array([0, 0, 0.7])
    np.testing.assert_allclose(np.linalg.norm(camera_positions(rig) - centre, axis=1), 1.5)
    for camera in rig.cameras:
        looks_at(camera, centre)
    assert rig.frame_id == "dome"
    assert rig.grid is None


def test_higher_rings_of_a_dome_have_fewer_cameras():
    rig = dome_rig(4, 12, 1.0, 0.0, 90.0, 0.0)
    rings = [camera.name.split("_")[1] for camera in rig.cameras]
    assert [rings.count(str(ring)) for ring in range(4)] == [12, 10, 6, 1]
    np.testing.assert_allclose(np.unique(elevations(rig, 0).round(9)), [0, 30, 60, 90])
    assert [camera.name for camera in rig.cameras] == sorted(camera.name for camera in rig.cameras)


def test_a_single_ring_is_halfway():
    for rig in (dome_rig(1, 8, 1.0, 10.0, 50.0, 0.2), turntable_rig(1, 8, 1.0, 10.0, 50.0, 0.2)):
        np.testing.assert_allclose(elevations(rig, [0, 0, 0.2]), 30.0)


def test_a_turntable_turns_the_subject_counter_clockwise():
    rig = turntable_rig(2, 4, 0.5, 0.0, 45.0, 0.1)
    names = [camera.name for camera in rig.cameras]
    assert names[:5] == ["cam_0_00", "cam_0_01", "cam_0_02", "cam_0_03", "cam_1_00"]
    assert rig.grid == Grid(2, 4)
    # A quarter of a turn brings the subject's -y to where its +x was: before the camera.
    np.testing.assert_allclose(rig.cameras[0].position, [0.5, 0, 0.1], atol=1e-15)
    np.testing.assert_allclose(rig.cameras[1].position, [0, -0.5, 0.1], atol=1e-15)
    for camera in rig.cameras:
        looks_at(camera, [0, 0, 0.1])


def test_one_camera_goes_there_and_back_on_a_dome():
    fixed, moved = dome_rig(3, 8, 1.0, 0, 60), dome_rig(3, 8, 1.0, 0, 60, one_camera=True)
    assert not fixed.sequence
    assert moved.sequence
    assert {c.name: c for c in moved.cameras} == {c.name: c for c in fixed.cameras}
    names = [camera.name for camera in moved.cameras]
    ring = {k: [name for name in names if name.startswith(f"cam_{k}_")] for k in range(3)}
    assert names == ring[0] + ring[1] + ring[2]
    assert [ring[k] == sorted(ring[k]) for k in range(3)] == [True, False, True]
    assert ring[1] == sorted(ring[1])[::-1]
    # The longest way is shorter than in the order of the fixed cameras.
    longest = [
        np.linalg.norm(np.diff(camera_positions(rig), axis=0), axis=1).max()
        for rig in (fixed, moved)
    ]
    assert longest[1] < longest[0]


def test_before_a_turntable_cameras_may_stand_at_heights():
    rig = turntable_rig(3, 16, 0.3, bottom=0.004, top=0.026)
    for index, camera in enumerate(rig.cameras):
        row, stop = divmod(index, 16)
        angle = -2 * math.pi * stop / 16
        outward = np.array([math.cos(angle), math.sin(angle), 0.0])
        np.testing.assert_allclose(
            camera.position, 0.3 * outward + [0, 0, 0.004 + 0.011 * row], atol=1e-15
        )
        _, y, z = reference.camera_axes(camera)
        np.testing.assert_allclose(z, -outward, atol=1e-14)
        np.testing.assert_allclose(y, [0, 0, -1], atol=1e-14)
    assert rig.grid == Grid(3, 16)
    single = turntable_rig(1, 4, bottom=0.1, top=0.3)
    np.testing.assert_allclose(camera_positions(single)[:, 2], 0.2)


def test_before_a_turntable_shooting_is_stop_by_stop_or_turn_by_turn():
    arc, one = turntable_rig(2, 3), turntable_rig(2, 3, one_camera=True)
    assert arc.cameras == one.cameras
    assert [arc.cameras[i].name[4:] for i in walking_order(arc)] == [
        *("0_00", "1_00", "0_01", "1_01", "0_02", "1_02")
    ]
    assert walking_order(one).tolist() == list(range(6))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: turntable_rig(bottom=0.1), "bottom and top: expected both or neither"),
        (
            lambda: turntable_rig(bottom=0.1, top=0.2, lowest=5),
            "or lowest, highest and height, got",
        ),
        (lambda: turntable_rig(bottom=0.3, top=0.2), r"top: expected at least bottom \(0.3 m\)"),
        (lambda: dome_rig(rings=0), "rings: expected a whole number of at least 1"),
        (lambda: dome_rig(lowest=50, highest=40), r"highest: expected at least lowest \(50°\)"),
        (lambda: dome_rig(highest=91), "highest: expected a number of at least -90, at most 90"),
        (lambda: dome_rig(rings=3000, columns=2000), "cameras: expected at most"),
        (lambda: dome_rig(radius=0), "radius: expected a number above 0"),
        (lambda: turntable_rig(stops=0), "stops: expected a whole number of at least 1"),
        (lambda: turntable_rig(3000, 2000), "cameras × stops: expected at most"),
    ],
)
def test_impossible_domes_and_turntables_are_refused(make, message):
    with pytest.raises(InputError, match=message):
        make()
