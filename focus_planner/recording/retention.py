# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Deleting old runs, to stay within a number of runs and of bytes.

Only whole runs count. Runs that were cut off, because their planner was killed, are limited on
their own: otherwise many of them would push out the good ones.
"""

from __future__ import annotations

import shutil
import stat
import time
from contextlib import suppress
from pathlib import Path

from focus_planner.core.validation import InputError
from focus_planner.recording.folders import RunFolder, being_written, runs_newest_first
from focus_planner.recording.last_plan import last_plan, publishers_in
from focus_planner.recording.naming import PARTIAL, RUN_NAME, mcap_name

# How many runs that were cut off are kept besides.
_CUT_OFF = 3
# Longest time from making a run's folder to making its file.
_SECONDS_TO_BEGIN = 60.0


def prune(directory: Path, max_runs: int, max_bytes: int) -> list[Path]:
    """Delete the oldest runs that exceed the limits, and return them.

    The newest whole run is never deleted, nor one that holds the plan which a planner would put in
    force again, nor one that is being written. Of runs that were cut off, or are damaged, the three
    newest are kept besides. What is no run is left alone.

    Parameters
    ----------
    directory : Path
        The parent of the runs' folders.
    max_runs, max_bytes : int
        0 for no limit.

    Raises
    ------
    OSError
        If the directory cannot be read, or runs cannot be deleted: the first error, after the
        others were deleted.
    """
    if not max_runs and not max_bytes:
        return []
    runs = [run for run in runs_newest_first(directory) if not run.fault]
    whole = [run for run in runs if run.is_whole()]
    too_many = _beyond(whole, max_runs, max_bytes)
    cut_off = [run for run in runs if run not in whole and not _is_written(run)]
    deletion = _Deletion(directory)
    for run in [*too_many, *cut_off[_CUT_OFF:]]:
        deletion.delete(run)
    if deletion.errors:
        raise deletion.errors[0]
    return deletion.deleted


def delete_leftovers(directory: Path) -> None:
    """Delete what planners that no longer exist left and holds nothing of a run.

    That is bags that were prepared for runs, bags that were being deleted, and beginnings without
    a byte.
    """
    with suppress(OSError):
        for folder in directory.iterdir():
            with suppress(OSError):
                if _is_leftover(folder):
                    shutil.rmtree(folder)


def _beyond(whole: list[RunFolder], max_runs: int, max_bytes: int) -> list[RunFolder]:
    """Return the whole runs, newest first, that exceed the limits."""
    beyond = []
    count = size = 0
    for run in whole:
        too_many = max_runs and count + 1 > max_runs
        too_large = max_bytes and size + run.size > max_bytes
        if count and (too_many or too_large):
            beyond.append(run)
        else:
            count += 1
            size += run.size
    return beyond


class _Deletion:
    """Deletes runs, except those that planners would restore their plans from."""

    def __init__(self, directory: Path) -> None:
        self.deleted: list[Path] = []
        self.errors: list[OSError] = []
        self._directory = directory
        self._needed: dict[str, Path | None] = {}

    def delete(self, run: RunFolder) -> None:
        try:
            if self._is_needed(run):
                return
            # At once, so that half a run is never taken for one; a leftover until it is gone.
            hidden = run.path.with_name(f".{run.name}{PARTIAL}")
            run.path.rename(hidden)
            shutil.rmtree(hidden)
        except FileNotFoundError:
            return  # another planner records here, and has deleted or renamed it
        except OSError as error:
            self.errors.append(error)
        else:
            self.deleted.append(run.path)

    def _is_needed(self, run: RunFolder) -> bool:
        try:
            planners = publishers_in(run)
        except InputError:
            return False
        return any(self._last_run(planner) == run.path for planner in planners)

    def _last_run(self, planner: str) -> Path | None:
        if planner not in self._needed:
            found = last_plan(self._directory, planner).plan
            self._needed[planner] = found.run if found else None
        return self._needed[planner]


def _is_written(run: RunFolder) -> bool:
    try:
        return being_written(run.path)
    except OSError:
        return True  # what cannot be told is left alone


def _is_leftover(folder: Path) -> bool:
    name = folder.name.removesuffix(PARTIAL)
    run = name.removeprefix(".")
    if name == folder.name or not RUN_NAME.fullmatch(run):
        return False
    status = folder.lstat()
    if not stat.S_ISDIR(status.st_mode):
        return False
    files = list(folder.iterdir())
    if not files:  # about to be written, unless it has been so for long
        return time.time() - status.st_mtime > _SECONDS_TO_BEGIN
    hidden = name != run
    return (hidden or _is_empty(folder, run, files)) and not being_written(folder)


def _is_empty(folder: Path, run: str, files: list[Path]) -> bool:
    """Return whether there is nothing in a run's folder but its MCAP file without a byte."""
    if files != [folder / mcap_name(run)]:
        return False
    status = files[0].lstat()
    return stat.S_ISREG(status.st_mode) and not status.st_size
