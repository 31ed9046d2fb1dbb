# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.
"""Slow, obvious oracles for several views per sample: in whole units, and by HiGHS.

They take the cells of a ``Problem`` as given, and use nothing else of the core.
"""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
from scipy.optimize import Bounds, LinearConstraint, milp
from scipy.sparse import coo_array

from focus_planner.core.problem.shots import with_shots
from testing.problems import TINY_LENSES, random_problem


def tiny_problem_in_views(seed, most_choices=300):
    """A random problem of 1 to 3 views and shots that is small enough to enumerate.

    Some have equal costs, samples that nobody sees, or a camera that can focus on nothing.
    """
    random = np.random.default_rng([seed, 17])
    while True:
        problem = random_problem(
            int(random.integers(2**32)),
            int(random.integers(1, 12)),
            int(random.integers(1, 6)),
            share=random.choice([0.3, 0.6, 1.0]),
            ties=random.random() < 0.3,
            equal=random.random() < 0.3,
            lens=TINY_LENSES[random.choice(5, p=[0.2, 0.1, 0.1, 0.1, 0.5])],
            weight=random.choice([1 / 3, 0.1], p=[0.8, 0.2]),
        )
        if random.random() < 0.2:
            blind = problem.camera_index == random.integers(problem.camera_count)
            problem.focus_near[blind], problem.focus_far[blind] = np.inf, -np.inf
        shots, views = random.choice([1, 2, 3], 2, p=[0.5, 0.3, 0.2])
        problem = dataclasses.replace(with_shots(problem, int(shots)), views=int(views))
        if choice_count(problem) <= most_choices:
            return problem


def choice_count(problem):
    """Return how many choices of a cell for each camera there are."""
    return np.prod(np.maximum(np.diff(problem.cells.offsets), 1.0))


def choices(problem):
    """Yield every choice of a cell for each camera, -1 where it has none."""
    counts = np.diff(problem.cells.offsets)
    return itertools.product(*(range(count) if count else [-1] for count in counts))


def _views(problem, p):
    """Return the pairs of sample p, a list for each camera of the rig that sees it."""
    views = {}
    for r in range(problem.sample_offsets[p], problem.sample_offsets[p + 1]):
        views.setdefault(int(problem.camera_index[r]) // problem.shots, []).append(r)
    return views


def plan_units(problem, cell):
    """Return what choices of cells (..., C) cost: of each sample the sum of its cheapest views."""
    cells, cell = problem.cells, np.asarray(cell)
    total = np.zeros(cell.shape[:-1], dtype=np.int64)
    for p in range(len(cells.unseen)):
        missing = np.full_like(total, cells.unseen[p])
        costs = [missing] * problem.views
        for shots in _views(problem, p).values():
            held = np.zeros(total.shape, dtype=bool)
            for r in shots:
                taken = cell[..., problem.camera_index[r]]
                held |= (cells.first[r] <= taken) & (taken <= cells.last[r])
            costs.append(cells.base[shots[0]] + np.where(held, 0, int(cells.focus[p])))
        if problem.views == 1 and len(costs) > 1:
            costs = costs[1:]  # whatever they are: it is not to be unseen
        total += np.sort(costs, axis=0)[: problem.views].sum(axis=0)
    return total


def least_units(problem):
    """Return what the best choice of cells costs, by trying them all."""
    return int(plan_units(problem, list(choices(problem))).min())


def priced_units(problem, price):
    """Return what prices (N,) prove that no plan costs less than, from the definition.

    A sample pays its price for each view that it needs, and a view asks for what it costs less
    than the last view with every camera out of focus, less the price. Every camera of the rig takes
    the cells that ask for most, of all sets of so many.
    """
    cells, proven = problem.cells, 0
    asks = {}  # camera of the rig → list of (first, last, in focus, out of focus)
    for p in range(len(cells.unseen)):
        views, v = _views(problem, p), int(price[p])
        out = [int(cells.base[shots[0]]) + int(cells.focus[p]) for shots in views.values()]
        if problem.views > 1 or not out:
            out += [int(cells.unseen[p])] * problem.views
        last_view = sorted(out)[problem.views - 1]
        proven += problem.views * (last_view - v)
        for camera, shots in views.items():
            base = int(cells.base[shots[0]])
            sharp = max(last_view - base - v, 0)
            blurred = max(last_view - base - int(cells.focus[p]) - v, 0)
            ends = int(cells.first[shots[0]]), int(cells.last[shots[0]])
            asks.setdefault(camera, []).append((*ends, sharp, blurred))
    for camera, asked in asks.items():
        count = np.diff(cells.offsets)[camera * problem.shots]
        sets = itertools.combinations_with_replacement(range(count), problem.shots)
        proven -= max(
            sum(
                sharp if any(first <= cell <= last for cell in chosen) else blurred
                for first, last, sharp, blurred in asked
            )
            for chosen in (sets if count else [()])
        )
    return proven


def optimum(problem, *, relaxed=False):
    """Return the least cost, or that of the linear relaxation, by HiGHS.

    x chooses cells, at most as many of a camera as it takes shots; y and z are the views that a
    sample has in and out of focus, together at most one in each camera and as many as it needs.
    """
    cells, weights = problem.cells, problem.samples.weights
    share = 1000 * weights / weights.sum() / problem.views
    objective, upper, entries = [], [], []

    def variable(coefficient):
        objective.append(coefficient)
        return len(objective) - 1

    def at_most(limit, terms):
        entries.extend((len(upper), column, value) for column, value in terms)
        upper.append(limit)

    chosen = {}
    counts = np.diff(cells.offsets)[:: problem.shots]
    for camera, count in enumerate(counts):
        chosen[camera] = [variable(0.0) for _ in range(count)]
        at_most(problem.shots, [(x, 1) for x in chosen[camera]])
    choosing = len(objective)
    for p in range(len(weights)):
        had = []
        for camera, shots in _views(problem, p).items():
            base = float(problem.base_cost[shots[0]])
            y, z = (variable(share[p] * (b - 1)) for b in (base, base + problem.focus_weight))
            holding = chosen[camera][cells.first[shots[0]] : cells.last[shots[0]] + 1]
            at_most(0, [(y, 1), *((x, -1) for x in holding)])
            at_most(1, [(y, 1), (z, 1)])
            had += [(y, 1), (z, 1)]
        at_most(problem.views, had)
    rows, columns, values = zip(*entries, strict=True)
    matrix = coo_array((values, (rows, columns)), shape=(len(upper), len(objective)))
    whole = np.arange(len(objective)) < (0 if relaxed else choosing)
    result = milp(
        objective,
        integrality=whole.astype(int),
        bounds=Bounds(0, 1),
        constraints=LinearConstraint(matrix.tocsr(), -np.inf, upper),
        options={"mip_rel_gap": 0.0},
    )
    assert result.success, result.message
    return 1000 + result.fun
