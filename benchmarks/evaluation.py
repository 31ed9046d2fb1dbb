# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What it costs to run experiments on Dask, and how long many subjects take on many cores.

Table 1 of the paper on two workers beside a plain loop of one thread; the overhead of a task; what
it takes to send a surface. From these follows what 400 bodies in 100 settings take on more cores
than there are here: the longest of three that go on at once, the workers' computing, the
scheduler's work for every task, and this process' for every surface.
"""

from __future__ import annotations

import multiprocessing
import os
import pickle
import tempfile
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

from rich.console import Console
from rich.table import Table

from benchmarks.scenes import rig
from benchmarks.timing import timed
from focus_planner.core.planning.precompile import precompile
from focus_planner.core.planning.work import PLANS
from focus_planner.evaluation.experiment import (
    Conditions,
    Experiment,
    Measured,
    Row,
    each_subject,
)
from focus_planner.evaluation.experiments import EXPERIMENTS
from focus_planner.evaluation.results.store import opened
from focus_planner.evaluation.running import running
from focus_planner.evaluation.running.connecting import local_cluster
from focus_planner.evaluation.running.here import Here
from focus_planner.evaluation.running.running import Workers
from focus_planner.evaluation.subject import Subject
from focus_planner.io.bodies import bodies
from focus_planner.io.surfaces import load_surface

_WORKERS = 2
_SUBJECTS = 48
_EMPTY_TASKS = 500
_BODIES, _SETTINGS = 400, 100
_CORES = (16, 64, 256)
_ASKED = 0.9
_TABLE1 = EXPERIMENTS["table1"]
_CONDITIONS = Conditions()


@dataclass(frozen=True)
class _Body:
    """A body's file, by one of several names."""

    name: str
    path: Path

    @property
    def digest(self) -> str:
        return self.name

    def pack(self) -> _Packed:
        return _Packed(Subject(self.name, load_surface(self.path), rig()))


@dataclass(frozen=True)
class _Packed:
    subject: Subject

    def unpack(self) -> Subject:
        return self.subject


def run(console: Console) -> None:
    """Print the tables."""
    sources = _sources(_SUBJECTS)
    with tempfile.TemporaryDirectory() as folder:
        loop, two_loops = _loops_elsewhere(Path(folder), sources)
        steady, overhead = _on_workers(Path(folder), sources)
    seconds = steady.seconds / len(sources)
    send, nbytes = _sending(sources[0])
    _print_efficiency(console, loop, two_loops, steady)
    _print_overhead(console, overhead, send, nbytes)
    _print_model(console, seconds, overhead, send)


def _sources(count: int) -> list[_Body]:
    folder = os.environ.get("BODIES")
    paths = sorted(Path(folder).glob("*.ply")) if folder else bodies()
    return [_Body(f"{number}", paths[number % len(paths)]) for number in range(count)]


# --- runs ----------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Run:
    """How long a run took, and its tasks in all, seconds; and that with what comes before."""

    wall: float
    seconds: float
    with_start: float = 0.0


def _run(folder: Path, experiment: Experiment, sources: Sequence[_Body], where: Workers) -> _Run:
    with opened(folder, _CONDITIONS, sources) as store:
        began = time.perf_counter()
        outcome = running.run(experiment, sources, _CONDITIONS, store, where)
        wall = time.perf_counter() - began
    assert outcome.done == outcome.total, outcome.failures
    return _Run(wall, float(outcome.file.results(_CONDITIONS).seconds["task_seconds"].sum()))


def _loop(folder: Path, sources: Sequence[_Body]) -> _Run:
    began = time.perf_counter()
    precompile(PLANS)
    found = _run(folder, _TABLE1, sources, Here())
    return replace(found, with_start=time.perf_counter() - began)


