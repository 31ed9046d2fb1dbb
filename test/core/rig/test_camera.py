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

import numpy as np
import pytest

from focus_planner import (
    CameraIntrinsics,
    CostModel,
    InputError,
    Lens,
)
from testing.problems import camera


def test_the_defaults_are_the_papers():
    lens, intrinsics, model = Lens(), CameraIntrinsics(), CostModel()
    assert (lens.focal_length, lens.hyperfocal_distance) == (0.05, 10.0)
    assert (lens.min_focus, lens.max_focus) == (0.0, math.inf)
    assert (intrinsics.width, intrinsics.height) == (580, 870)
    assert (intrinsics.fx, intrinsics.fy, intrinsics.cx, intrinsics.cy) == (
        1190.732,
        1190.732,
        284.813,
        434.440,
    )
    assert model == CostModel(1 / 3, 1 / 3, 1 / 3, 1.0, 0.75)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"width": 0}, "image.width: expected a whole number of at least 1, got 0"),
        ({"height": 8.5}, "image.height: expected a whole number of at least 1, got 8.5"),
        ({"fx": 0}, "image.fx: expected a number above 0, got 0"),
        ({"fy": -1.0}, "image.fy: expected a number above 0, got -1"),
        ({"cx": math.nan}, "image.cx: expected a number, got nan"),
        ({"cy": "x"}, "image.cy: expected a number, got 'x'"),
        (
            {"distortion_model": "fisheye", "distortion": (0.1,)},
            "image.distortion_model: expected one of .*, got 'fisheye'; for rectified images leave",
        ),
        ({"distortion_model": "fisheye"}, "image.distortion_model: expected one of plumb_bob"),
        ({"distortion": (0.1,) * 5}, "image.distortion_model: expected one of .*, got ''"),
        (
            {"distortion_model": "plumb_bob", "distortion": (0.1,) * 8},
            "image.distortion: expected 4 or 5 coefficients of the model plumb_bob, got 8",
        ),
        (
            {"distortion_model": "rational_polynomial", "distortion": (0.1,) * 5},
            "image.distortion: expected 8 or 12 or 14 coefficients of the model rational_p.*got 5",
        ),
        (
            {"distortion_model": "equidistant"},
            "image.distortion: expected 4 coefficients of the model equidistant, got 0",
        ),
        (
            {"distortion_model": "rational_polynomial", "distortion": (0.1,) * 14},
            "image.distortion: expected 0 for the last two of 14 .*, got 0.1 and 0.1; calibrat",
        ),
        (
            {"distortion_model": "plumb_bob", "distortion": (0.1, math.nan, 0, 0)},
            r"image.distortion\[1\]: expected a number, got nan",
        ),
        (
            {"distortion_model": "plumb_bob", "distortion": (0.1, -1e40, 0, 0)},
            r"image.distortion: expected coefficients up to 1e\+30, got -1e\+40",
        ),
        ({"distortion": 0.1}, "image.distortion: expected a list of coefficients, got 0.1"),
        ({"distortion": "0.1"}, "image.distortion: expected a list of coefficients, got '0.1'"),
        ({"binning": (2,)}, "image.binning: expected columns and rows per bin, got 1 numbers"),
        ({"binning": 2}, "image.binning: expected columns and rows per bin, got 2"),
        ({"binning": (0, 1)}, r"image.binning\[0\]: expected a whole number of at least 1, got 0"),
        ({"binning": (581, 1)}, "image.binning: expected at most 580 × 870, .*, got 581 × 1"),
        (
            {"binning": (8, 1), "region": (0, 0, 7, 9)},
            "image.binning: expected at most 7 × 9, the size of the region, got 8 × 1",
        ),
        ({"region": (0, 0, 7)}, "image.region: expected x_offset, .*height, got 3 numbers"),
        ({"region": (-1, 0, 7, 7)}, r"image.region\[0\]: expected a whole number of at least 0"),
        ({"region": (0, 0, 7, 0)}, r"image.region\[3\]: expected a whole number of at least 1"),
        ({"region": (0, 0.5, 7, 1)}, r"image.region\[1\]: expected a whole number .*, got 0.5"),
        (
            {"region": (80, 0, 501, 9)},
            r"image.region: expected .* 580 × 870 pixels, got 501 × 9 at \(80, 0\); offsets and",
        ),
    ],
)
def test_images_that_cannot_be(values, message):
    with pytest.raises(InputError, match=message):
        CameraIntrinsics(**values)


