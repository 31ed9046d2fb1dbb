# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What masks are called."""

from __future__ import annotations

import sys
from types import SimpleNamespace
from typing import Any

import pytest

from focus_planner.core.validation import InputError
from focus_planner.masks.programs import PROGRAMS, mask_places, picture_names


def plan_of(cameras: int = 2, shots: int = 1) -> Any:
    each = [SimpleNamespace(name=f"cam_{i}", shots=(None,) * shots) for i in range(cameras)]
    return SimpleNamespace(cameras=each, shots=shots)


def images(plan: Any, template: str | None = None) -> list[str]:
    return [str(name.image) for name in picture_names(plan, template)]


def test_pictures_are_called_by_their_cameras() -> None:
    assert images(plan_of()) == ["cam_0.jpg", "cam_1.jpg"]


def test_pictures_of_several_shots_have_their_number_as_on_lens_sheets() -> None:
    assert images(plan_of(1, 3)) == ["cam_0_1.jpg", "cam_0_2.jpg", "cam_0_3.jpg"]
    assert [name.shot for name in picture_names(plan_of(1, 3))] == [0, 1, 2]


def test_pictures_are_called_as_asked() -> None:
    template = "{camera}/take 7_{shot}.PNG"
    assert images(plan_of(2, 2), template) == [
        f"cam_{c}/take 7_{s}.PNG" for c in (0, 1) for s in (1, 2)
    ]


@pytest.mark.parametrize(
    ("program", "mask"),
    [
        ("colmap", "left/cam_0.jpg.png"),
        ("nerfstudio", "cam_0.png"),
        ("metashape", "cam_0_mask.png"),
        ("none", "cam_0.png"),
    ],
)
def test_masks_are_called_as_their_program_takes_them(program: str, mask: str) -> None:
    names = picture_names(plan_of(1), "left/{camera}.jpg")
    assert [str(place) for place in mask_places(names, PROGRAMS[program])] == [mask]


@pytest.mark.parametrize(
    "template",
    [
        *("{camera}", "{camera}/", "{name}.jpg", "{camera.__class__}.jpg", "{}.jpg", "{camera.jpg"),
        *("/tmp/{camera}.jpg", "../{camera}.jpg", "a\\{camera}.jpg", "{camera}\n.jpg", ""),
        *("{camera}.{shot}", "{camera}_{shot}.{camera}", "{camera}.jp{shot}g"),
    ],
)
def test_a_name_that_is_none_is_refused(template: str) -> None:
    with pytest.raises(InputError, match="--images: expected a name of picture files"):
        picture_names(plan_of(), template)


@pytest.mark.parametrize(
    ("template", "shots", "twice"),
    [("same.jpg", 1, "same.jpg"), ("{camera}.jpg", 2, "cam_0.jpg"), ("{shot}.jpg", 1, "1.jpg")],
)
def test_two_pictures_of_one_name_are_refused(template: str, shots: int, twice: str) -> None:
    with pytest.raises(InputError, match="another picture for every camera and shot") as told:
        picture_names(plan_of(2, shots), template)
    assert f"got {twice} twice" in str(told.value)


def test_two_pictures_of_one_mask_are_refused() -> None:
    names = picture_names(plan_of(), "{camera}/a.jpg")
    assert len(mask_places(names, PROGRAMS["colmap"])) == 2
    with pytest.raises(InputError, match=r"another mask .* got a_mask.png twice"):
        mask_places(names, PROGRAMS["metashape"], "{camera}/a.jpg")


@pytest.mark.parametrize("system", ["linux", "darwin", "win32"])
def test_names_that_differ_in_case_alone_are_of_one_file_elsewhere(
    system: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "platform", system)
    plan = plan_of()
    plan.cameras[1].name = "Cam_0"
    if system == "linux":
        assert images(plan) == ["cam_0.jpg", "Cam_0.jpg"]
    else:
        with pytest.raises(InputError, match=r"got Cam_0\.jpg twice by '\{camera\}\.jpg'"):
            images(plan)
