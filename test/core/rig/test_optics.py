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
from hypothesis import assume, given
from hypothesis import strategies as st

from focus_planner import (
    InputError,
    Lens,
    LensTable,
    depth_of_field,
    distance_from_sensor,
    focus_interval,
    hyperfocal_distance,
)
from focus_planner.core.rig.optics import nearest_settable
from testing import reference

PAPER = Lens(focal_length=0.05, hyperfocal_distance=10.0)


@st.composite
def lenses(draw, *, limits=False):
    focal_length = draw(st.floats(0.004, 0.4))
    h = focal_length * draw(st.floats(1.5, 2000))
    low, high = 0.0, math.inf
    if limits:
        low = focal_length * draw(st.floats(0, 50))
        high = max(low, 2 * focal_length) * draw(st.floats(1.01, 50))
    return Lens(focal_length, h, low, high)


def interval(depth, lens):
    near, far = focus_interval(np.array([depth]), lens)
    return float(near[0]), float(far[0])


def test_the_papers_lens():
    near, far = depth_of_field(np.array([0.75]), PAPER)
    # By hand from D_N and D_F of Sec. 4.2: 7.5 / 10.7 and 7.5 / 9.3.
    assert near[0] == pytest.approx(7.5 / 10.7, rel=1e-15)
    assert far[0] == pytest.approx(7.5 / 9.3, rel=1e-15)
    assert interval(0.75, PAPER) == pytest.approx((0.75 * 10.05 / 10.75, 0.75 * 9.95 / 9.25))


@given(lenses(), st.floats(1.01, 1e5))
def test_depth_of_field_is_the_references(lens, ratio):
    s = lens.focal_length * ratio
    near, far = depth_of_field(np.array([s]), lens)
    assert (near[0], far[0]) == pytest.approx(reference.depth_of_field(s, lens), rel=1e-12)


@given(lenses(), st.floats(1.01, 1e4), st.floats(1.01, 1e4))
def test_a_focus_distance_is_in_the_interval_just_if_the_depth_is_in_its_field(
    lens, depth_ratio, s_ratio
):
    depth, s = lens.focal_length * depth_ratio, lens.focal_length * s_ratio
    near, far = interval(depth, lens)
    # The two agree up to rounding at the ends.
    for end in (near, far):
        assume(not math.isclose(s, end, rel_tol=1e-9))
    assert (near <= s <= far) == reference.in_focus(depth, s, lens)


@given(lenses(), st.floats(1.01, 1e4))
def test_the_ends_of_the_interval_put_the_depth_on_a_limit(lens, ratio):
    depth = lens.focal_length * ratio
    near, far = interval(depth, lens)
    if not math.isclose(depth, lens.hyperfocal_distance, rel_tol=1e-6):
        assert reference.depth_of_field(near, lens)[1] == pytest.approx(depth, rel=1e-6)
    if far < math.inf and depth < 0.99 * lens.hyperfocal_distance:
        assert reference.depth_of_field(far, lens)[0] == pytest.approx(depth, rel=1e-9)
    assert near <= depth <= far


@given(lenses(), st.floats(1.0, 1e3))
def test_from_the_hyperfocal_distance_on_there_is_no_farthest(lens, factor):
    assert interval(lens.hyperfocal_distance * factor, lens)[1] == math.inf
    assert interval(lens.hyperfocal_distance * 0.999999, lens)[1] < math.inf


@given(lenses(limits=True), st.floats(1.01, 1e4))
def test_what_the_lens_can_be_set_to_cuts_the_interval(lens, ratio):
    depth = lens.focal_length * ratio
    near, far = interval(depth, lens)
    free_near, free_far = interval(depth, Lens(lens.focal_length, lens.hyperfocal_distance))
    cut = max(free_near, lens.min_focus), min(free_far, lens.max_focus)
    assert (near, far) == (cut if cut[0] <= cut[1] else (math.inf, -math.inf))


@st.composite
def listed_lenses(draw):
    plain = draw(lenses())
    ratios = draw(st.lists(st.floats(1.01, 240), min_size=1, max_size=8))
    return dataclasses.replace(plain, focus_distances=[plain.focal_length * r for r in ratios])


