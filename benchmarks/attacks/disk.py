# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A full disk, and things in the folder of runs that are none: no good run is lost."""

from __future__ import annotations

import os
import resource
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

from rich.console import Console

from benchmarks.attacks.table import Attack, Seen, attack, report
from benchmarks.attacks.victim import PATIENCE, Victim, command, until, victim
from benchmarks.processes import family
from testing.made_up_runs import run_id
from testing.ros.recorded import whole

_GOOD, _FAILED = 10, 15
_DISK_MIB = 8
# Bytes that a file may have where no file system could be made full: no run fits.
_FILE_SIZE = 2_000


def run(console: Console) -> bool:
    """Print the table; return whether all attacks held."""
    things = [
        Attack(
            f"FIFOs, links and folders among the runs {when}, some with a run's name",
            "planning, recording and retention go on, and they are left alone",
            partial(_foreign, when == "at its start"),
        )
        for when in ("at its start", "later")
    ]
    return report(console, "2. Retention never costs a good run", [full_disk, *things])


@attack(
    f"{_GOOD} good runs, record_max_runs {_GOOD}, {_FAILED} plans on a full disk, one with room",
    f"{_GOOD} whole runs are left, all replay; no failed beginning; every plan was answered, and"
    " only what is whole was called recorded",
)
def full_disk(folder: Path) -> Seen:
    """Fill the disk while a node records."""
    with _disk(folder / "disk") as disk:
        runs = disk.folder / "runs"
        with victim(folder, record_directory=runs, record_max_runs=_GOOD) as one:
            for _ in range(_GOOD):
                _plan_recorded(one, runs)
            disk.fill(one)
            ids = [one.check_plan() for _ in range(_FAILED)]
            disk.make_room(one)
            # The next one may still meet what the last one left.
            _plan_recorded(one, runs)
            log = one.node.log
        kept = whole(runs)
        others = [path.name for path in runs.iterdir() if path.name not in kept]
        replayed = command("replay", runs, "--quiet", seconds=120)
        said = sum(f"recorded as {plan_id}" in log for plan_id in ids)
    observed = (
        f"{len(kept)} whole runs, {len(others)} other folders, replay ends with"
        f" {replayed.status}; on the full disk {log.count('not recorded')} lines said 'not"
        f" recorded' of {_FAILED} plans, {said} said the opposite; disk: {disk.kind}"
    )
    held = len(kept) == _GOOD and not others and replayed.status == 0 and not said
    return Seen(observed, held and log.count("not recorded") > 0, _FAILED)


def _foreign(at_start: bool, folder: Path) -> Seen:
    """Put what is no run where the runs are."""
    runs = folder / "runs"
    runs.mkdir()
    made = list(_made_foreign(runs)) if at_start else []
    with victim(folder, start=PATIENCE, record_directory=runs, record_max_runs=3) as one:
        made = made or list(_made_foreign(runs))
        for _ in range(6):
            _plan_recorded(one, runs)
        log = one.node.log
    ours = [name for name in whole(runs) if runs / name not in made]
    left = [path.name for path in made if os.path.lexists(path)]
    observed = (
        f"{len(ours)} whole runs of 3, {len(left)} of {len(made)} foreign things left;"
        f" {log.count('not recorded')} lines said 'not recorded'"
    )
    return Seen(observed, len(ours) == 3 and len(left) == len(made), len(made))


def _made_foreign(runs: Path) -> Iterator[Path]:
    """Make things that are no runs; some are older than any run, others newer than all."""
    for number, year in enumerate((2001, 2099)):
        for kind, suffix in enumerate(("", ".partial")):
            name = f"{year}0102T030405.{number:06d}Z-0123ab{kind:02d}{suffix}"
            os.mkfifo(runs / name)
            yield runs / name
            os.mkfifo(runs / f".{name}.partial")
            yield runs / f".{name}.partial"
    within = runs / run_id(7)
    within.mkdir()
    os.mkfifo(within / f"{run_id(7)}_0.mcap")
    yield within
    link = runs / run_id(8)
    link.symlink_to("/proc")
    yield link
    os.mkfifo(runs / "metadata.yaml")
    yield runs / "metadata.yaml"


def _plan_recorded(one: Victim, runs: Path) -> None:
    """Plan until a whole run is there; its name is that of the plan."""
    plan_id = one.check_plan()
    until((runs / plan_id / "metadata.yaml").exists, f"{plan_id} was not recorded")


class _Disk:
    """A small disk that can be filled, or a limit of the size of files."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.kind = "files limited in size"
        self._filling = folder / "filling"
        made = subprocess.run(  # noqa: S603
            ["mount", "-t", "tmpfs", "-o", f"size={_DISK_MIB}m", "none", str(folder)],  # noqa: S607
            check=False,
            capture_output=True,
        )
        self.is_mounted = made.returncode == 0
        if self.is_mounted:
            self.kind = f"a tmpfs of {_DISK_MIB} MiB"

    def fill(self, one: Victim) -> None:
        if not self.is_mounted:
            self._limit(one, _FILE_SIZE)
            return
        with self._filling.open("wb", buffering=0) as file:
            try:
                while True:
                    file.write(bytes(4096))
            except OSError:
                return

    def make_room(self, one: Victim) -> None:
        if self.is_mounted:
            self._filling.unlink()
        else:
            self._limit(one, resource.RLIM_INFINITY)

    @staticmethod
    def _limit(one: Victim, size: int) -> None:
        for pid in family(one.node.pid):
            hard = resource.prlimit(pid, resource.RLIMIT_FSIZE)[1]
            resource.prlimit(pid, resource.RLIMIT_FSIZE, (size, hard))


@contextmanager
def _disk(folder: Path) -> Iterator[_Disk]:
    folder.mkdir()
    disk = _Disk(folder)
    try:
        yield disk
    finally:
        if disk.is_mounted:
            subprocess.run(["umount", "-l", str(folder)], check=False)  # noqa: S603, S607
