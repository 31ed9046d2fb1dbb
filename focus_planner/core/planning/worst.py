# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Plans whose worst subject is as good as can be.

The greatest of the subjects' costs is no less than any weighted mean of them. With multipliers
λ ≥ 0 that sum to 1, the least mean Σ λ·cost is a lower bound of the least worst cost, and a problem
like any other: the subjects' samples count by λ. Multipliers rise for subjects that cost more than
the mean, so that the next plan serves these better; see "Many subjects" in docs/algorithm.md.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from focus_planner.core.arrays import FloatArray
from focus_planner.core.brief import brief_repr
from focus_planner.core.planning.pacer import Pacer
from focus_planner.core.problem.joined import costs_of_subjects, reweighted
from focus_planner.core.problem.problem import Problem
from focus_planner.core.solvers import Options, Solution, Solver
from focus_planner.core.solvers.solution import fill_missing_distances

# Plans that are made at most. On bodies the worst cost and the means are then within 0.2 %.
_ROUNDS = 14
# How fast multipliers grow with a subject's excess cost, in the first round; later ones go more
# slowly. Of 4, 10 and 20 on six bodies the last came closest to the bound.
_RATE = 20.0
# A subject never falls back by more than a factor of e^5 at once, from which it could not recover.
_MOST_AT_ONCE = 5.0


@dataclass(frozen=True, eq=False)
class Balanced:
    """A plan for the worst subject.

    Attributes
    ----------
    solution : Solution
        Its distances, and the worst subject's cost.
    multipliers : (S,) array
        Those with the greatest least mean.
    problem : Problem
        Weighted by them: a bound of its cost is one of the worst cost.
    mean : Solution
        The plan for that problem.
    """

    solution: Solution
    multipliers: FloatArray
    problem: Problem
    mean: Solution

    __repr__ = brief_repr


def balance_subjects(problem: Problem, solver: Solver, options: Options, pacer: Pacer) -> Balanced:
    """Return the plan whose worst subject costs least, of those for one mean after another.

    Parameters
    ----------
    problem : Problem
        Of several subjects.
    solver : Solver
        For each mean.
    options : Options
    pacer : Pacer
        Asked after every step; once it stops a solver, that plan is the last.
    """
    subjects = problem.subjects
    multipliers = np.full(len(subjects), 1 / len(subjects))
    best: Balanced | None = None
    for number in range(1, _ROUNDS + 1):
        weighted = _weighted(problem, multipliers)
        mean = solver(weighted, options, pacer)
        focus = fill_missing_distances(weighted, mean.focus_distances)
        costs = costs_of_subjects(problem, problem.evaluate(focus)[0])
        here = Balanced(
            replace(mean, focus_distances=focus, cost=float(costs.max())),
            multipliers,
            weighted,
            mean,
        )
        best = here if best is None else _better(best, here)
        excess = best.solution.cost - best.mean.cost
        if pacer.stopped or not mean.converged or excess <= options.gap * best.solution.cost:
            break
        options = replace(options, start=focus)
        if mean.prices is not None:
            options = replace(options, prices=mean.prices)
        multipliers = _raised(multipliers, costs, number)
    assert best is not None
    return best


def _better(one: Balanced, other: Balanced) -> Balanced:
    """Return the better plan of two, and the better multipliers, with which no mean is less."""
    plan = other if other.solution.cost < one.solution.cost else one
    proof = other if _bound(other) > _bound(one) else one
    return replace(proof, solution=plan.solution)


def _bound(balanced: Balanced) -> float:
    """Return the proven bound, or what it will be close to."""
    proven = balanced.mean.lower_bound
    return balanced.mean.cost if proven is None else proven


def _weighted(problem: Problem, multipliers: FloatArray) -> Problem:
    weights = problem.samples.weights.copy()
    for part, multiplier in zip(problem.subjects, multipliers, strict=True):
        weights[part] *= multiplier / weights[part].sum()
    return reweighted(problem, weights)


def _raised(multipliers: FloatArray, costs: FloatArray, number: int) -> FloatArray:
    """Return the multipliers after the round of this number, raised where costs are high."""
    mean = float(multipliers @ costs) or 1.0
    behind = _RATE / np.sqrt(number) * (costs.max() - costs) / mean
    raised = multipliers * np.exp(-np.minimum(behind, _MOST_AT_ONCE))
    shares: FloatArray = raised / raised.sum()
    return shares
