# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

import numpy as np
import pytest

from focus_planner import InputError, Lens
from focus_planner.core.rig.diffraction import GREEN, airy_diameter, sharp_interval
from focus_planner.core.rig.optics import depth_of_field, focus_interval, hyperfocal_distance

CIRCLE = 30e-6


def lens_at(f_number, **more):
    distance = hyperfocal_distance(0.05, f_number, CIRCLE)
    return Lens(0.05, distance, circle_of_confusion=CIRCLE, **more)


def blur(depth, focus, f_number, wavelength):
    """Diameter on the sensor, by the textbook: defocus and the Airy disc in quadrature."""
    magnification = 0.05 / (focus - 0.05)
    defocus = (0.05 / f_number) * 0.05 * abs(depth - focus) / (depth * (focus - 0.05))
    return np.hypot(defocus, 2.44 * wavelength * f_number * (1 + magnification))


@pytest.mark.parametrize("f_number", [2.8, 8, 11, 16])
def test_the_ends_of_an_interval_are_blurred_by_the_circle_of_confusion(f_number):
    depth = np.array([0.3, 0.65, 1.2, 3.0])
    near, far = sharp_interval(depth, lens_at(f_number))
    bounded = np.isfinite(far)
    assert bounded[0]
    assert (near < depth).all()
    assert (far > depth).all()
    assert blur(depth, near, f_number, GREEN) == pytest.approx(CIRCLE, rel=1e-9)
    assert blur(depth, far, f_number, GREEN)[bounded] == pytest.approx(CIRCLE, rel=1e-9)
    assert (blur(depth, (near + np.minimum(far, 99)) / 2, f_number, GREEN) < CIRCLE).all()
    assert (blur(depth, np.full(4, 1e12), f_number, GREEN) <= CIRCLE).tolist() == (
        ~bounded
    ).tolist()


@pytest.mark.parametrize("f_number", [2.8, 8, 22, 64])
def test_without_diffraction_it_is_the_depth_of_field(f_number):
    lens, depth = lens_at(f_number), np.array([0.04, 0.3, 0.65, 2.0, 50.0])
    near, far = sharp_interval(depth, lens, wavelength=0.0)
    expected_near, expected_far = focus_interval(depth, lens)
    assert near == pytest.approx(expected_near, rel=1e-9)
    assert far == pytest.approx(expected_far, rel=1e-9)
    limits = depth_of_field(far[np.isfinite(far)], lens)[0]
    assert limits == pytest.approx(depth[np.isfinite(far)], rel=1e-9)


def test_nothing_is_sharp_whose_airy_disc_is_wider_than_the_circle():
    depth = np.geomspace(0.1, 100, 30)
    wide, narrow = lens_at(22.5), lens_at(22)
    assert (airy_diameter(depth, wide) > CIRCLE).all()
    near, far = sharp_interval(depth, wide)
    assert np.isinf(near).all()
    assert (far == -np.inf).all()
    # Far away the magnification is small enough.
    near, far = sharp_interval(depth, narrow)
    sharp = airy_diameter(depth, narrow) <= CIRCLE
    assert 0 < sharp.sum() < len(depth)
    assert (near[sharp] <= depth[sharp]).all()
    assert (depth[sharp] <= far[sharp]).all()


def test_airy_discs_are_those_of_the_textbook():
    lens = lens_at(8)
    # 2.44 · 0.55 µm · 8 at infinity, and twice that at 1:1, where s = 2 F.
    assert airy_diameter(np.array([np.inf, 0.1]), lens) == pytest.approx([10.736e-6, 21.472e-6])


def test_only_what_the_lens_can_be_set_to_counts():
    free, limited = lens_at(8), lens_at(8, min_focus=0.6, max_focus=0.7)
    depth = np.linspace(0.4, 1.0, 50)
    near, far = sharp_interval(depth, free)
    within = (far >= 0.6) & (near <= 0.7)
    limited_near, limited_far = sharp_interval(depth, limited)
    assert within.any()
    assert not within.all()
    assert limited_near[within].tolist() == np.maximum(near, 0.6)[within].tolist()
    assert limited_far[within].tolist() == np.minimum(far, 0.7)[within].tolist()
    assert np.isinf(limited_near[~within]).all()


def test_a_lens_without_a_circle_of_confusion_is_refused():
    with pytest.raises(InputError, match=r"lens\.circle_of_confusion.*none.*give it"):
        sharp_interval(np.array([1.0]), Lens())
