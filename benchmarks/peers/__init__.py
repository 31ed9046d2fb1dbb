# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.
"""Other solvers beside ours, at equal time on the same ``problem.npz``: ``ARGS=peers``.

Greedy, coordinate descent with restarts, simulated annealing, CMA-ES, CP-SAT and HiGHS, then our
own methods with a tight bound. All that can begin with a plan are given greedy's. Every plan is
judged by the planner's own cost function. ``--seconds`` is the time of each, ``--samples`` are the
sizes. The subjects are the first body and a machine part of ``shapes``.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

from rich.console import Console

from benchmarks.options import options
from benchmarks.peers.problem_file import load_problem
from benchmarks.peers.racing import PEERS, race
from benchmarks.peers.tables import Row, peer_table
from benchmarks.scenes import body_scenes, problem
from focus_planner import Scene
from focus_planner.core.validation import InputError, check_number, check_whole
from focus_planner.io.problems import save_problem
from shapes.parts import part

_SAMPLES = (1000, 8192)
_PART = 1  # a bracket
_MOST_SECONDS = 86_400


def run(console: Console) -> bool:
    """Print a table per problem; return whether the options made sense."""
    try:
        samples, seconds = _chosen()
    except InputError as error:
        console.print(f"peers: {error}", highlight=False, markup=False)
        return False
    for subject, scene in _subjects():
        for count in samples:
            rows = _rows(scene, count, seconds)
            load = f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores"
            title = f"{subject}, {count:,} samples; {seconds:g} s each at most; {load}"
            console.print(peer_table(rows, title))
    return True


def _chosen() -> tuple[list[int], float]:
    samples = options().samples or list(_SAMPLES)
    for count in samples:
        check_whole("--samples", count, 1, 2**31 - 1)
    check_number("--seconds", options().seconds, above=0, at_most=_MOST_SECONDS)
    return samples, options().seconds


def _subjects() -> Iterator[tuple[str, Scene]]:
    yield next(iter(body_scenes().items()))
    yield f"part {_PART}", Scene(part(_PART))


def _rows(scene: Scene, samples: int, seconds: float) -> list[Row]:
    """Return what each peer finds."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "problem.npz"
        save_problem(problem(scene, samples), path)
        judge = load_problem(path)
        rows = []
        for peer in PEERS:
            found, taken = race(peer, path, seconds, options().seed)
            rows.append(Row(peer, judge.cost(found.focus_distances), found.lower_bound, taken))
    return rows
