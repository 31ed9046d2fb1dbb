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

from collections.abc import Collection

import pytest

from focus_planner.core.rig.defaults import assumed_values, keys_of, notes_on_defaults

LENS = {"focal_length": 0.05, "hyperfocal_distance": 10.0}
IMAGE = {"width": 580, "height": 870, "fx": 1190.732, "fy": 1190.732, "cx": 284.813, "cy": 434.44}


def codes(*cameras: Collection[str]) -> list[str]:
    return [note.code for note in notes_on_defaults(cameras, "tell it", "tell that")]


def test_what_is_given_is_told_even_if_it_is_the_default() -> None:
    assert codes(assumed_values(LENS, IMAGE)) == []
    assert codes(assumed_values({}, {})) == ["default_lens", "default_image"]


def test_doubted_values_tell_something_if_they_are_not_the_default() -> None:
    assert codes(assumed_values(LENS, IMAGE, keys_of("lens"))) == ["default_lens"]
    assert codes(assumed_values(LENS, IMAGE, keys_of("image"))) == ["default_image"]
    own = {"focal_length": 0.035, "hyperfocal_distance": 5.0}
    assert codes(assumed_values(own, IMAGE, keys_of("lens"))) == []
    assert codes(assumed_values({"focal_length": 0.05, "f_number": 8}, IMAGE, keys_of("lens"))) == [
        "default_lens"
    ]


def test_a_value_may_be_doubted_alone() -> None:
    assert assumed_values(LENS, IMAGE, {"lens.focal_length"}) == {"lens.focal_length"}
    assert assumed_values({"focal_length": 0.035}, IMAGE, {"lens.focal_length"}) == {
        "lens.hyperfocal_distance"
    }


def test_the_note_names_what_is_assumed_and_for_how_many() -> None:
    cameras = [assumed_values(LENS, IMAGE)] * 3 + [assumed_values({"focal_length": 0.035}, IMAGE)]
    (note,) = notes_on_defaults(cameras, "tell it", "tell that")
    assert note.text == (
        "nothing tells the lens of 1 of 4 cameras: hyperfocal distance 10 m is assumed, as in the"
        " paper, and the plan holds for nothing else; tell it"
    )
    *_, note = notes_on_defaults([assumed_values(LENS, {})], "tell it", "tell that")
    assert note.text == (
        "nothing tells the image of the only camera: width 580 pixels, height 870 pixels, fx"
        " 1190.73 pixels, fy 1190.73 pixels, cx 284.813 pixels and cy 434.44 pixels"
        " are assumed, as in the paper, and the plan holds for"
        " nothing else; tell that"
    )


def test_an_aperture_tells_the_hyperfocal_distance() -> None:
    assert codes(assumed_values({"focal_length": 0.05, "f_number": 8}, IMAGE)) == []


@pytest.mark.parametrize("missing", IMAGE)
def test_every_value_of_an_image_has_to_be_told(missing: str) -> None:
    some = {name: value for name, value in IMAGE.items() if name != missing}
    (note,) = notes_on_defaults([assumed_values(LENS, some)], "tell it", "tell that")
    assert note.code == "default_image"
    assert f": {missing} {IMAGE[missing]:g} pixels is assumed" in note.text
