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

import unicodedata

import pytest

from focus_planner.core.rig.names import MAX_NAME, as_camera_name, is_camera_name, proposed_name


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("Kamera (1)", "Kamera_1"),
        ("  links-oben.jpg ", "links_oben_jpg"),
        ("Süd", "Sud"),
        ("Straße №5", "Strasse_No5"),
        ("Ærø Łódź", "AEro_Lodz"),
        ("_a", "a"),
        ("7", "cam_7"),
        ("相机 1", "cam_1"),
        ("相机", ""),
        ("", ""),
    ],
)
def test_texts_become_names(text: str, name: str) -> None:
    assert as_camera_name(text) == name
    assert as_camera_name(unicodedata.normalize("NFD", text)) == name
    assert as_camera_name(unicodedata.normalize("NFC", text)) == name
    assert not name or is_camera_name(name)


@pytest.mark.parametrize("text", ["Kamera (1)", "", "相机", "x" * 500, "é" * 100_000, "9" * 99])
def test_a_name_is_proposed_for_anything(text: str) -> None:
    taken: set[str] = set()
    for _ in range(12):
        name = proposed_name(text, taken)
        assert name not in taken
        assert is_camera_name(name)
        assert len(name) <= MAX_NAME
        taken.add(name)


def test_a_proposal_is_no_other_cameras_name() -> None:
    assert proposed_name("Kamera (1)", {"Kamera_1"}) == "Kamera_1_2"
    assert proposed_name("Kamera (1)", {"Kamera_1", "Kamera_1_2"}) == "Kamera_1_3"
