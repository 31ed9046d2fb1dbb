# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.
"""CMA-ES: plans without a bound."""

from __future__ import annotations

import time

import cma
import numpy as np

from benchmarks.peers.choices import Choices, choices_of, total
from benchmarks.peers.found import Found, found_at
from benchmarks.peers.heuristics import greedy_cells
from focus_planner.core.arrays import FloatArray, IntArray
from focus_planner.core.problem.problem import Problem

_SPREAD = 0.1  # the first standard deviation, as a share of a camera's cells


def cma_es(problem: Problem, seconds: float, seed: int) -> Found:
    """Return the best plan of CMA-ES from greedy's.

    Where it settles it starts again, anywhere, with twice the population.

    A variable per camera: which of its cells, from 0, the first, to 1, the last.
    """
    until = time.perf_counter() + seconds
    choices, _ = choices_of(problem)
    cell = best = greedy_cells(choices)
    most = total(choices, cell)
    population, place = None, (cell + 0.5) / np.maximum(choices.cells, 1)
    while time.perf_counter() < until:
        options = {"bounds": [0, 1], "seed": seed, "verbose": -9}
        if population is not None:
            options["popsize"] = population
        search = cma.CMAEvolutionStrategy(place.clip(0, 1), _SPREAD, options)
        while not search.stop() and time.perf_counter() < until:
            places = search.ask()
            cells = [_cells_at(choices, each) for each in places]
            gained = [total(choices, each) for each in cells]
            search.tell(places, [-float(each) for each in gained])
            if max(gained) > most:
                most = max(gained)
                best = cells[gained.index(most)]
        population, seed = 2 * search.popsize, seed + 1
        place = np.random.default_rng(seed).random(len(cell))
    return found_at(problem, best)


def _cells_at(choices: Choices, place: FloatArray) -> IntArray:
    count = choices.cells
    return np.minimum((place * count).astype(np.int32), count - 1)
