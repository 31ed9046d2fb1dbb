# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Who may read runs, whatever the umask: they are scans of people's bodies."""

from __future__ import annotations

import os
import stat
from contextlib import suppress
from pathlib import Path
from typing import BinaryIO

# What ``record_access`` stands for: the modes of folders and of files.
_MODES = {"owner": (0o700, 0o600), "group": (0o750, 0o640), "all": (0o755, 0o644)}
_OWNER = "owner"


def make_folder(path: Path, access: str = _OWNER) -> None:
    """Make a folder.

    Raises
    ------
    OSError
        If that fails, or it exists.
    """
    path.mkdir(mode=_MODES[_OWNER][0])
    give_access(path, access)


def make_parent(folder: Path, access: str = _OWNER) -> None:
    """Make a folder for folders of runs, and those that it is in, unless it exists."""
    if not folder.parent.exists():
        folder.parent.mkdir(parents=True, exist_ok=True)
    with suppress(FileExistsError):  # making a folder of runs in it tells if it is none
        make_folder(folder, access)


def create_file(path: Path, access: str = _OWNER) -> BinaryIO:
    """Create a file and open it to write.

    Raises
    ------
    OSError
        If that fails, or it exists.
    """
    file = open(path, "xb", opener=_for_owner)  # noqa: SIM115 - Path.open has no opener
    give_access(path, access)
    return file


def _for_owner(path: str, flags: int) -> int:
    return os.open(path, flags, _MODES[_OWNER][1])


def give_access(path: Path, access: str) -> None:
    """Set the mode of a folder or file that was made for its owner alone."""
    of_folders, of_files = _MODES[access]
    now = path.stat().st_mode
    # A folder inherits the group of the folder that it is in by this bit.
    mode = of_folders | (now & stat.S_ISGID) if stat.S_ISDIR(now) else of_files
    with suppress(PermissionError):  # some file systems have no modes
        path.chmod(mode)