def test_polynomials_without_coefficients_are_a_pinhole():
    for model, count in (("plumb_bob", 5), ("plumb_bob", 0), ("rational_polynomial", 8), ("", 3)):
        assert (
            CameraIntrinsics(distortion_model=model, distortion=[0] * count) == CameraIntrinsics()
        )
    fisheye = CameraIntrinsics(distortion_model="equidistant", distortion=[0, 0, 0, 0])
    assert fisheye != CameraIntrinsics()
    assert fisheye.distortion == (0.0, 0.0, 0.0, 0.0)


def test_an_image_is_a_plain_record_whatever_it_was_made_of():
    intrinsics = CameraIntrinsics(
        distortion_model="plumb_bob",
        distortion=np.array([0.25, 0, 0, 0]),
        binning=[2, np.int64(3)],
        region=[1, 2, 5, 10],
    )
    assert (intrinsics.distortion, intrinsics.binning) == ((0.25, 0.0, 0.0, 0.0), (2, 3))
    assert {type(number) for number in intrinsics.distortion} == {float}
    assert {type(number) for number in (*intrinsics.binning, *intrinsics.region)} == {int}
    assert hash(intrinsics) == hash(dataclasses.replace(intrinsics))


def test_pixels_read_are_whole_bins_of_the_region():
    assert CameraIntrinsics().pixels_read == (0, 0, 580, 870)
    assert CameraIntrinsics(region=(0, 0, 580, 870)) == CameraIntrinsics()
    assert CameraIntrinsics(region=(3, 4, 11, 13)).pixels_read == (3, 4, 11, 13)
    assert CameraIntrinsics(region=(3, 4, 11, 13), binning=(2, 5)).pixels_read == (3, 4, 10, 10)
    assert CameraIntrinsics(binning=(300, 870)).pixels_read == (0, 0, 300, 870)


def test_a_camera_normalises_its_quaternion():
    almost = camera(orientation=(0.5, 0.5, -0.5, 0.5004))
    assert math.isclose(sum(q * q for q in almost.orientation), 1.0, rel_tol=1e-15)
    assert camera(position=np.array([1, 2, 3])).position == (1.0, 2.0, 3.0)
    assert all(type(x) is float for x in (*almost.orientation, *almost.position))


@pytest.mark.parametrize(
    ("name", "proposed"),
    [
        ("", "cam_1"),
        ("1a", "cam_1a"),
        ("_a", "a"),
        ("a-b", "a_b"),
        ("Kamera (1)", "Kamera_1"),
        ("ä", "a"),
        ("a\n", "a"),
        (3, "cam_3"),
        (None, None),
        (True, None),
    ],
)
def test_names_that_are_no_topic(name, proposed):
    telling = "camera name: expected letters, digits and underscores"
    with pytest.raises(InputError, match=telling) as caught:
        camera(name)
    assert caught.value.remedy == ("" if proposed is None else f"name it {proposed}")


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"position": (0, 0)}, r"camera a: position: expected shape \(3\), got shape \(2,\)"),
        ({"position": (0, 0, math.nan)}, "camera a: position: expected finite coordinates"),
        ({"position": "abc"}, "camera a: position: expected numbers"),
        ({"orientation": (0, 0, 1)}, r"camera a: orientation: expected shape \(4\)"),
        (
            {"orientation": (0, 0, 0, 0)},
            (
                "camera a: orientation: expected a unit quaternion x, y, z, w, got .* of norm 0; "
                "the pose was probably never set"
            ),
        ),
        ({"orientation": (0, 0, 0, 1.01)}, "of norm 1.01"),
        ({"orientation": (0, 0, 0, math.nan)}, "of norm nan"),
        ({"orientation": (math.nan, 0, 0, 1e300)}, "of norm inf"),
        ({"orientation": (0.0, 0.0, 0.0, 1e308)}, "of norm inf"),
    ],
)
def test_poses_that_cannot_be(values, message):
    with pytest.raises(InputError, match=message):
        camera(**values)
