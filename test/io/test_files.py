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

from focus_planner.core.validation import InputError
from focus_planner.io.files import (
    atomic_write,
    check_readable,
    check_writable,
    is_folder,
    is_there,
    read_bytes,
    resolved,
)


def test_a_file_takes_its_place_only_when_it_is_whole(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_text("old")
    with pytest.raises(TypeError), atomic_write(path) as file:
        file.write(b"half" + path.read_text())  # type: ignore[operator]
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]
    with atomic_write(path) as file:
        file.write(b"new")
    assert path.read_text() == "new"
    assert list(tmp_path.iterdir()) == [path]


def test_a_link_stays_a_link_and_permissions_follow_the_umask(tmp_path: Path) -> None:
    (tmp_path / "link").symlink_to(tmp_path / "file")
    with atomic_write(tmp_path / "link") as file:
        file.write(b"x")
    assert (tmp_path / "link").is_symlink()
    umask = os.umask(0)
    os.umask(umask)
    assert (tmp_path / "file").stat().st_mode & 0o777 == 0o666 & ~umask


def test_a_device_is_written_to_as_it_is() -> None:
    check_writable(Path(os.devnull))
    with atomic_write(Path(os.devnull)) as file:
        file.write(b"x")


@pytest.mark.parametrize(
    ("path", "telling"),
    [("none/file", "no folder .*none"), (".", "got a folder"), ("file/below", "no folder")],
)
def test_where_no_file_can_be_is_told_before(tmp_path: Path, path: str, telling: str) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match=telling):
        check_writable(tmp_path / path)


def test_a_full_disk_is_told_in_one_line() -> None:
    if not Path("/dev/full").exists():
        pytest.skip("no /dev/full")
    with pytest.raises(InputError, match="No space left"), atomic_write(Path("/dev/full")) as file:
        file.write(b"x" * 100_000)


def test_what_cannot_be_read_is_told(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="expected a plan, got no such file"):
        check_readable(tmp_path / "none", "a plan")
    with pytest.raises(InputError, match="a folder"):
        check_readable(tmp_path, "a plan")
    with pytest.raises(InputError, match="too long"):
        check_readable(tmp_path / ("x" * 300), "a plan")


def test_a_pipe_is_written_directly() -> None:
    ours, theirs = os.pipe()
    try:
        check_writable(Path(f"/dev/fd/{theirs}"))
        with atomic_write(Path(f"/dev/fd/{theirs}")) as file:
            file.write(b"a plan")
        assert os.read(ours, 100) == b"a plan"
    finally:
        os.close(ours)
        os.close(theirs)


def test_links_in_a_circle_are_told(tmp_path: Path) -> None:
    circle = tmp_path / "circle"
    circle.symlink_to(circle)
    assert resolved(circle) == circle
    with pytest.raises(InputError, match=r"circle: expected a mesh, got Too many levels of symb"):
        read_bytes(circle, "a mesh")
    with pytest.raises(InputError, match="circle"):
        check_writable(circle / "plan.json")


@pytest.mark.parametrize("length", [250, 300])
def test_a_name_that_is_too_long_is_told_before_and_while_writing(
    tmp_path: Path, length: int
) -> None:
    # One of 250 characters is none too long itself, but that of its part is.
    path = tmp_path / ("x" * length)
    with pytest.raises(InputError, match="can be written, got File name too long"):
        check_writable(path)
    with pytest.raises(InputError, match="can be written, got File name too long"):
        _write(path)
    assert not is_there(path)
    assert not is_folder(path)


def _write(path: Path) -> None:
    with atomic_write(path) as file:
        file.write(b"new")
