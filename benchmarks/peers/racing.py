# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.
"""A peer at work on ``problem.npz``, in a process of its own.

Otherwise libraries of one would be in the way of another's, and what one left in memory too.
"""

from __future__ import annotations

import time
from concurrent.futures import ProcessPoolExecutor
from importlib import import_module
from multiprocessing import get_context
from pathlib import Path

from benchmarks.peers.found import Found
from benchmarks.peers.problem_file import load_problem
from focus_planner.core.planning.formulation import subsample

#: What each is called, and its function of a problem, seconds and a seed.
PEERS = {
    "greedy": "heuristics.greedy",
    "coordinate descent": "heuristics.coordinate_descent",
    "simulated annealing": "heuristics.simulated_annealing",
    "CMA-ES": "cma_es.cma_es",
    "CP-SAT, 2 workers": "cp_sat.cp_sat",
    "HiGHS": "highs.highs",
    "em": "ours.em",
    "k_view": "ours.k_view",
    "optimal": "ours.optimal",
}
_FEW, _AT_FIRST = 100, 0.1  # samples, seconds


def race(peer: str, path: Path, seconds: float, seed: int) -> tuple[Found, float]:
    """Return what a peer finds in a time, and how long it really took."""
    with ProcessPoolExecutor(1, get_context("spawn")) as process:
        return process.submit(_solve, PEERS[peer], path, seconds, seed).result()


def _solve(place: str, path: Path, seconds: float, seed: int) -> tuple[Found, float]:
    module, _, name = place.partition(".")
    solve = getattr(import_module(f"benchmarks.peers.{module}"), name)
    problem = load_problem(path)
    solve(subsample(problem, _FEW, seed), _AT_FIRST, seed)  # compiles, or loads, what it runs
    began = time.perf_counter()
    found = solve(problem, seconds, seed)
    return found, time.perf_counter() - began
