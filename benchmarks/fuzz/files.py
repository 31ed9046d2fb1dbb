# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Damaged files of every kind that the command line reads."""

from __future__ import annotations

import shutil
import time
from collections import Counter
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from benchmarks.fuzz.command_line import Case, CommandLine, run_all
from benchmarks.fuzz.damage import damaged
from benchmarks.fuzz.good_files import kinds
from benchmarks.guarantees import Outcome, own_graph, report
from benchmarks.options import options


def run(console: Console) -> bool:
    """Print the table; return whether all guarantees held."""
    with own_graph() as folder:
        return report(console, "Damaged files", [partial(_files, folder)])


def _files(folder: Path) -> Outcome:
    """Have every damaged file read, the kinds in turn."""
    refused = _refused_good_files(folder)
    assert not refused, f"good files are refused: {refused}"
    began, count = time.perf_counter(), options().count
    counts, faults = run_all(_cases(folder, count), _judge)
    told = ", ".join(f"{number:,} {name}" for name, number in counts.most_common())
    by_kind = Counter(fault.partition("_")[2].partition(":")[0] for fault in faults)
    result = (
        f"{told}; {1000 * (time.perf_counter() - began) / count:.0f} ms each;"
        f" faults {dict(by_kind)}; {'; '.join(faults[:5])}"
    )
    what = f"damaged files of {len(kinds(folder / 'count'))} kinds"
    return Outcome(what, counts.total(), result, not faults)


def _judge(answer: dict[str, Any]) -> str:
    return {0: "used", 1: "used, and differ", 2: "refused"}[answer["status"]]


def _refused_good_files(folder: Path) -> list[str]:
    """Return which good files are refused: with those nothing would be learnt."""
    line, refused = CommandLine(), []
    for kind in kinds(folder / "check"):
        place = folder / "good" / kind.name
        place.mkdir(parents=True)
        path = place / kind.name
        path.write_bytes(kind.good)
        answer = line.run(kind.argv(path))
        if answer["fault"] or answer["status"] != 0:
            refused.append(f"{kind.name}: {answer['fault'] or answer['err']}")
    line.close()
    return refused


def _cases(folder: Path, count: int) -> Iterator[Case]:
    random, all_kinds = np.random.default_rng(options().seed), kinds(folder / "beside")
    for number in range(count):
        kind = all_kinds[number % len(all_kinds)]
        place = folder / "damaged" / f"{number}_{kind.name}"
        place.mkdir(parents=True)
        path = place / kind.name
        path.write_bytes(damaged(kind.good, random))
        yield Case(kind.argv(path), place)
        # By now the one that was given before it has been answered.
        for old in (folder / "damaged").glob(f"{number - 10}_*"):
            shutil.rmtree(old, ignore_errors=True)
