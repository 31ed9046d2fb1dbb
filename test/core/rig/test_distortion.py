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

import cv2
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from focus_planner import CameraIntrinsics
from focus_planner.core import kernels
from focus_planner.core.rig.distortion import corner_rays, frustum_and_projection
from testing import reference
from testing.intrinsics import varied
from testing.problems import WIDE_ANGLE

KINDS = {
    "plumb_bob, 4": ("plumb_bob", (-0.28, 0.09, 1e-3, -7e-4)),
    "plumb_bob, 5": ("plumb_bob", (0.15, -0.09, 1e-3, -7e-4, 0.02)),
    "rational, 8": ("rational_polynomial", (0.3, -0.1, 1e-3, -7e-4, 0.02, 0.4, 0.05, -0.01)),
    "rational, 12": (
        "rational_polynomial",
        (0.3, -0.1, 1e-3, -7e-4, 0.02, 0.4, 0.05, -0.01, 2e-3, -1e-3, 3e-3, 5e-4),
    ),
    "rational, 14": (
        "rational_polynomial",
        (0.3, -0.1, 0.0, -7e-4, 0.02, 0.4, 0.0, -0.01, 2e-3, -1e-3, 3e-3, 5e-4, 0.0, 0.0),
    ),
    "equidistant": ("equidistant", (-0.02, 0.01, -0.005, 0.001)),
    "equidistant, ideal": ("equidistant", (0.0, 0.0, 0.0, 0.0)),
}
kinds = pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS.keys())


def image_of(model, *distortion, **values):
    return replace(WIDE_ANGLE, distortion_model=model, distortion=distortion, **values)


def projection(intrinsics):
    return frustum_and_projection(intrinsics)[1]


def by_kernel(intrinsics, points):
    """Pixel coordinates of (n, 2) points at depth 1."""
    row = projection(intrinsics)
    k = np.array(row[kernels.PROJECTION :])
    places = np.array([kernels.distort(x, y, row[0], k) for x, y in points.tolist()])
    return places * [intrinsics.fx, intrinsics.fy] + [intrinsics.cx, intrinsics.cy]


def by_opencv(intrinsics, points):
    matrix = np.array(
        [[intrinsics.fx, 0, intrinsics.cx], [0, intrinsics.fy, intrinsics.cy], [0, 0, 1]]
    )
    k, none = np.array(intrinsics.distortion), np.zeros(3)
    before = np.column_stack([points, np.ones(len(points))])[:, None]
    project = cv2.fisheye if intrinsics.distortion_model == "equidistant" else cv2
    places, _ = project.projectPoints(before, none, none, matrix, k)
    return places[:, 0]


@kinds
def test_images_lie_where_opencv_and_its_manual_have_them(kind):
    intrinsics = image_of(kind[0], *kind[1])
    points = np.random.default_rng(1).normal(scale=0.5, size=(300, 2))
    places = by_kernel(intrinsics, points)
    np.testing.assert_allclose(places, by_opencv(intrinsics, points), rtol=0, atol=1e-9)
    by_hand = np.column_stack(reference.pixels(intrinsics, *points.T))
    np.testing.assert_allclose(places, by_hand, rtol=0, atol=1e-9)


@given(varied(st.just(WIDE_ANGLE)), st.tuples(st.floats(-3, 3), st.floats(-3, 3)))
def test_any_image_of_any_point_lies_where_the_manual_has_it(intrinsics, point):
    assume(intrinsics.distortion_model)
    assume(reference.grows(intrinsics, math.hypot(*point)))
    by_hand = np.array(reference.distorted(intrinsics, *point))
    assume((np.abs(by_hand) < 1e6).all())  # no pole near
    row = projection(intrinsics)
    found = kernels.distort(*point, row[0], np.array(row[kernels.PROJECTION :]))
    np.testing.assert_allclose(found, by_hand, rtol=1e-6, atol=1e-6)


def test_a_pole_is_imaged_nowhere():
    intrinsics = image_of("rational_polynomial", *np.zeros(5), -0.25, 0.0, 0.0)
    assert math.isinf(by_kernel(intrinsics, np.array([[2.0, 2e-300]]))[0, 0])


def test_the_axis_is_imaged_at_the_principal_point():
    for model, distortion in KINDS.values():
        intrinsics = image_of(model, *distortion)
        np.testing.assert_array_equal(
            by_kernel(intrinsics, np.zeros((1, 2))), [[intrinsics.cx, intrinsics.cy]]
        )


# --- how far off the axis a camera sees ------------------------------------------------------