def _loops_elsewhere(folder: Path, sources: Sequence[_Body]) -> tuple[_Run, float]:
    """Run the loop alone, then two of them, with half of the subjects each, side by side.

    In processes whose kernels and rays have one thread, as those of workers have. Return the first,
    and the seconds until both of the others were done: what two cores have to give.
    """
    os.environ["NUMBA_NUM_THREADS"] = "1"
    try:
        with ProcessPoolExecutor(_WORKERS, multiprocessing.get_context("spawn")) as processes:
            for ready in [processes.submit(precompile, PLANS) for _ in range(_WORKERS)]:
                ready.result()
            alone = processes.submit(_loop, folder / "loop", sources).result()
            halves = [
                processes.submit(_loop, folder / f"half_{n}", sources[n::_WORKERS])
                for n in range(_WORKERS)
            ]
            return alone, max(half.result().wall for half in halves)
    finally:
        del os.environ["NUMBA_NUM_THREADS"]


def _on_workers(folder: Path, sources: Sequence[_Body]) -> tuple[_Run, float]:
    began = time.perf_counter()
    with local_cluster(_WORKERS) as where:
        _run(folder / "first", _TABLE1, sources[:_WORKERS], where)  # which loads kernels
        steady = _run(folder / "steady", _TABLE1, sources, where)
        steady = replace(steady, with_start=time.perf_counter() - began)
        empty = _run(folder / "empty", _EMPTY, sources[:_WORKERS], where)
    return steady, empty.wall / _EMPTY_TASKS


def _nothing(*_: Sequence[Subject] | Row | Conditions) -> Measured:
    return Measured([{"value": 0.0}])


_EMPTY = replace(
    _TABLE1,
    name="empty",
    measure=_nothing,
    tasks=each_subject(*({"setting": each} for each in range(_EMPTY_TASKS // _WORKERS))),
)


def _sending(source: _Body) -> tuple[float, int]:
    """Return the seconds that this process needs for a surface, and its bytes."""
    seconds, data = timed(lambda: pickle.dumps(source.pack()))
    return seconds, len(data)


# --- tables --------------------------------------------------------------------------------------


def _print_efficiency(console: Console, loop: _Run, two_loops: float, steady: _Run) -> None:
    table = Table("what", "asked", "measured", title=f"Table 1, {_SUBJECTS} bodies, two workers")
    table.add_row("a plain loop of one thread, s", "", f"{loop.wall:.1f}")
    table.add_row("two such loops side by side, half of it each, s", "", f"{two_loops:.1f}")
    table.add_row("two workers, s", "", f"{steady.wall:.1f}")
    efficiency = loop.wall / (_WORKERS * steady.wall)
    table.add_row("efficiency", f"at least {_ASKED}", f"{efficiency:.2f}")
    table.add_row("efficiency beside the two loops", "", f"{two_loops / steady.wall:.2f}")
    with_start = loop.with_start / (_WORKERS * steady.with_start)
    table.add_row("the same with start-up and loading of kernels", "", f"{with_start:.2f}")
    within = steady.seconds / (_WORKERS * steady.wall)
    table.add_row("share of the workers' time within tasks", "", f"{within:.2f}")
    console.print(table)


def _print_overhead(console: Console, overhead: float, send: float, nbytes: int) -> None:
    table = Table("what", "measured", title="What it takes beside measuring")
    table.add_row("a task that does nothing, ms", f"{1e3 * overhead:.1f}")
    table.add_row("packing a surface, ms", f"{1e3 * send:.0f}")
    table.add_row("its size, MB", f"{nbytes / 1e6:.1f}")
    console.print(table)


def _print_model(console: Console, seconds: float, overhead: float, send: float) -> None:
    tasks = _BODIES * _SETTINGS
    table = Table(
        "cores",
        "computing, min",
        "scheduling, min",
        "sending, min",
        "the longest of them, min",
        title=f"{_BODIES} bodies, {_SETTINGS} settings of {seconds:.2f} s each, as it follows",
    )
    for cores in _CORES:
        parts = (tasks * seconds / cores, tasks * overhead, _BODIES * send)
        table.add_row(f"{cores}", *(f"{part / 60:.1f}" for part in (*parts, max(parts))))
    console.print(table)
