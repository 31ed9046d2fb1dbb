# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

import dataclasses
import math

import pytest

from focus_planner import Lens, cylinder_rig, dome_rig, turntable_rig
from focus_planner.core.rig.geometry import camera_positions
from focus_planner.core.validation import InputError
from focus_planner.evaluation.measuring.cylinders import aspect_ratio, cylinder_like


def test_the_aspect_ratio_is_that_of_distances_on_the_cylinder():
    positions = camera_positions(cylinder_rig(7, 24))
    upward = positions[24, 2] - positions[0, 2]
    angle = 2 * math.pi / 24
    assert aspect_ratio(7, 24) == pytest.approx(upward / (0.75 * angle))
    assert aspect_ratio(2, 12, 1.0, 1.0) == pytest.approx(12 / (2 * math.pi))


def test_another_grid_has_the_same_cameras_on_the_same_cylinder():
    lens = Lens(0.035, 6.0)
    rig = cylinder_rig(3, 8, 0.9, 0.2, 1.1, lens=lens, frame_id="studio")
    other, ratio = cylinder_like(rig, 5, 12)
    assert other == cylinder_rig(5, 12, 0.9, 0.2, 1.1, lens=lens, frame_id="studio")
    assert ratio == pytest.approx(0.225 / (2 * math.pi * 0.9 / 12))


def test_a_cylinder_that_was_rounded_is_still_one():
    rig = cylinder_rig(3, 8)
    cameras = [
        dataclasses.replace(camera, position=tuple(round(x, 4) for x in camera.position))
        for camera in rig.cameras
    ]
    assert cameras[1].position != rig.cameras[1].position
    other, _ = cylinder_like(dataclasses.replace(rig, cameras=tuple(cameras)), 4, 6)
    assert other == cylinder_rig(4, 6)


def without_grid(rig):
    return dataclasses.replace(rig, grid=None)


def with_another_lens(rig):
    first = dataclasses.replace(rig.cameras[0], lens=Lens(0.035, 6.0))
    return dataclasses.replace(rig, cameras=(first, *rig.cameras[1:]))


@pytest.mark.parametrize(
    "rig",
    [
        dome_rig(),
        turntable_rig(),
        without_grid(cylinder_rig()),
        with_another_lens(cylinder_rig()),
        cylinder_rig(1, 12),
    ],
    ids=["dome", "turntable", "no grid", "lenses", "one row"],
)
def test_other_rigs_are_refused_with_what_to_do(rig):
    with pytest.raises(InputError, match=r"rig: expected a cylinder .* leave out the experiment"):
        cylinder_like(rig, 4, 15)
