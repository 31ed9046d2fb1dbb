# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.
"""An earlier revision beside today's, stage by stage, in turns: ``ARGS=versus REV=3ec12f4``.

The earlier one is unpacked into ``build/versus`` and compiled there, once. If it cannot plan in
today's environment it gets one of its own: what its lock says, with a Python that it works with.
Each lives in a process of its own and runs one stage at a time, so that warm times are compared.
``--samples`` and ``--rounds`` make it shorter or longer.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing
from functools import partial
from pathlib import Path

from rich.console import Console

from benchmarks.options import options
from benchmarks.scenes import body_paths
from benchmarks.versus.process import EndedError, LackingError, Process
from benchmarks.versus.revisions import Revision, earlier, today
from benchmarks.versus.tables import Measured, in_a_line, ratio_table, stage_table
from benchmarks.versus.turns import Stage, Timings, take_turns
from focus_planner import PlanRequest
from focus_planner.core.validation import InputError, check_whole

_SAMPLES = (1000, 65_536)
_PROVEN_SAMPLES = 4096
_CAMERAS = (168, 2688)
_ROUNDS, _LONG_ROUNDS = 9, 5
_LONG = 10_000  # samples or more: fewer rounds do


def run(console: Console) -> bool:
    """Print the tables; return whether there were two revisions to compare."""
    surface = body_paths()[0].absolute()
    tell = partial(console.print, highlight=False, markup=False)
    try:
        revisions = earlier(options().rev, surface, tell), today()
        measured = _measured(revisions, surface, tell)
    except (InputError, EndedError) as error:
        tell(f"versus: {error}")
        return False
    name = revisions[0].name
    title = f"{name}, {revisions[0].environment}, and today's on {surface.stem}, in turns"
    console.print(stage_table(name, measured, title))
    console.print(ratio_table(name, measured))
    return True


def _stages(samples: tuple[int, ...]) -> Iterator[Stage]:
    """Yield all that is timed."""
    for key in ("formulate", "em", "k_view", "bound"):
        yield from (Stage(key, number) for number in samples)
    if (os.cpu_count() or 1) > 1:
        yield Stage("bound", samples[-1], threads=1)
    for key in ("plan", "plan_new_mesh"):
        yield from (Stage(key, number) for number in samples)
    yield Stage("command", samples[0])
    yield Stage("fresh", PlanRequest().fresh_samples)
    yield Stage("optimal", _PROVEN_SAMPLES)
    yield from (Stage("tuples", cameras) for cameras in _CAMERAS)


def _measured(
    revisions: tuple[Revision, Revision], surface: Path, tell: Callable[[str], object]
) -> Measured:
    """Return what every stage takes both, in turns."""
    measured: dict[Stage, Timings | str] = {}
    with ExitStack() as stack:
        usual = [_process(stack, each, surface, None) for each in revisions]
        for stage in _stages(_chosen_samples()):
            processes = usual
            if stage.threads is not None:
                processes = [_process(stack, each, surface, stage.threads) for each in revisions]
            try:
                measured[stage] = take_turns(processes, stage, _rounds(stage))
            except LackingError as error:
                measured[stage] = str(error)
            tell(in_a_line(stage, measured[stage]))
    return measured


def _process(stack: ExitStack, revision: Revision, surface: Path, threads: int | None) -> Process:
    process = Process(revision.python, revision.root, surface, threads)
    return stack.enter_context(closing(process))


def _chosen_samples() -> tuple[int, ...]:
    chosen = tuple(sorted(set(options().samples or _SAMPLES)))
    for number in chosen:
        check_whole("--samples", number, 1, 2**31 - 1)
    return chosen


def _rounds(stage: Stage) -> int:
    if options().rounds is not None:
        check_whole("--rounds", options().rounds, 1, 1000)
        return options().rounds
    return _LONG_ROUNDS if stage.number >= _LONG else _ROUNDS
