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

from focus_planner import InputError, Lens, path_rig
from focus_planner.core.rig.geometry import camera_positions, camera_rotations
from focus_planner.core.rig.walk import walking_order
from testing import reference

FORWARD = (0.5, -0.5, 0.5, -0.5)  # looks along +x, upright


def about_z(angle):
    """Return the optical frame that looks horizontally at an angle from +x, as a quaternion."""
    c, s = math.cos(angle / 2), math.sin(angle / 2)
    x, y, z, w = FORWARD
    return (c * x - s * y, c * y + s * x, c * z + s * w, c * w - s * z)


def axes(rig):
    return [reference.camera_axes(camera) for camera in rig.cameras]


def test_poses_are_taken_as_they_are():
    positions = [(0, 0, 1), (1, 0, 1), (1, 2, 1)]
    turns = [about_z(angle) for angle in (0, 0.5, 2.0)]
    rig = path_rig(positions, turns, names=("a", "b", "c"), lens=Lens(0.1, 20), frame_id="arm")
    assert [camera.name for camera in rig.cameras] == ["a", "b", "c"]
    np.testing.assert_array_equal(camera_positions(rig), positions)
    np.testing.assert_allclose([c.orientation for c in rig.cameras], turns, atol=1e-15)
    assert (rig.frame_id, rig.cameras[0].lens) == ("arm", Lens(0.1, 20))
    assert rig.sequence
    assert walking_order(rig).tolist() == [0, 1, 2]
    assert [c.name for c in path_rig(positions, turns).cameras] == ["cam_00", "cam_01", "cam_02"]


def test_steps_are_equal_along_the_path():
    # Legs of 3, 0, 1 and 2 m: six pictures are 1.2 m apart.
    corners = np.array([(0, 0, 0), (3, 0, 0), (3, 0, 0), (3, 1, 0), (3, 1, 2)], float)
    rig = path_rig(corners, targets=(10, 0, 0), steps=6)
    expected = [(0, 0, 0), (1.2, 0, 0), (2.4, 0, 0), (3, 0.6, 0), (3, 1, 0.8), (3, 1, 2)]
    np.testing.assert_allclose(camera_positions(rig), expected, atol=1e-14)
    # One alone is halfway; steps may be fewer or more than the poses.
    one = path_rig(corners, targets=(10, 0, 0), steps=1)
    np.testing.assert_allclose(camera_positions(one), [(3, 0, 0)], atol=1e-14)
    many = camera_positions(path_rig(corners[:2], targets=(10, 0, 0), steps=101))
    np.testing.assert_allclose(many[:, 0], np.linspace(0, 3, 101), atol=1e-14)


def test_a_closed_path_has_no_picture_twice():
    square = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    rig = path_rig(square, targets=(0.5, 0.5, 0), steps=8, closed=True)
    expected = [(0, 0), (0.5, 0), (1, 0), (1, 0.5), (1, 1), (0.5, 1), (0, 1), (0, 0.5)]
    np.testing.assert_allclose(camera_positions(rig)[:, :2], expected, atol=1e-14)


def test_a_fine_circle_gives_equal_angles():
    angles = np.linspace(0, 2 * math.pi, 2000, endpoint=False)
    circle = np.stack([0.6 * np.cos(angles), 0.6 * np.sin(angles), 0 * angles + 0.3], 1)
    rig = path_rig(circle, targets=(0, 0, 0.3), steps=48, closed=True)
    found = np.unwrap(np.arctan2(*camera_positions(rig)[:, 1::-1].T))
    np.testing.assert_allclose(found, 2 * math.pi * np.arange(48) / 48, atol=1e-5)
    for camera, (x, y, z) in zip(rig.cameras, axes(rig), strict=True):
        inward = np.subtract((0, 0, 0.3), camera.position)
        np.testing.assert_allclose(z, inward / np.linalg.norm(inward), atol=1e-14)
        np.testing.assert_allclose(y, (0, 0, -1), atol=1e-14)
        np.testing.assert_allclose(x, np.cross(y, z), atol=1e-14)


