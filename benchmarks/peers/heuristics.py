# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.
"""Greedy, coordinate descent with restarts, simulated annealing: plans without a bound.

The latter two start from greedy's plan.
"""

from __future__ import annotations

import time

import numpy as np

from benchmarks.peers import choices as kernels
from benchmarks.peers.choices import Choices, choices_of
from benchmarks.peers.found import Found, found_at
from focus_planner.core.arrays import IntArray, Offsets
from focus_planner.core.problem.problem import Problem

_STEPS = 20_000  # of annealing between looks at the clock
# The first temperature as a share of what a random move from greedy's plan loses on average, and
# the last as a share of the first: the best of a few that were tried.
_HOT, _COLD = 1.0, 3e-4
_MOVES = 1000


def greedy(problem: Problem, seconds: float, seed: int) -> Found:  # noqa: ARG001
    """Return the plan that takes the cell that adds most, camera after camera."""
    return found_at(problem, greedy_cells(choices_of(problem)[0]))


def greedy_cells(choices: Choices) -> IntArray:
    """Return the same as (C,) cells."""
    cell = np.empty(len(choices.cells), dtype=np.int32)
    kernels.greedy(choices, cell, _room(choices))
    return cell


def coordinate_descent(problem: Problem, seconds: float, seed: int) -> Found:
    """Return the best of descents, the first from greedy's plan, the others from random ones."""
    until = time.perf_counter() + seconds
    choices, _ = choices_of(problem)
    random = np.random.default_rng(seed)
    cell = best = greedy_cells(choices)
    most = -1
    while True:
        kernels.descend(choices, cell, _room(choices))
        gained = kernels.total(choices, cell)
        if gained > most:
            best, most = cell, gained
        if time.perf_counter() > until:
            return found_at(problem, best)
        cell = _random_plan(choices, random)


def simulated_annealing(problem: Problem, seconds: float, seed: int) -> Found:
    """Return the best plan of one slow cooling, by the clock, descended from."""
    started = time.perf_counter()
    random = np.random.default_rng(seed)
    choices, _ = choices_of(problem)
    cell = greedy_cells(choices)
    hot = _HOT * _usual_loss(choices, cell, random)
    best, gained = cell.copy(), kernels.total(choices, cell)
    most, share = gained, 0.0
    while share < 1:
        temperature = hot * _COLD**share
        gained, most = kernels.anneal(
            choices, cell, best, gained, most, temperature, _STEPS, random
        )
        share = (time.perf_counter() - started) / seconds
    kernels.descend(choices, best, _room(choices))
    return found_at(problem, best)


def _room(choices: Choices) -> Offsets:
    return np.empty(int(choices.cells.max()) + 1, dtype=np.int64)


def _random_plan(choices: Choices, random: np.random.Generator) -> IntArray:
    count = choices.cells
    return np.where(count > 0, random.integers(0, np.maximum(count, 1)), -1).astype(np.int32)


def _usual_loss(choices: Choices, cell: IntArray, random: np.random.Generator) -> float:
    """Return what a random move of one camera loses on average, units."""
    other = _random_plan(choices, random)
    moved = random.integers(0, len(cell), _MOVES)
    changes = [kernels.change(choices, c, cell, other[c]) for c in moved]
    return -float(np.minimum(changes, 0).mean())
