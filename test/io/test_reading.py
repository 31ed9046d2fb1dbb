# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""How far the reading of a surface has come, while it is read."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from focus_planner.core.arrays import FloatArray
from focus_planner.core.surface.surface import Mesh, Surface
from focus_planner.io import files
from focus_planner.io.files import BrokenFileError, read_bytes
from focus_planner.io.formats import tables
from focus_planner.io.formats.tables import columns_of_lines, numbers_of_text, words_per_line
from focus_planner.io.reading import became_numbers, bytes_came, telling
from focus_planner.io.surfaces import load_surface

BALL = trimesh.creation.icosphere(subdivisions=4)
NAMES = ("ball.ply", "text.ply", "ball.obj", "ball.stl", "ball.off", "ball.xyz", "named.csv")


@pytest.fixture(autouse=True)
def in_small_pieces(monkeypatch: pytest.MonkeyPatch) -> None:
    """Small files are read as large ones are."""
    monkeypatch.setattr(files, "_PIECE", 10_000)
    monkeypatch.setattr(tables, "_BLOCK", 10_000)
    monkeypatch.setattr(tables, "_LINES", 500)


def written(path: Path) -> Path:
    match path.name:
        case "text.ply":
            BALL.export(path, encoding="ascii")
        case "ball.xyz":
            np.savetxt(path, BALL.vertices)
        case "named.csv":
            lines = [f"point,{x},{y},{z}" for x, y, z in BALL.vertices.tolist()]
            path.write_text("\n".join(["name,x,y,z", *lines, ""]))
        case _:
            BALL.export(path)
    return path


def places(surface: Surface) -> FloatArray:
    return surface.vertices if isinstance(surface, Mesh) else surface.points


@pytest.mark.parametrize("name", NAMES)
def test_the_share_grows_to_1_as_the_file_is_read(tmp_path: Path, name: str) -> None:
    path = written(tmp_path / name)
    shares: list[float] = []
    surface = load_surface(path, on_progress=shares.append)
    assert shares == sorted(shares)
    assert len(set(shares)) > 5
    assert 0 < shares[0] < 0.5
    assert max(np.diff(shares)) < 0.5
    assert shares[-1] == 1.0
    assert np.array_equal(places(surface), places(load_surface(path)))


@pytest.mark.parametrize("name", NAMES)
def test_it_can_be_ended_meanwhile(tmp_path: Path, name: str) -> None:
    """As by Ctrl-C, which is not taken for something that is wrong with the file."""

    def stop(share: float) -> None:
        if share > 0.3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        load_surface(written(tmp_path / name), on_progress=stop)


def test_an_empty_or_endless_file_is_read_as_before(tmp_path: Path) -> None:
    shares: list[float] = []
    path = tmp_path / "file"
    path.write_bytes(b"a" * 25_000)
    with telling(shares.append):
        assert read_bytes(path, "text") == b"a" * 25_000
        assert len(read_bytes(Path("/proc/self/maps"), "text")) > 0
    assert len(shares) >= 3
    assert max(shares) < 1


# --- numbers in pieces -------------------------------------------------------------------------


@pytest.mark.parametrize("between", [b" ", b"\n", b"\r\n", b"\t \n"])
def test_numbers_in_pieces_are_the_same(between: bytes) -> None:
    numbers = np.random.default_rng(0).normal(size=5000)
    text = between.join(repr(x).encode() for x in numbers.tolist())
    np.testing.assert_array_equal(numbers_of_text(text), numbers)
    assert words_per_line(text).sum() == 5000


def test_long_words_and_blanks_are_no_piece_of_their_own() -> None:
    text = b" " * 30_000 + b"1" * 200 + b"\n" * 30_000 + b"2 " + b" " * 15_000 + b"3"
    np.testing.assert_array_equal(numbers_of_text(text), [float("1" * 200), 2.0, 3.0])


def test_the_first_word_that_is_no_number_is_named() -> None:
    text = b"1.25 " * 10_000 + b"1.2.3 " + b"1.25 " * 10_000 + b"4.5.6"
    with pytest.raises(BrokenFileError, match=r"'1\.2\.3' in place of a number"):
        numbers_of_text(text)


def test_columns_in_pieces_are_the_same() -> None:
    lines = [f"p {k} {k / 7!r}" for k in range(2345)]
    np.testing.assert_array_equal(
        columns_of_lines(lines, [2, 1]), [[k / 7, k] for k in range(2345)]
    )
    lines[2100] = "p 2100 1.2.3"
    with pytest.raises(
        BrokenFileError, match=r"'1\.2\.3' in place of a number in row 2101, column 3"
    ):
        columns_of_lines(lines, [2, 1])
    assert columns_of_lines([], [0, 1]).size == 0


def test_a_second_file_does_not_take_the_share_back() -> None:
    told: list[float] = []
    with telling(told.append):
        bytes_came(1000, 1000, is_text=True)
        became_numbers(800)
        bytes_came(10, 5000, is_text=False)  # as of a texture
    assert told == sorted(told)
    assert told[-1] == told[-2] > 0.5
