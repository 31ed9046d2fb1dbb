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

from focus_planner import CameraIntrinsics, InputError, Lens, gantry_rig
from focus_planner.core.rig.geometry import camera_positions, image_corners
from focus_planner.core.rig.walk import walking_order
from testing import reference

# 400 × 300 pixels, 0.8 mm of the plane each at 0.4 m.
IMAGE = CameraIntrinsics(400, 300, 500.0, 500.0, 199.5, 149.5)
WIDE, TALL = 0.32, 0.24


def shown(camera, distance):
    """Return the corners of what a camera shows of the plane."""
    return image_corners(camera, distance)


def test_pictures_show_the_whole_rectangle_with_at_least_the_overlap():
    rig = gantry_rig(1.0, 0.6, 0.4, 0.3, intrinsics=IMAGE, centre=(2.0, 3.0, 0.1))
    corners = np.array([shown(camera, 0.4) for camera in rig.cameras])
    np.testing.assert_allclose(corners[..., 2], 0.1, atol=1e-12)
    np.testing.assert_allclose(corners.reshape(-1, 3).min(axis=0)[:2], [1.5, 2.7], atol=1e-12)
    np.testing.assert_allclose(corners.reshape(-1, 3).max(axis=0)[:2], [2.5, 3.3], atol=1e-12)
    places = camera_positions(rig)
    np.testing.assert_allclose(places[:, 2], 0.5)
    for axis, size, length in ((0, WIDE, 1.0), (1, TALL, 0.6)):
        lines = np.unique(places[:, axis].round(9))
        steps = np.diff(lines)
        np.testing.assert_allclose(steps, steps[0], atol=1e-8)
        assert 1 - steps[0] / size >= 0.3 - 1e-9
        # One picture fewer would overlap less.
        assert 1 - (length - size) / (len(lines) - 2) / size < 0.3
    assert len(rig) == 5 * 4


def test_shooting_order_goes_there_and_back():
    rig = gantry_rig(0.8, 0.5, 0.4, columns=3, rows=3, intrinsics=IMAGE)
    assert [camera.name for camera in rig.cameras] == [
        *("cam_0_00", "cam_0_01", "cam_0_02"),
        *("cam_1_02", "cam_1_01", "cam_1_00"),
        *("cam_2_00", "cam_2_01", "cam_2_02"),
    ]
    assert rig.sequence
    assert walking_order(rig).tolist() == list(range(9))
    places = camera_positions(rig)
    # From the lower left, never farther than to the next place.
    np.testing.assert_allclose(places[0], [-0.24, -0.13, 0.4], atol=1e-12)
    np.testing.assert_allclose(places[-1], [0.24, 0.13, 0.4], atol=1e-12)
    steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
    np.testing.assert_allclose(steps, [0.24, 0.24, 0.13, 0.24, 0.24, 0.13, 0.24, 0.24])


@pytest.mark.parametrize(
    ("look", "forward", "top"),
    [
        ("down", (0, 0, -1), (0, 1, 0)),
        ("up", (0, 0, 1), (0, 1, 0)),
        ("forward", (1, 0, 0), (0, 0, 1)),
        ("backward", (-1, 0, 0), (0, 0, 1)),
        ("left", (0, 1, 0), (0, 0, 1)),
        ("right", (0, -1, 0), (0, 0, 1)),
    ],
)
def test_all_look_straight_at_the_plane_upright(look, forward, top):
    rig = gantry_rig(
        0.8, 0.5, 0.4, rows=2, columns=2, look=look, centre=(1, 2, 3), intrinsics=IMAGE
    )
    for camera in rig.cameras:
        x, y, z = reference.camera_axes(camera)
        np.testing.assert_allclose(z, forward, atol=1e-15)
        np.testing.assert_allclose(y, np.negative(top), atol=1e-15)
        np.testing.assert_allclose(np.cross(y, z), x, atol=1e-15)
        assert np.dot(np.subtract((1, 2, 3), camera.position), z) == pytest.approx(0.4)
    x, y, _ = reference.camera_axes(rig.cameras[0])
    first, second, third, _ = camera_positions(rig)
    np.testing.assert_allclose(second - first, 0.48 * x, atol=1e-12)
    np.testing.assert_allclose(third - second, -0.26 * y, atol=1e-12)


def test_of_a_camera_only_what_it_reads_out_counts():
    cropped = CameraIntrinsics(400, 300, 500.0, 500.0, 190.0, 149.5, region=(100, 0, 200, 300))
    rig = gantry_rig(1.0, 0.2, 0.4, 0.0, intrinsics=cropped)
    corners = np.array([shown(camera, 0.4) for camera in rig.cameras])
    assert len(rig) == math.ceil(1.0 / (0.32 / 2))
    np.testing.assert_allclose(corners[..., 0].min(), -0.5, atol=1e-12)
    np.testing.assert_allclose(corners[..., 0].max(), 0.5, atol=1e-12)


def test_what_one_picture_shows_takes_one():
    rig = gantry_rig(0.3, 0.2, 0.4, 0.9, intrinsics=IMAGE, lens=Lens(0.1, 20.0), frame_id="table")
    assert len(rig) == 1
    np.testing.assert_allclose(rig.cameras[0].position, [0, 0, 0.4], atol=1e-12)
    assert (rig.frame_id, rig.cameras[0].lens) == ("table", Lens(0.1, 20.0))
    # Exactly as large as a picture, despite rounding.
    assert len(gantry_rig(WIDE, TALL, 0.4, 0.5, intrinsics=IMAGE)) == 1
    for more in range(1, 40):
        width = WIDE + more * (1 - 0.3) * WIDE
        assert len(gantry_rig(width, TALL, 0.4, 0.3, intrinsics=IMAGE)) == 1 + more


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"width": 0}, "width: expected a number above 0, got 0"),
        ({"distance": 400}, "distance: expected metres, .* write 0.4"),
        ({"overlap": 1}, "overlap: expected a share of at least 0, below 1, got 1"),
        ({"overlap": -0.1}, "overlap: expected a number of at least 0, got -0.1"),
        ({"columns": 0}, "columns: expected a whole number of at least 1"),
        ({"rows": 2.5}, "rows: expected a whole number"),
        ({"width": 0.1, "columns": 2}, "columns: expected 1 for the 0.1 m of the rectangle, got 2"),
        ({"overlap": 1 - 1e-12}, "columns: expected at most 250000, got .* for this overlap"),
        ({"columns": 5000, "rows": 5000}, "rows × columns: expected at most 250000"),
        ({"look": "Down"}, "look: expected one of down, up, forward"),
        ({"centre": (0, 0)}, r"centre: expected .*\(3\)"),
        ({"centre": (0, 0, math.nan)}, "centre"),
    ],
)
def test_impossible_gantries_are_refused(values, message):
    with pytest.raises(InputError, match=message):
        gantry_rig(**values)
