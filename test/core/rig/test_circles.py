# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

from __future__ import annotations

import math

import pytest

from focus_planner.core.rig.camera import Camera, CameraIntrinsics
from focus_planner.core.rig.circles import assumed_circle, is_on_circles, note_on_circles
from focus_planner.core.rig.lens import Lens
from focus_planner.core.rig.optics import circle_of_confusion, f_number_of, lens_of_aperture
from focus_planner.core.validation import InputError

# 24 megapixels of 6 µm behind a lens of 50 mm.
FULL_FRAME = CameraIntrinsics(6000, 4000, 0.05 / 6e-6, 0.05 / 6e-6, 2999.5, 1999.5)
DIAGONAL = math.hypot(36e-3, 24e-3)


def test_of_pixels_that_are_known_it_is_two() -> None:
    circle = assumed_circle(FULL_FRAME, 0.05)
    assert circle.metres == pytest.approx(12e-6, rel=1e-12)
    assert circle.how == "two pixels"
    camera = Camera("a", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), FULL_FRAME, Lens())
    assert circle_of_confusion(camera) == circle.metres


def test_else_it_is_a_part_of_the_diagonal() -> None:
    circle = assumed_circle(FULL_FRAME, 0.05, focal_length_told=False)
    assert circle.metres == pytest.approx(DIAGONAL / 1500, rel=1e-12)
    assert circle.how == "the sensor's diagonal / 1500"
    # The paper's image: nobody told it.
    paper = assumed_circle(CameraIntrinsics(), 0.035)
    assert paper.metres == pytest.approx(0.035 * math.hypot(580, 870) / 1190.732 / 1500)
    # The same sensor, its pictures made smaller by 10: pixels of 60 µm.
    reduced = CameraIntrinsics(600, 400, 0.05 / 60e-6, 0.05 / 60e-6, 299.5, 199.5)
    assert assumed_circle(reduced, 0.05) == (pytest.approx(DIAGONAL / 1500), circle.how)


def test_a_note_says_how_much_and_why() -> None:
    told, untold = (assumed_circle(FULL_FRAME, 0.05, focal_length_told=t) for t in (True, False))
    (note,) = note_on_circles([told] * 3, 4, "do this")
    assert note.code == "default_lens"
    assert note.text == (
        "nothing tells the circle of confusion of 3 of 4 cameras: 12 µm is assumed, two pixels;"
        " the depth of field is proportional to it; do this"
    )
    assert is_on_circles(note)
    (note,) = note_on_circles([told, untold], 2, "do this")
    assert ": 12 to 28.8 µm is assumed, the sensor's diagonal / 1500 or two pixels;" in note.text
    assert note_on_circles([], 4, "do this") == ()


def test_an_assumed_circle_is_not_blamed() -> None:
    tiny = CameraIntrinsics(64, 48, 70.0, 70.0, 31.5, 23.5)
    with pytest.raises(InputError) as caught:
        lens_of_aperture(Lens(0.002), 64.0, None, tiny)
    assert caught.value.argument == "lens.focal_length, lens.f_number"
    assert caught.value.remedy.startswith("give lens.circle_of_confusion, for which 5.71e-05 m is")
    with pytest.raises(InputError) as caught:
        lens_of_aperture(Lens(0.002), 64.0, 6e-5, tiny)
    assert caught.value.argument == "lens.focal_length, lens.f_number, lens.circle_of_confusion"


@pytest.mark.parametrize("f_number", [8, 1.4, 5.6, 1 / 0.3, 22.0, math.pi])
@pytest.mark.parametrize("focal_length", [0.05, 0.00474, 0.085])
def test_the_f_number_of_a_lens_is_found_again(focal_length: float, f_number: float) -> None:
    lens = lens_of_aperture(Lens(focal_length), f_number, None, FULL_FRAME)
    found = f_number_of(lens)
    assert found == pytest.approx(f_number, rel=1e-15)
    assert lens_of_aperture(lens, found, None, FULL_FRAME) == lens
    assert f_number_of(Lens()) is None
