# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Hostile runs in ``record_directory``, and given to ``replay``."""

from __future__ import annotations

import re
import tempfile
import time
from functools import partial
from pathlib import Path

from rich.console import Console

from benchmarks.attacks import hostile_runs
from benchmarks.attacks.graph import heard
from benchmarks.attacks.table import Attack, Seen, attack, report
from benchmarks.attacks.victim import (
    PATIENCE,
    Victim,
    command,
    ended,
    kill,
    new_name,
    until,
    victim,
)
from benchmarks.guarantees import Node, arguments
from testing.ros.recorded import whole

_START = 30.0
# MiB: what a node, or a replay, takes that reads good runs is far below.
_MOST = 1500.0


def run(console: Console) -> bool:
    """Print the table; return whether all attacks held."""
    starts = [
        Attack(kind, "skipped and named in the log and in diagnostics", partial(_start_with, kind))
        for kind in hostile_runs.KINDS
    ]
    return report(
        console, "3. Recovery trusts nothing", [*starts, all_at_once, replays, failed_autostart]
    )


def _start_with(kind: str, folder: Path) -> Seen:
    """Start a node whose newest run is hostile: the one before is in force again."""
    name, runs = new_name("recovered"), folder / "runs"
    good = _good_run(name, runs)
    hostile = hostile_runs.write(kind, runs, f"/{name}")
    began = time.perf_counter()
    with victim(folder, name=name, start=_START, most=_MOST, record_directory=runs) as one:
        seconds = time.perf_counter() - began
        status = one.client.status()
        in_force = status.plan_id if status.from_record else ""
        told = hostile.name in one.node.log
        diagnosed = _is_diagnosed(one, hostile.name)
        one.check_plan()
        peak = one.watch.peak
    held = in_force == good and told and diagnosed
    # A whole run that only its metadata does not describe may count as one.
    held = held or ("metadata.yaml" in kind and in_force == hostile.name)
    observed = (
        f"active after {seconds:.1f} s, at most {peak:.0f} MiB; in force:"
        f" {'the good plan' if in_force == good else repr(in_force)};"
        f" {'named' if told else 'not named'} in the log,"
        f" {'named' if diagnosed else 'not named'} in diagnostics"
    )
    return Seen(observed, held)


@attack("all of them at once", "the good plan is in force again")
def all_at_once(folder: Path) -> Seen:
    """Start a node among all hostile runs."""
    name, runs = new_name("recovered"), folder / "runs"
    good = _good_run(name, runs)
    for number, kind in enumerate(hostile_runs.KINDS):
        at = Path(tempfile.mkdtemp(dir=folder))
        made = hostile_runs.write(kind, at, f"/{name}")
        new = made.name.replace("Z-0123abcd", f"Z-{number:08x}")
        if (file := made / f"{made.name}_0.mcap").exists():
            file.rename(made / f"{new}_0.mcap")
        made.rename(runs / new)
    with victim(folder, name=name, start=2 * _START, most=_MOST, record_directory=runs) as one:
        status = one.client.status()
        one.check_plan()
    held = status.from_record and status.plan_id == good
    return Seen(f"in force: {status.plan_id!r}, the good one is {good!r}", held, number + 1)


@attack(
    "replay of each of them",
    f"status 2 and no traceback, within {PATIENCE:.0f} s and {_MOST:.0f} MiB",
)
def replays(folder: Path) -> Seen:
    """Replay every hostile run by itself."""
    wrong = []
    for kind in hostile_runs.KINDS:
        run_folder = hostile_runs.write(kind, Path(tempfile.mkdtemp(dir=folder)), "/focus_planner")
        ran = command("replay", run_folder, "--quiet", most=_MOST)
        if ran.status != 2 or "Traceback" in ran.err:
            wrong.append(f"{kind}: {ran.told()}")
    held = not wrong
    return Seen("; ".join(wrong) or "all were refused", held, len(hostile_runs.KINDS))


@attack(
    "an autostart that fails, as no kernel runs on -3 threads",
    "the process ends by itself with a status other than 0, so that its supervisor acts",
)
def failed_autostart(folder: Path) -> Seen:
    """Start a node whose kernels cannot be loaded."""
    under = ["env", "NUMBA_NUM_THREADS=-3"]
    node = Node(new_name(), *arguments(fresh_samples=256), folder=str(folder), under=under)
    try:
        status = ended(node, 2 * PATIENCE)
    finally:
        kill(node)
    log = node.log.strip().splitlines()
    observed = f"status {status}, {log[-1][:200] if log else ''!r}"
    return Seen(observed, status not in {None, 0} and "Traceback" not in node.log)


def _good_run(name: str, runs: Path) -> str:
    """Have a node record a plan; return the plan's id."""
    with victim(name=name, record_directory=runs) as one:
        plan_id = one.check_plan()
        until(lambda: plan_id in whole(runs), "the good run was not recorded")
    return plan_id


def _is_diagnosed(one: Victim, text: str) -> bool:
    """Return whether diagnostics name something."""
    return any(re.search(re.escape(text), line) for line in heard(one.node.name))
