# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Slow, obvious oracles for limited pictures: in whole units, and by HiGHS.

A choice of cells has ``NO_PICTURE`` for shots that are not taken, and -1 for those of cameras that
can focus on nothing. They take the cells of a ``Problem`` as given, and use nothing else of the
core.
"""

from __future__ import annotations

import itertools

import numpy as np
from scipy.optimize import Bounds, LinearConstraint, milp
from scipy.sparse import coo_array

from focus_planner.core.kernels import NO_PICTURE


def _views(problem, p):
    """Return a pair of sample p with each camera of the rig that sees it, by that camera."""
    pairs = range(problem.sample_offsets[p], problem.sample_offsets[p + 1])
    return {int(problem.camera_index[r]) // problem.shots: r for r in reversed(pairs)}


def cell_counts(problem):
    """Return how many cells each camera of the rig has."""
    return np.diff(problem.cells.offsets)[:: problem.shots].tolist()


def choices(problem, images):
    """Yield every choice of cells with at most so many pictures, shots of a camera ascending."""
    brackets = []
    for count in cell_counts(problem):
        cells = range(count) if count else [-1]
        brackets.append(
            [
                (*some, *[NO_PICTURE] * (problem.shots - k))
                for k in range(problem.shots + 1)
                for some in itertools.combinations_with_replacement(cells, k)
            ]
        )
    for chosen in itertools.product(*brackets):
        cell = tuple(itertools.chain.from_iterable(chosen))
        if sum(each != NO_PICTURE for each in cell) <= images:
            yield cell


def plan_units(problem, cell):
    """Return what choices of cells (..., C) cost: of each sample the sum of its cheapest views."""
    cells, cell = problem.cells, np.asarray(cell)
    total = np.zeros(cell.shape[:-1], dtype=np.int64)
    for p in range(len(cells.unseen)):
        missing = np.full_like(total, cells.unseen[p])
        costs = [missing] * problem.views
        for camera, r in _views(problem, p).items():
            shots = cell[..., camera * problem.shots : (camera + 1) * problem.shots]
            taken = shots != NO_PICTURE
            sharp = (taken & (cells.first[r] <= shots) & (shots <= cells.last[r])).any(axis=-1)
            cost = cells.base[r] + np.where(sharp, 0, int(cells.focus[p]))
            costs.append(np.where(taken.any(axis=-1), cost, missing))
        total += np.sort(costs, axis=0)[: problem.views].sum(axis=0)
    return total


def least_units(problem, images):
    """Return what the best choice costs, by trying them all."""
    return int(plan_units(problem, list(choices(problem, images))).min())


def priced_units(problem, images, price):
    """Return what prices (N,) prove that no plan costs less than, from the definition.

    A sample pays its price for each view that it needs, and a view asks for what it costs less than
    a missing one, less the price. Pictures go to cameras, as many as there are, so that those ask
    for most, of all ways to share them out.
    """
    cells = problem.cells
    proven, asks = 0, {}
    for p in range(len(cells.unseen)):
        missing, v = int(cells.unseen[p]), int(price[p])
        proven += problem.views * (missing - v)
        for camera, r in _views(problem, p).items():
            sharp = max(missing - int(cells.base[r]) - v, 0)
            blurred = max(missing - int(cells.base[r]) - int(cells.focus[p]) - v, 0)
            ends = int(cells.first[r]), int(cells.last[r])
            asks.setdefault(camera, []).append((*ends, sharp, blurred))
    counts = cell_counts(problem)
    # What so many pictures of the cameras so far ask for at most.
    most = [0] * (images + 1)
    for camera, asked in asks.items():
        own = [0]
        for k in range(1, problem.shots + 1):
            sets = itertools.combinations_with_replacement(range(counts[camera]), k)
            own.append(
                max(
                    sum(
                        sharp if any(first <= cell <= last for cell in chosen) else blurred
                        for first, last, sharp, blurred in asked
                    )
                    for chosen in (sets if counts[camera] else [()])
                )
            )
        most = [
            max(most[b - k] + own[k] for k in range(min(b, problem.shots) + 1))
            for b in range(images + 1)
        ]
    return proven - most[images]


def optimum(problem, images, *, relaxed=False):
    """Return the least cost, or that of the linear relaxation, by HiGHS.

    x chooses pictures: cells, or none where a camera has none; at most as many of a camera as it
    takes shots, and as there may be. y and z are the views that a sample has in and out of focus:
    none without a picture, together at most one in each camera and as many as it needs.
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

    chosen = [[variable(0.0) for _ in range(max(count, 1))] for count in cell_counts(problem)]
    for of_camera in chosen:
        at_most(problem.shots, [(x, 1) for x in of_camera])
    at_most(images, [(x, 1) for of_camera in chosen for x in of_camera])
    choosing = len(objective)
    for p in range(len(weights)):
        had = []
        for camera, r in _views(problem, p).items():
            base = float(problem.base_cost[r])
            y, z = (variable(share[p] * (b - 1)) for b in (base, base + problem.focus_weight))
            holding = chosen[camera][cells.first[r] : cells.last[r] + 1]
            at_most(0, [(y, 1), *((x, -1) for x in holding)])
            at_most(0, [(y, 1), (z, 1), *((x, -1) for x in chosen[camera])])
            at_most(1, [(y, 1), (z, 1)])
            had += [(y, 1), (z, 1)]
        at_most(problem.views, had)
    rows, columns, values = zip(*entries, strict=True)
    matrix = coo_array((values, (rows, columns)), shape=(len(upper), len(objective)))
    whole = np.arange(len(objective)) < (0 if relaxed else choosing)
    result = milp(
        objective,
        integrality=whole.astype(int),
        bounds=Bounds(0, np.where(np.arange(len(objective)) < choosing, problem.shots, 1)),
        constraints=LinearConstraint(matrix.tocsr(), -np.inf, upper),
        options={"mip_rel_gap": 0.0},
    )
    assert result.success, result.message
    return 1000 + result.fun
