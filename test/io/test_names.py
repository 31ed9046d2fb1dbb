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

import re

import pytest

from focus_planner.core.validation import InputError
from focus_planner.io.names import camera_names, matches


@pytest.mark.parametrize(
    ("paths", "names"),
    [
        (["cam01/0001", "cam02/0001"], ["cam01", "cam02"]),
        (["set/cam01/0001", "set/cam02/0001"], ["cam01", "cam02"]),
        (["cam01/0001", "cam01/0002"], ["cam_0001", "cam_0002"]),
        (["cam01/0001", "cam02/0002"], ["cam01_0001", "cam02_0002"]),
        (["cam01/0001"], ["cam01_0001"]),
        (["IMG_0001", "IMG_0002"], ["IMG_0001", "IMG_0002"]),
        (["0/a", "1"], ["cam_0_a", "cam_1"]),
        (["left side (1)", "Süd", "Nu\u0308rnberg"], ["left_side_1", "Sud", "Nurnberg"]),
        ([], []),
    ],
)
def test_names_are_short_and_fit_for_topics(paths: list[str], names: list[str]) -> None:
    assert camera_names("images", paths) == names


@pytest.mark.parametrize(
    ("paths", "telling"),
    [
        (
            ["a-b", "a b"],
            "'a-b' and 'a b', both of which make a_b; rename one there, or leave it out with --cam",
        ),
        (["a/1", "a/1"], "'a/1' and 'a/1', both of which make cam_1"),
        (["Süd", "Su\u0308d"], r"got 'S\xfcd' and 'Su\u0308d', both of which make Sud"),
        (["a", "—"], "images: expected names with a letter or digit from A to Z, got '—'"),
        ([""], "images: expected names with a letter or digit from A to Z, got ''"),
    ],
)
def test_what_names_no_camera_is_refused(paths: list[str], telling: str) -> None:
    with pytest.raises(InputError, match=re.escape(telling)):
        camera_names("images", paths)


def test_letters_match_however_they_are_encoded() -> None:
    assert matches("left/Su\u0308d.jpg", "*/S\xfcd*")
    assert matches("left/S\xfcd.jpg", "*/Su\u0308d*")
    assert not matches("left/Sud.jpg", "*/S\xfcd*")