@given(listed_lenses(), st.floats(1.01, 1e4), st.floats(0, 0.5))
def test_a_list_cuts_the_interval_to_what_of_it_holds_the_depth(lens, ratio, share):
    depth = lens.focal_length * ratio
    tolerance = share * depth
    near, far = focus_interval(np.array([depth]), lens, tolerance)
    free = focus_interval(
        np.array([depth]), dataclasses.replace(lens, focus_distances=None), tolerance
    )
    for s in lens.focus_distances:
        for end in free:
            assume(not math.isclose(s, end[0], rel_tol=1e-9))
    inside = [s for s in lens.focus_distances if reference.holds(depth, s, lens, tolerance)]
    assert (near[0], far[0]) == ((inside[0], inside[-1]) if inside else (math.inf, -math.inf))


@given(lenses(limits=True), st.floats(1.01, 1e4), st.floats(0, 0.9), st.floats(1.01, 1e4))
def test_a_tolerance_leaves_what_holds_all_depths_within_it(lens, ratio, share, s_ratio):
    depth, s = lens.focal_length * ratio, lens.focal_length * s_ratio
    near, far = focus_interval(np.array([depth]), lens, share * depth)
    assume(lens.min_focus <= s <= lens.max_focus)
    for end in (near[0], far[0]):
        assume(not math.isclose(s, end, rel_tol=1e-9))
    if near[0] > far[0]:  # by a hair, rounding may decide
        front, back = (focus_interval(np.array([depth * (1 + x * share)]), lens) for x in (-1, 1))
        assume(not math.isclose(back[0][0], front[1][0], rel_tol=1e-9))
    assume(not math.isclose(depth * (1 - share), lens.focal_length, rel_tol=1e-9))
    assert (near[0] <= s <= far[0]) == reference.holds(depth, s, lens, share * depth)


def test_a_tolerance_of_nothing_changes_nothing():
    depths = np.linspace(0.04, 12.0, 500)
    for a, b in zip(focus_interval(depths, PAPER), focus_interval(depths, PAPER, 0.0), strict=True):
        np.testing.assert_array_equal(a, b)


def test_the_nearest_that_can_be_set():
    listed = Lens(focus_distances=(2.0, 0.5, 1.0))
    asked = np.array([0.0, 0.6, 0.75, 0.76, 1.4, 1.6, 9.0, np.inf, np.nan])
    expected = [0.5, 0.5, 0.5, 1.0, 1.0, 2.0, 2.0, 2.0, np.nan]
    np.testing.assert_array_equal(nearest_settable(asked, listed), expected)
    np.testing.assert_array_equal(
        nearest_settable(asked, Lens(focus_distances=(0.7,)))[:-1], np.full(8, 0.7)
    )
    limited = Lens(min_focus=0.7, max_focus=1.5)
    np.testing.assert_array_equal(
        nearest_settable(asked, limited), [0.7, 0.7, 0.75, 0.76, 1.4, 1.5, 1.5, 1.5, np.nan]
    )


def test_a_table_cuts_and_its_whole_values_are_a_list():
    table = LensTable("steps", False, (0.7, 1.5), (0, 10))
    limited = Lens(min_focus=0.7, max_focus=1.5)
    depths = np.linspace(0.5, 2.0, 40)
    for a, b in zip(
        focus_interval(depths, Lens(table=table)), focus_interval(depths, limited), strict=True
    ):
        np.testing.assert_array_equal(a, b)
    asked = np.array([0.1, 0.9, 9.0])
    np.testing.assert_array_equal(nearest_settable(asked, Lens(table=table)), [0.7, 0.9, 1.5])
    whole = Lens(table=LensTable("steps", True, (0.7, 1.5), (0, 3)))
    listed = Lens(focus_distances=reference.settable(whole))
    np.testing.assert_allclose(nearest_settable(asked, whole), nearest_settable(asked, listed))
    np.testing.assert_allclose(focus_interval(depths, whole), focus_interval(depths, listed))


def test_a_lens_with_one_distance_holds_what_that_distance_holds():
    fixed = Lens(0.05, 10.0, 0.75, 0.75)
    assert interval(0.75, fixed) == (0.75, 0.75)
    near, far = reference.depth_of_field(0.75, fixed)
    assert interval(near * 0.999, fixed) == (math.inf, -math.inf)
    assert interval(far * 1.001, fixed) == (math.inf, -math.inf)


def test_nothing_within_the_focal_length_can_be_in_focus():
    near, far = focus_interval(np.array([-1.0, 0.0, 0.05, 0.0501]), PAPER)
    np.testing.assert_array_equal(near[:3], np.inf)
    np.testing.assert_array_equal(far[:3], -np.inf)
    assert near[3] <= far[3]


