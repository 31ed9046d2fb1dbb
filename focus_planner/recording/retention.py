"""Deleting old runs, to stay within a number of runs and of bytes."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from focus_planner.recording.bag import METADATA, PARTIAL, bag_size, being_written
from focus_planner.recording.naming import RUN_NAME


def prune(directory: Path, max_runs: int, max_bytes: int) -> list[Path]:
    """Delete the oldest runs that exceed the limits, and return them.

    The newest run is never deleted, nor is the newest complete one, nor one that is being written.
    Folders whose names and contents are not those of runs are ignored.

    Parameters
    ----------
    directory : Path
        The parent of the runs' folders.
    max_runs, max_bytes : int
        0 for no limit.
    """
    if not max_runs and not max_bytes:
        return []
    newest_first = runs_newest_first(directory)
    whole = [run for run in newest_first if run.suffix != PARTIAL]
    kept = newest_first[:1] + whole[:1]
    deleted = []
    count = size = 0
    for run in newest_first:
        # Another planner may record here, and delete or rename its runs at any time.
        with suppress(FileNotFoundError):
            size_of_run = bag_size(run)
            count += 1
            size += size_of_run
            too_much = (max_runs and count > max_runs) or (max_bytes and size > max_bytes)
            if run not in kept and too_much and not being_written(run):
                count -= 1
                size -= size_of_run
                shutil.rmtree(run)
                deleted.append(run)
    return deleted


def delete_leftovers(directory: Path) -> None:
    """Delete bags that were prepared for runs by planners that no longer exist."""
    for folder in directory.glob(f".*{PARTIAL}"):
        name = folder.name.removeprefix(".").removesuffix(PARTIAL)
        if not RUN_NAME.fullmatch(name) or folder.is_symlink():
            continue
        with suppress(FileNotFoundError):
            # An empty folder is about to be written.
            if any(folder.iterdir()) and not being_written(folder):
                shutil.rmtree(folder)


def runs_newest_first(directory: Path) -> list[Path]:
    """Return the folders with the names and contents of runs, including partial ones."""
    return sorted(_runs(directory), key=lambda run: run.name, reverse=True)


def _runs(directory: Path) -> Iterator[Path]:
    for folder in directory.iterdir():
        name = folder.name.removesuffix(PARTIAL)
        if not RUN_NAME.fullmatch(name) or not folder.is_dir() or folder.is_symlink():
            continue
        with suppress(FileNotFoundError):
            files = {file.name for file in folder.iterdir()}
            # An empty folder is about to be written.
            if files and files <= {f"{name}_0.mcap", METADATA}:
                yield folder