def test_between_poses_the_camera_turns_the_short_way_at_constant_speed():
    rig = path_rig([(0, 0, 0), (1, 0, 0)], [about_z(0), np.negative(about_z(1.2))], steps=5)
    for k, (_, y, z) in enumerate(axes(rig)):
        angle = 1.2 * k / 4
        np.testing.assert_allclose(z, (math.cos(angle), math.sin(angle), 0), atol=1e-14)
        np.testing.assert_allclose(y, (0, 0, -1), atol=1e-14)


def test_what_is_looked_at_moves_along():
    rig = path_rig([(0, 0, 0), (4, 0, 0)], targets=[(0, 2, 0), (4, 6, 0)], steps=3)
    for camera, target in zip(rig.cameras, [(0, 2, 0), (2, 4, 0), (4, 6, 0)], strict=True):
        _, _, z = reference.camera_axes(camera)
        towards = np.subtract(target, camera.position)
        np.testing.assert_allclose(z, towards / np.linalg.norm(towards), atol=1e-15)


@pytest.mark.parametrize("direction", [(0, 0, -2), (0, 0, 3), (1e-9, 0, -1)])
def test_straight_down_and_up_have_a_top_as_well(direction):
    rig = path_rig([(1, 1, 1)], targets=np.add((1, 1, 1), direction))
    ((x, y, z),) = axes(rig)
    np.testing.assert_allclose(z, direction / np.linalg.norm(direction), atol=1e-15)
    np.testing.assert_allclose(y, (0, -1, 0), atol=1e-8)
    np.testing.assert_allclose(x, np.cross(y, z), atol=1e-14)


def test_orientations_are_rotations_whatever_they_look_at():
    random = np.random.default_rng(3)
    rig = path_rig(random.normal(size=(200, 3)), targets=random.normal(size=(200, 3)))
    turns = camera_rotations(rig)
    np.testing.assert_allclose(
        turns.transpose(0, 2, 1) @ turns, np.tile(np.eye(3), (200, 1, 1)), atol=1e-14
    )
    np.testing.assert_allclose(np.linalg.det(turns), 1)
    assert np.abs(turns[:, 2, 0]).max() < 1e-14  # x is horizontal
    assert turns[:, 2, 1].max() < 0  # y points down


LINE = [(0, 0, 0), (1, 0, 0)]


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({}, "path: expected either orientations or targets, got neither"),
        ({"orientations": [FORWARD] * 2, "targets": (0, 0, 9)}, "targets, got both"),
        ({"orientations": [FORWARD]}, "orientations: expected 2, one for each position, got 1"),
        ({"orientations": [FORWARD, (0, 0, 0, 2)]}, r"orientations\[1\]: .* of norm 2"),
        ({"targets": [(0, 0, 9)] * 3}, "targets: expected one point, or 2, .* got 3"),
        ({"targets": (0, 0, math.nan)}, "targets"),
        ({"targets": (0, 0, 1e300)}, r"targets: expected coordinates up to 1e\+08 m, got 1e\+300"),
        ({"targets": (0, 0)}, r"targets: .*\(n, 3\)"),
        ({"targets": (1, 0, 0)}, "pose 2: expected a point elsewhere to look at, got its own pos"),
        ({"targets": (0, 0, 9), "steps": -1}, "steps: expected a whole number of at least 0"),
        ({"targets": (0, 0, 9), "names": ["a"]}, "names: expected 2, one for each position, got 1"),
        (
            {"positions": [(0, 0, 0)] * 2, "targets": (0, 0, 9), "steps": 4},
            "steps: expected 0, for a path without length, got 4",
        ),
        ({"positions": [], "targets": (0, 0, 9)}, "positions"),
        ({"positions": [(0, math.inf, 0)], "targets": (0, 0, 9)}, "positions"),
    ],
)
def test_impossible_paths_are_refused(values, message):
    with pytest.raises(InputError, match=message):
        path_rig(**{"positions": LINE} | values)