@pytest.mark.parametrize(
    ("model", "distortion", "reach"),
    [
        ("plumb_bob", (-1 / 3, 0, 0, 0), 1.0),  # r − r³/3
        ("plumb_bob", (0, -1 / 5, 0, 0), 1.0),  # r − r⁵/5
        ("plumb_bob", (0, 0, 0, 0, -1 / 7), 1.0),
        ("plumb_bob", (0.1, 0, 0, 0), math.inf),
        ("plumb_bob", (0, 0, 3e-3, -4e-3), 1 / (6 * 5e-3)),  # r − 3 |p| r²
        ("rational_polynomial", (0, 0, 0, 0, 0, 1.0, 0, 0), 1.0),  # r / (1 + r²)
        ("rational_polynomial", (0, 0, 0, 0, 0, -0.25, 0, 0), 2.0),  # a pole
        ("rational_polynomial", (0.1, 0, 0, 0, 0, 0.1, 0, 0), math.inf),  # r
        ("rational_polynomial", (0,) * 8 + (0.03, 0, 0.04, 0), 10.0),  # r − 0.05 r²
        ("rational_polynomial", (0,) * 8 + (0, 0.002, 0, 0), 5.0),  # r − 0.002 r⁴
        ("equidistant", (0, 0, 0, 0), math.inf),
        ("equidistant", (-1 / 3, 0, 0, 0), math.tan(1.0)),
        ("equidistant", (0, 0, 0, -1 / 9), math.tan(1.0)),
        ("equidistant", (-0.1, 0, 0, 0), math.inf),  # 104.6°, which lies behind
    ],
)
def test_the_reach_ends_where_the_image_folds_back(model, distortion, reach):
    assert projection(image_of(model, *distortion))[1] == pytest.approx(reach, rel=1e-9)


@given(varied(st.just(WIDE_ANGLE)))
def test_the_reach_of_any_image_is_where_it_stops_growing(intrinsics):
    assume(intrinsics.distortion_model)
    reach = projection(intrinsics)[1]
    assert reference.grows(intrinsics, min(reach * (1 - 1e-6), 1e3))
    if reach < 1e3:
        assert not reference.grows(intrinsics, 1.05 * reach, steps=20_000)


@given(st.lists(st.floats(-1e30, 1e30), min_size=12, max_size=12))
def test_coefficients_of_no_lens_have_a_reach_and_a_frustum(distortion):
    for model, count in (("rational_polynomial", 12), ("equidistant", 4)):
        intrinsics = image_of(model, *distortion[:count])
        if intrinsics.distortion_model:
            assert projection(intrinsics)[1] > 0
            assert np.isfinite(frustum_and_projection(intrinsics)[0]).all()


# --- what the frustum holds ------------------------------------------------------------------


def seen(intrinsics, reach):
    """Points at depth 1 all over the frustum_and_projection that the image shows, (n, 2)."""
    angles = np.linspace(0, math.atan(min(reach, 1e4)), 300, endpoint=False)
    around = np.linspace(0, 2 * np.pi, 360)
    x = np.outer(np.tan(angles), np.cos(around)).ravel()
    y = np.outer(np.tan(angles), np.sin(around)).ravel()
    inside = reference.is_read(intrinsics, *reference.pixels(intrinsics, x, y))
    return np.column_stack([x, y])[inside]


def box(intrinsics):
    """The least and the greatest x, y at depth 1 that the frustum holds."""
    fx, fy, cx, cy, width, height = frustum_and_projection(intrinsics)[0]
    low = np.array([(-0.5 - cx) / fx, (-0.5 - cy) / fy])
    return low, low + np.array([width / fx, height / fy])


@settings(max_examples=40)
@given(
    varied(
        st.sampled_from([WIDE_ANGLE, replace(WIDE_ANGLE, cx=-50.0, cy=700.0), CameraIntrinsics()])
    )
)
def test_the_frustum_holds_all_that_the_image_shows(intrinsics):
    assume(intrinsics.distortion_model)
    points = seen(intrinsics, projection(intrinsics)[1])
    low, high = box(intrinsics)
    assert (points > low).all()
    assert (points < high).all()


@kinds
@pytest.mark.parametrize("region", [None, (0, 0, 320, 480), (400, 50, 100, 80)])
def test_the_frustum_holds_little_else(kind, region):
    intrinsics = image_of(kind[0], *kind[1], region=region)
    points = seen(intrinsics, projection(intrinsics)[1])
    low, high = box(intrinsics)
    slack = 0.15 * np.abs(points).max()
    np.testing.assert_allclose(low, points.min(axis=0), rtol=0, atol=slack)
    np.testing.assert_allclose(high, points.max(axis=0), rtol=0, atol=slack)


def test_a_fisheye_of_180_degrees_has_all_before_it_in_its_frustum():
    intrinsics = image_of("equidistant", 0.0, 0.0, 0.0, 0.0, fx=100.0, fy=100.0)
    low, high = box(intrinsics)
    assert (low < -1e50).all()
    assert (high > 1e50).all()


# --- corners ---------------------------------------------------------------------------------


@kinds
def test_corners_are_imaged_at_the_corners(kind):
    intrinsics = image_of(kind[0], *kind[1], region=(120, 60, 401, 301), binning=(2, 2))
    corners = [[119.5, 59.5], [519.5, 59.5], [519.5, 359.5], [119.5, 359.5]]
    places = by_opencv(intrinsics, np.array(corner_rays(intrinsics)))
    np.testing.assert_allclose(places, corners, rtol=0, atol=1e-5)


def test_corners_that_show_nothing_are_as_far_off_as_can_be_seen():
    folded = image_of("plumb_bob", -1 / 3, 0.0, 0.0, 0.0)
    np.testing.assert_allclose(np.linalg.norm(corner_rays(folded), axis=1), 1.0, rtol=1e-6)
    whole = image_of("equidistant", 0.0, 0.0, 0.0, 0.0, fx=100.0, fy=100.0)
    rays = np.array(corner_rays(whole))
    np.testing.assert_allclose(np.linalg.norm(rays, axis=1), math.tan(math.radians(85)), rtol=1e-6)
    assert (np.sign(rays) == [[-1, -1], [1, -1], [1, 1], [-1, 1]]).all()