def test_the_far_limit_ends_at_h_plus_f():
    _, far = depth_of_field(np.array([10.04999, 10.05, 10.06, 1e6]), PAPER)
    assert far[0] == pytest.approx(10.0 * 10.04999 / 1e-5, rel=1e-6)
    np.testing.assert_array_equal(far[1:], np.inf)


def test_one_camera_may_be_asked_at_once():
    near, far = depth_of_field(0.75, PAPER)
    assert (float(near), float(far)) == pytest.approx((7.5 / 10.7, 7.5 / 9.3))


def test_hyperfocal_distance():
    # 50 mm at f/8 with 0.03 mm: 2500 / 0.24 mm.
    assert hyperfocal_distance(0.05, 8, 0.03e-3) == pytest.approx(10.4166667)
    # The paper's H of 10 m is its F of 50 mm at f/8.33.
    assert hyperfocal_distance(0.05, 25 / 3, 0.03e-3) == pytest.approx(10.0)


@given(st.floats(0.01, 0.2), st.floats(1, 32), st.floats(5e-6, 5e-5), st.floats(2, 100))
def test_a_thin_lens_blurs_by_the_circle_of_confusion_at_the_limits(f, number, circle, ratio):
    s = f * ratio
    lens = Lens(f, hyperfocal_distance(f, number, circle))
    # Thin lens equation: images at v, the sensor at v_s; similar triangles behind the aperture.
    aperture, v_s = f / number, 1 / (1 / f - 1 / s)
    for limit in depth_of_field(np.array([s]), lens):
        if limit[0] < np.inf:
            v = 1 / (1 / f - 1 / limit[0])
            assert aperture * abs(v - v_s) / v == pytest.approx(circle, rel=1e-4)


@pytest.mark.parametrize(
    ("values", "name"),
    [
        ((0, 8, 3e-5), "focal_length"),
        ((0.05, 0, 3e-5), "f_number"),
        ((0.05, 8, math.nan), "circle_of_confusion"),
    ],
)
def test_lenses_without_a_hyperfocal_distance(values, name):
    with pytest.raises(InputError, match=rf"lens.{name}: expected a number above 0"):
        hyperfocal_distance(*values)


# --- from the sensor ---------------------------------------------------------------------------


def from_sensor(distance, lens):
    return float(distance_from_sensor(np.array([distance]), lens)[0])


def test_the_papers_lens_at_0_39_m_is_57_mm_further_from_the_sensor():
    # v = 0.05 · 0.39 / 0.34, by hand.
    assert from_sensor(0.39, PAPER) == pytest.approx(0.39 + 0.0195 / 0.34, rel=1e-15)
    near, far = depth_of_field(np.array([0.39]), PAPER)
    apart = from_sensor(0.39, PAPER) - 0.39
    assert apart == pytest.approx(0.0574, abs=5e-5)
    assert round(apart / float(far[0] - near[0])) == 2
    # Life size: 2F before the lens and 2F behind it.
    assert from_sensor(0.1, PAPER) == pytest.approx(0.2, rel=1e-15)


@given(lenses(), st.floats(1.001, 1e6), st.floats(-3.9, 5.0))
def test_object_and_image_are_conjugate(lens, ratio, hiatuses):
    s = lens.focal_length * ratio
    image = from_sensor(s, lens) - s
    assert 1 / s + 1 / image == pytest.approx(1 / lens.focal_length, rel=1e-6)
    thick = dataclasses.replace(lens, hiatus=min(hiatuses * lens.focal_length, 1.0))
    assert from_sensor(s, thick) == pytest.approx(s + image + thick.hiatus, rel=1e-12)
    assert from_sensor(s, thick) > 0


def test_no_lens_has_a_subject_nearer_to_its_sensor_than_four_focal_lengths():
    distances = np.linspace(1.001, 50, 9999) * PAPER.focal_length
    assert distance_from_sensor(distances, PAPER).min() == pytest.approx(0.2, rel=1e-6)


def test_at_infinity_it_is_infinite_and_within_the_focal_length_there_is_none():
    thick = dataclasses.replace(PAPER, hiatus=0.01)
    for lens in (PAPER, thick):
        assert from_sensor(math.inf, lens) == math.inf
        for distance in (0.05, 0.03, 0.0, -1.0, math.nan):
            assert math.isnan(from_sensor(distance, lens))
    found = distance_from_sensor(np.array([0.01, 0.39, math.inf]), thick)
    assert np.isnan(found[0])
    assert found[1] == from_sensor(0.39, thick)
    assert found[2] == math.inf
