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
from dataclasses import replace

import numpy as np
import pytest

from focus_planner import Camera, CameraIntrinsics, InputError, Lens
from focus_planner.core.imaging.blur import blur_diameters
from focus_planner.core.rig.optics import (
    aperture_diameter,
    circle_of_confusion,
    depth_of_field,
    hyperfocal_distance,
)

CIRCLE = 20e-6
LENS = Lens(0.05, hyperfocal_distance(0.05, 4.0, CIRCLE), circle_of_confusion=CIRCLE)
CAMERA = Camera("cam", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), CameraIntrinsics(), LENS)


def test_the_aperture_is_the_focal_length_over_the_f_number():
    assert aperture_diameter(CAMERA) == pytest.approx(0.05 / 4, rel=1e-12)


def test_blur_is_that_of_the_textbook_on_the_sensor():
    s, f = 2.0, LENS.focal_length
    depths = np.array([0.5, 1.0, 1.9, 2.0, 2.3, 7.0, 1e15])
    pitch = (s * f / (s - f)) / CAMERA.intrinsics.fx
    expected = (f / 4) * f * np.abs(depths - s) / (depths * (s - f)) / pitch
    np.testing.assert_allclose(blur_diameters(depths, CAMERA, s), expected, rtol=1e-12)
    assert blur_diameters(np.array([np.inf]), CAMERA, s) == pytest.approx(expected[-1:])


@pytest.mark.parametrize("s", [0.4, 2.0, 20.0])
def test_the_circle_of_confusion_is_reached_at_the_limits_of_the_depth_of_field(s):
    pitch = (s * 0.05 / (s - 0.05)) / CAMERA.intrinsics.fx
    limits = np.concatenate(depth_of_field(np.array([s]), LENS))
    np.testing.assert_allclose(blur_diameters(limits, CAMERA, s), CIRCLE / pitch, rtol=1e-9)


def test_blur_is_in_pixels_as_they_are_read_out():
    binned = replace(CAMERA, intrinsics=replace(CAMERA.intrinsics, binning=(2, 2)))
    full, half = (blur_diameters(np.array([1.0]), camera, 2.0) for camera in (CAMERA, binned))
    assert half == pytest.approx(full / 2)
    assert blur_diameters(np.array([1.0]), CAMERA, 2.0, scale=0.5) == pytest.approx(full / 2)


def test_without_a_circle_of_confusion_the_customary_one_is_assumed():
    camera = replace(CAMERA, lens=replace(LENS, circle_of_confusion=None))
    diagonal = 0.05 * math.hypot(580, 870) / 1190.732
    assert circle_of_confusion(camera) == pytest.approx(diagonal / 1500)
    assert circle_of_confusion(CAMERA) == CIRCLE


@pytest.mark.parametrize("circle", [0.0, -1e-5, math.nan, math.inf, 1e-13, 1e13, "x"])
def test_circles_of_confusion_that_no_lens_has_are_refused(circle):
    with pytest.raises(InputError, match=r"lens\.circle_of_confusion: expected"):
        Lens(circle_of_confusion=circle)
