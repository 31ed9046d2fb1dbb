# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Maps and masks, read back by other libraries."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image

from focus_planner.core.validation import InputError
from focus_planner.masks.maps import WRITERS, check_writer, write_mask

VALUES = np.random.default_rng(1).random((7, 5)).astype(np.float32)
VALUES[0, 0], VALUES[1, 2] = np.inf, np.nan


def test_a_mask_is_white_where_it_is_true(tmp_path: Path) -> None:
    mask = VALUES > 0.5
    write_mask(tmp_path / "a.png", mask)
    with Image.open(tmp_path / "a.png") as image:
        assert (image.format, image.mode, image.size) == ("PNG", "L", (5, 7))
        np.testing.assert_array_equal(np.asarray(image), 255 * mask)


def test_tiff_is_read_to_the_bit(tmp_path: Path) -> None:
    WRITERS["tiff"](tmp_path / "a.tiff", VALUES, "Z")
    read = cv2.imread(str(tmp_path / "a.tiff"), cv2.IMREAD_UNCHANGED)
    assert read is not None
    assert read.dtype == np.float32
    np.testing.assert_array_equal(read, VALUES)
    with Image.open(tmp_path / "a.tiff") as image:
        assert image.mode == "F"


@pytest.mark.parametrize("channel", ["Z", "Y"])
def test_exr_is_read_to_the_bit(tmp_path: Path, channel: str) -> None:
    openexr = pytest.importorskip("OpenEXR", reason="OpenEXR is not installed")
    WRITERS["exr"](tmp_path / "a.exr", VALUES, channel)
    pixels = openexr.File(str(tmp_path / "a.exr")).channels()[channel].pixels
    assert pixels.dtype == np.float32
    np.testing.assert_array_equal(pixels, VALUES)


def test_without_openexr_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "OpenEXR", None)
    check_writer("tiff")
    with pytest.raises(InputError, match=r"install it with: pip install openexr; or choose tiff"):
        check_writer("exr")


def test_exr_without_room_for_its_temporary_file_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("OpenEXR", reason="OpenEXR is not installed")

    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "missing"))
    with pytest.raises(InputError, match=r"missing: expected a folder for temporary files .* tiff"):
        WRITERS["exr"](tmp_path / "a.exr", VALUES, "Z")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("kind", ["tiff", "exr"])
def test_a_map_that_cannot_be_written_is_told(tmp_path: Path, kind: str) -> None:
    if kind == "exr":
        pytest.importorskip("OpenEXR", reason="OpenEXR is not installed")
    with pytest.raises(InputError, match="no such file"):
        WRITERS[kind](tmp_path / "missing" / f"a.{kind}", VALUES, "Z")
