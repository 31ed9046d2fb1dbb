# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The folders of runs: which there are, how large, whole or cut off, and who writes them."""

from __future__ import annotations

import os
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from mcap.stream_reader import MAGIC_SIZE

from focus_planner.core.validation import InputError
from focus_planner.io.file_locks import lock_file, locked_folder
from focus_planner.io.files import open_regular
from focus_planner.recording.naming import A_RUN, METADATA, PARTIAL, RUN_NAME, mcap_name

_MAGIC = b"\x89MCAP0\r\n"
_ANY_SIZE = 2**63


@dataclass(frozen=True)
class RunFolder:
    """A folder with the name of a run.

    Attributes
    ----------
    path : Path
    name : str
        Of the run: the folder's without the suffix of what is not whole.
    size : int
        Bytes.
    file_size : int
        Of the MCAP file; 0 if there is none yet.
    fault : str
        Why it is taken for something else than a run; empty for a run.
    """

    path: Path
    name: str
    size: int = 0
    file_size: int = 0
    fault: str = ""

    @property
    def file(self) -> Path:
        """The MCAP file."""
        return self.path / mcap_name(self.name)

    @property
    def is_partial(self) -> bool:
        """Whether it is being written, or was cut off."""
        return self.path.name.endswith(PARTIAL)

    def is_whole(self) -> bool:
        """Return whether it was written to its end."""
        if self.is_partial or not (self.path / METADATA).is_file():
            return False
        with suppress(InputError, OSError), open_regular(self.file, A_RUN, _ANY_SIZE) as file:
            head = file.read(MAGIC_SIZE)
            file.seek(-MAGIC_SIZE, os.SEEK_END)
            return head == _MAGIC == file.read(MAGIC_SIZE)
        return False


def runs_newest_first(directory: Path) -> list[RunFolder]:
    """Return all folders with the names of runs, also partial ones and those with a fault.

    Links, and folders in which there is nothing yet, are left out.

    Raises
    ------
    OSError
        If the directory cannot be read.
    """
    with os.scandir(directory) as entries:
        found = [run for entry in entries if (run := _run_folder(entry))]
    return sorted(found, key=lambda run: run.path.name, reverse=True)


def _run_folder(entry: os.DirEntry[str]) -> RunFolder | None:
    path, name = Path(entry.path), entry.name.removesuffix(PARTIAL)
    if not RUN_NAME.fullmatch(name):
        return None
    try:
        if not entry.is_dir(follow_symlinks=False):
            return None
        sizes = _sizes(path, {mcap_name(name), METADATA})
    except FileNotFoundError:  # another planner may delete and rename its runs at any time
        return None
    except OSError as error:
        return RunFolder(path, name, fault=error.strerror or str(error))
    except InputError as error:
        return RunFolder(path, name, fault=f"{error.argument}, which is {error.got}")
    # An empty folder is about to be written.
    return (
        RunFolder(path, name, sum(sizes.values()), sizes.get(mcap_name(name), 0)) if sizes else None
    )


def _sizes(folder: Path, names: set[str]) -> dict[str, int]:
    """Return the sizes of a folder's files; raise ``InputError`` if it holds anything else."""
    sizes = {}
    with os.scandir(folder) as entries:
        for file in entries:
            if not file.is_file(follow_symlinks=False):
                raise InputError(file.name, "a file", "no regular file")
            if file.name not in names:
                raise InputError(file.name, "a file of this run", "no file of this run")
            sizes[file.name] = file.stat(follow_symlinks=False).st_size
    return sizes


def bag_size(folder: Path) -> int:
    """Return the total size of a bag's files, bytes."""
    return sum(file.stat().st_size for file in folder.iterdir() if file.is_file())


def being_written(folder: Path) -> bool:
    """Return whether any process is writing this partial bag.

    Raises
    ------
    OSError
        If the folder cannot be read.
    """
    with locked_folder(folder, wait=False) as locked:
        if not locked:
            return True
    for path in folder.glob("*.mcap"):
        with suppress(InputError), open_regular(path, A_RUN, _ANY_SIZE, may_be_empty=True) as file:
            try:
                lock_file(file, wait=False)
            except OSError:
                return True
    return False
