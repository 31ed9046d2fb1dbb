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

import os
from pathlib import Path

import pytest
from PIL import Image

from focus_planner.core.validation import InputError
from focus_planner.io.rig_files.image_files import ImageFiles


def exif(**tags: int) -> Image.Exif:
    made = Image.Exif()
    if "orientation" in tags:
        made[0x0112] = tags["orientation"]
    if "millimetres" in tags:
        made.get_ifd(0x8769)[0x920A] = float(tags["millimetres"])
    return made


@pytest.mark.parametrize("suffix", [".jpg", ".JPG", ".png", ".tif", ".webp", ".bmp"])
def test_sizes_are_those_of_headers(tmp_path: Path, suffix: str) -> None:
    Image.new("RGB", (30, 20)).save(tmp_path / f"a{suffix}")
    assert ImageFiles(tmp_path).size("here", f"a{suffix}") == (30, 20)
    assert ImageFiles(tmp_path).size("here", "a") == (30, 20)
    assert ImageFiles(tmp_path, size=(3, 2)).size("here", "a") == (3, 2)


def test_images_are_looked_for_in_few_places(tmp_path: Path) -> None:
    for place in ("images", "elsewhere", "other"):
        (tmp_path / place).mkdir()
    Image.new("L", (30, 20)).save(tmp_path / "images/a.png")
    Image.new("L", (6, 5)).save(tmp_path / "elsewhere/b.png")
    beside = ImageFiles(tmp_path)
    assert beside.size("here", "a.png") == (30, 20)
    assert beside.size("here", "C:/scan/a.png") == (30, 20)
    assert beside.size("here", "/scan/a.png") == (30, 20)
    assert beside.size("here", "elsewhere/b.png") == (6, 5)
    for name in ("b.png", f"{tmp_path}/elsewhere/b.png", "images/../elsewhere/b.png", ".."):
        with pytest.raises(InputError, match="here: expected the width and height of"):
            beside.size("here", name)
    assert ImageFiles(tmp_path, tmp_path / "elsewhere").size("here", "x/b.png") == (6, 5)


def test_lenses_are_those_of_exif(tmp_path: Path) -> None:
    Image.new("L", (30, 20)).save(tmp_path / "a.jpg", exif=exif(millimetres=35))
    Image.new("L", (30, 20)).save(tmp_path / "b.jpg")
    Image.new("L", (30, 20)).save(tmp_path / "c.jpg", exif=exif(millimetres=0))
    files = ImageFiles(tmp_path)
    assert [files.focal_length(name) for name in ("a.jpg", "b.jpg", "c.jpg", "none.jpg")] == [
        0.035, None, None, None,
    ]  # fmt: skip


def test_an_image_that_is_turned_needs_a_word(tmp_path: Path) -> None:
    Image.new("L", (30, 20)).save(tmp_path / "a.jpg", exif=exif(orientation=6))
    Image.new("L", (30, 20)).save(tmp_path / "b.jpg", exif=exif(orientation=3))
    files = ImageFiles(tmp_path)
    assert files.size("here", "b.jpg") == (30, 20)
    with pytest.raises(InputError, match="an image that its EXIF turns by 90°; give"):
        files.size("here", "a.jpg")


def test_what_is_no_image_tells_nothing(tmp_path: Path) -> None:
    (tmp_path / "a.jpg").write_bytes(b"\xff\xd8\xff secret")
    os.mkfifo(tmp_path / "b.jpg")
    (tmp_path / "c.jpg").mkdir()
    files = ImageFiles(tmp_path)
    for name in ("a.jpg", "b.jpg", "c.jpg", ""):
        assert files.focal_length(name) is None
        with pytest.raises(InputError, match="nor an image beside it; give --image WxH"):
            files.size("here", name)


def test_an_image_of_very_many_pixels_is_not_decoded(tmp_path: Path) -> None:
    wide = Image.new("1", (12_000, 10_000))
    wide.save(tmp_path / "a.png")
    assert ImageFiles(tmp_path).size("here", "a.png") == (12_000, 10_000)
