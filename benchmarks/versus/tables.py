# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.
"""What the turns of two revisions show."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from math import log

import numpy as np
from rich.table import Table

from benchmarks.versus.turns import Stage, Timings

#: Timings by stage, or why a revision cannot run it.
Measured = Mapping[Stage, Timings | str]
#: Every stage by its key: what it is called, and what its result is.
SHOWN = {
    "formulate": ("formulate: rays and cells", "pairs"),
    "fresh": ("judge on fresh samples", "cost"),
    "em": ("EM", "cost"),
    "k_view": ("2-view, from EM", "cost"),
    "bound": ("quick bound of a plan", "gap, %"),
    "plan": ("plan, inputs unchanged", "cost"),
    "plan_new_mesh": ("plan, new mesh", "cost"),
    "optimal": ("optimal, to 0.01 %", "cost"),
    "command": ("`focus_planner plan`, a process", "cost"),
    "tuples": ("pairs of cameras", "pairs"),
}


def in_a_line(stage: Stage, timings: Timings | str) -> str:
    """Return the medians of a stage, to see while others run."""
    what = f"{_called(stage)}, {_number(stage)}"
    if isinstance(timings, str):
        return f"{what}: {timings}"
    then, now = timings.medians
    return f"{what}: {then:.4f} s, today {now:.4f} s"


def stage_table(name: str, measured: Measured, title: str) -> Table:
    """Return a row per stage with the seconds of both revisions, or why there are none."""
    table = Table(
        *("stage", "samples", f"{name}, s", "least", "today, s", "least"),
        *("times faster", "middle half", "result", name, "today"),
        title=title,
    )
    for stage, timings in measured.items():
        row = _called(stage), _number(stage)
        if isinstance(timings, str):
            table.add_row(*row, *["–"] * 6, timings)
            continue
        seconds = zip(timings.medians, timings.least, strict=True)
        low, middle, high = timings.times_faster()
        table.add_row(
            *row,
            *(f"{each:.4f}" for both in seconds for each in both),
            *(f"{middle:.2f}", f"{low:.2f} – {high:.2f}"),
            *(SHOWN[stage.key][1], *(f"{each:,.6g}" for each in timings.results.mean(axis=0))),
        )
    return table


def ratio_table(name: str, measured: Measured) -> Table:
    """Return how stages of one revision compare with each other."""
    table = Table("within a revision, of medians and of leasts", *(name, "today"))
    for stage, base in _compared(measured):
        if isinstance(measured[stage], str) or isinstance(measured[base], str):
            continue
        ratios = [measured[stage].medians / measured[base].medians]
        ratios.append(measured[stage].least / measured[base].least)
        if stage.key == base.key == "tuples":
            ratios = [np.log(ratio) / log(stage.number / base.number) for ratio in ratios]
            what = f"{_called(stage)}: power of the number of cameras, {base.number:,} to "
            what += f"{stage.number:,}"
        else:
            what = f"{_called(stage)} ÷ {_called(base)}, {stage.number:,} samples"
        pairs = zip(*ratios, strict=True)
        table.add_row(what, *(f"{median:.2f}, {least:.2f}" for median, least in pairs))
    return table


def _compared(measured: Measured) -> Iterator[tuple[Stage, Stage]]:
    """Yield the stages that are compared with each other."""
    growing = [stage for stage in measured if stage.key == "tuples"]
    if len(growing) > 1:
        yield growing[-1], growing[0]
    for stage in measured:
        base = replace(stage, threads=None)
        if stage.threads is not None and base in measured:
            yield stage, base
        base = replace(stage, key="plan")
        if stage.key == "command" and base in measured:
            yield stage, base


def _called(stage: Stage) -> str:
    threads = "" if stage.threads is None else f", threads: {stage.threads}"
    return SHOWN[stage.key][0] + threads


def _number(stage: Stage) -> str:
    return f"{stage.number:,}" + (" cameras" if stage.key == "tuples" else "")
