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

import pytest

from focus_planner.core.validation import InputError
from focus_planner.io.bodies import bodies, body


def test_the_bodies_are_small_and_say_whose_they_are() -> None:
    assert [path.stem for path in bodies()] == ["arms_down", "arms_out", "arms_raised"]
    folder = bodies()[0].parent
    assert sum(path.stat().st_size for path in folder.iterdir()) < 1_600_000
    text = (folder / "README.md").read_text()
    assert "Anny" in text
    assert "CC0" in text
    assert all(path.name in text for path in bodies())


def test_a_body_has_a_name() -> None:
    assert body("arms_out") in bodies()
    with pytest.raises(InputError, match=r"body: expected one of arms_down, .*, got 'legs_out'"):
        body("legs_out")
