# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Damaged runs: replayed, and found by a node that starts."""

from __future__ import annotations

import shutil
import struct
import time
from collections.abc import Iterator
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any
from zlib import crc32

import numpy as np
import zstandard
from rich.console import Console

from benchmarks.attacks.victim import Victim, new_name, until, victim
from benchmarks.fuzz.command_line import Case, run_all
from benchmarks.fuzz.damage import altered, damaged
from benchmarks.guarantees import Outcome, own_graph, report
from benchmarks.options import options
from testing.made_up_runs import record_ends
from testing.ros.recorded import whole

_BAGS = Path(__file__).parents[2] / "bags"
_SOURCES = ("mesh_em", "cloud_own_points", "mixed_rig", "failed_rig", "lens_tables")
_CHUNK = 6
# How many there are of a start's folder; a node looks at so many at most.
_AT_START = 500
_START = 120.0


def run(console: Console) -> bool:
    """Print the table; return whether all guarantees held."""
    with own_graph() as folder:
        tests = [partial(_replayed, folder), partial(_at_start, folder)]
        return report(console, "Damaged runs", tests)


def _replayed(folder: Path) -> Outcome:
    """Replay every damaged run."""
    began, count = time.perf_counter(), options().count
    counts, faults = run_all(_cases(folder / "replayed", count), _judge)
    told = ", ".join(f"{number:,} {name}" for name, number in counts.most_common())
    result = (
        f"{told}; {1000 * (time.perf_counter() - began) / count:.0f} ms each;"
        f" {'; '.join(faults[:5])}"
    )
    return Outcome("damaged runs, replayed", counts.total(), result, not faults)


def _judge(answer: dict[str, Any]) -> str:
    return {0: "reproduced", 1: "differ", 2: "unreadable"}[answer["status"]]


def _cases(folder: Path, count: int) -> Iterator[Case]:
    random = np.random.default_rng(options().seed)
    for number in range(count):
        made = _damaged_run(folder / f"run_{number}", number, random)
        yield Case(["replay", str(made), "--quiet"], made)
        # By now the one that was given before it has been answered.
        if number > 10:
            shutil.rmtree(folder / f"run_{number - 10}", ignore_errors=True)


def _damaged_run(folder: Path, number: int, random: np.random.Generator) -> Path:
    source = _BAGS / _SOURCES[number % len(_SOURCES)]
    (file,) = source.glob("*.mcap")
    folder.mkdir(parents=True)
    data, metadata = file.read_bytes(), (source / "metadata.yaml").read_bytes()
    kind = number % 10
    if kind < 6:
        data = _with_damaged_chunk(data, random)
    elif kind < 9:
        data = damaged(data, random)
    else:
        metadata = damaged(metadata, random)
    (folder / file.name).write_bytes(data)
    (folder / "metadata.yaml").write_bytes(metadata)
    return folder


def _with_damaged_chunk(data: bytes, random: np.random.Generator) -> bytes:
    """Damage the messages within a chunk, whose checksum is right."""
    ends = record_ends(data)
    chunks = [(start, end) for start, end in pairwise(ends) if data[start] == _CHUNK]
    start, end = chunks[random.integers(len(chunks))]
    content = data[start + 9 : end]
    name_ends = 28 + 4 + struct.unpack_from("<I", content, 28)[0]
    packed = content[name_ends + 8 :]
    # Half of the time records keep their lengths, so that messages are read.
    change = altered if random.integers(2) else damaged
    records = change(zstandard.ZstdDecompressor().decompress(packed, 2**28), random)
    packed = zstandard.ZstdCompressor().compress(records)
    head = content[:16] + struct.pack("<QI", len(records), crc32(records)) + content[28:name_ends]
    content = head + struct.pack("<Q", len(packed)) + packed
    return data[:start] + struct.pack("<BQ", _CHUNK, len(content)) + content + data[end:]


def _at_start(folder: Path) -> Outcome:
    """Start nodes among damaged runs newer than the good one."""
    count, random, began = options().count, np.random.default_rng(options().seed), time.time()
    starts, slowest = 0, 0.0
    name, runs = new_name("recovered"), folder / "runs"
    with victim(name=name, record_directory=runs) as one:
        good = _good_run(one, runs)
        shutil.copytree(runs / good, folder / "source")
    while starts * _AT_START < count:
        made = _make_damaged(runs, folder / "source", min(_AT_START, count), random)
        since = time.perf_counter()
        with victim(name=name, start=_START, record_directory=runs) as one:
            slowest = max(slowest, time.perf_counter() - since)
            in_force = one.client.status().plan_id
            assert in_force, "no plan is in force again"
            _good_run(one, runs)
        for path in made:
            shutil.rmtree(path, ignore_errors=True)
        starts += 1
    result = (
        f"a plan in force again, and the good plan made, after each of {starts} starts, the"
        f" slowest after {slowest:.1f} s; {time.time() - began:.0f} s in all"
    )
    what = "damaged runs, found by a node that starts"
    return Outcome(what, starts * min(_AT_START, count), result, kept=True)


def _good_run(one: Victim, runs: Path) -> str:
    """Have the good plan recorded; return its id."""
    plan_id = one.check_plan()
    until(lambda: plan_id in whole(runs), "the good run was not recorded")
    return plan_id


def _make_damaged(runs: Path, source: Path, count: int, random: np.random.Generator) -> list[Path]:
    """Put damaged copies of the good run beside it, newer than it."""
    (file,) = source.glob("*.mcap")
    data, metadata = file.read_bytes(), (source / "metadata.yaml").read_bytes()
    made = []
    for number in range(count):
        name = f"20990102T030405.{number:06d}Z-{int(random.integers(2**32)):08x}"
        path = runs / (name if number % 4 else f"{name}.partial")
        path.mkdir()
        make = _with_damaged_chunk if number % 2 else damaged
        (path / f"{name}_0.mcap").write_bytes(make(data, random))
        if number % 4:
            whole_one = number % 3
            (path / "metadata.yaml").write_bytes(
                metadata if whole_one else damaged(metadata, random)
            )
        made.append(path)
    return made
