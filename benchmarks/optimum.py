# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The effort to prove plans optimal at 1,000 samples, and gaps and bounds at more."""

from __future__ import annotations

import time
from dataclasses import dataclass

import highspy
import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.optimize import milp

from benchmarks.compact import compact_program
from benchmarks.scenes import body_scenes, problem, rig
from benchmarks.speed import from_em_to_convergence
from benchmarks.timing import seconds, timed
from focus_planner import PlanRequest, Problem, Scene, plan_focus
from focus_planner.core import kernels
from focus_planner.core.bounds.lower_bound import Bound, lower_bound
from focus_planner.core.problem.cells import cost_of_units
from focus_planner.core.problem.gains import gains_of
from focus_planner.core.progress import Progress
from focus_planner.core.solvers import Options, Solution, em, k_view, optimal
from testing import reference

_SEEDS = range(1, 4)
_GAP = 1e-6
# Samples, and the gap that is waited for.
_LARGER = ((4096, 1e-4), (8192, 1e-4), (65536, 1e-3))
_MOMENTS = (1.0, 3.0, 10.0, 30.0)
# Seconds after which an optimum is not waited for any longer.
_PATIENCE = 30.0


def run(console: Console) -> None:
    """Print all tables."""
    scenes = body_scenes()
    optimal.solve(problem(next(iter(scenes.values())), 1000))  # compiles, or loads, what will run
    _print_beside_highs(console, scenes)
    _print_larger(console, scenes)
    _print_gaps_in_time(console, scenes)
    _print_above_optimum(console, scenes)


# --- 1,000 samples, beside HiGHS -----------------------------------------------------------------


@dataclass(frozen=True)
class _Proof:
    """Seconds to a problem's proven optimum by several solvers, and the costs that they report."""

    ours: float
    plan: float
    compact: float
    plain: float
    difference: float


def _print_beside_highs(console: Console, scenes: dict[str, Scene]) -> None:
    table = Table(
        "body",
        "optimal",
        "worst",
        "whole plan",
        "HiGHS, compact",
        "HiGHS, plain",
        "faster HiGHS, worst",
        "HiGHS / optimal",
        "optima differ by",
        title=f"Seconds to a gap of {_GAP:g}, 1,000 samples, medians of {len(_SEEDS)} seeds",
    )
    every = []
    for name, scene in scenes.items():
        proofs = [_prove(scene, seed) for seed in _SEEDS]
        table.add_row(name, *_proof_figures(proofs))
        every += proofs
    table.add_row("all", *_proof_figures(every))
    console.print(table)


def _proof_figures(proofs: list[_Proof]) -> list[str]:
    ours = [proof.ours for proof in proofs]
    highs = [min(proof.compact, proof.plain) for proof in proofs]
    ratio = np.median(np.divide(highs, ours))
    return [
        f"{np.median(ours):.3f}",
        f"{max(ours):.3f}",
        f"{np.median([proof.plan for proof in proofs]):.3f}",
        f"{np.median([proof.compact for proof in proofs]):.3f}",
        f"{np.median([proof.plain for proof in proofs]):.3f}",
        f"{max(highs):.3f}",
        f"{ratio:.1f} ×",
        f"{max(proof.difference for proof in proofs):.1e}",
    ]


def _prove(scene: Scene, seed: int) -> _Proof:
    formulated = problem(scene, 1000, seed)
    with kernels.threads_for(len(formulated.depth)):
        ours, solution = timed(lambda: optimal.solve(formulated, Options(gap=_GAP)))
    request = PlanRequest("optimal", samples=1000, seed=seed, gap=_GAP)
    plan, _ = timed(lambda: plan_focus(scene, rig(), request))
    compact, compact_cost = _compact(formulated)
    program, constant = reference.facility_location(reference.table(formulated))
    arrays = program.arrays()
    plain, result = timed(lambda: milp(**arrays, options={"mip_rel_gap": _GAP}))
    costs = np.array([compact_cost, constant + result.fun])
    difference = float(np.abs(costs / solution.cost - 1).max())
    return _Proof(ours, plan, compact, plain, difference)


def _compact(formulated: Problem) -> tuple[float, float]:
    """Return the seconds that HiGHS takes for the compact form of the problem, and the cost."""
    gains = gains_of(formulated)
    highs = highspy.Highs()
    highs.setOptionValue("output_flag", False)
    highs.setOptionValue("mip_rel_gap", _GAP)
    highs.passModel(compact_program(gains))
    taken, _ = timed(highs.run)
    return taken, cost_of_units(gains.out) + highs.getInfo().objective_function_value


# --- More samples --------------------------------------------------------------------------------


class _Trace:
    """A progress callback that keeps the gap over time, and stops after a while."""

    def __init__(self, limit: float) -> None:
        self._started = time.perf_counter()
        self._limit = limit
        self._steps: list[tuple[float, float]] = []

    def __call__(self, progress: Progress) -> bool:
        after = time.perf_counter() - self._started
        if progress.lower_bound is not None:
            self._steps.append((after, 1 - progress.lower_bound / progress.cost))
        return after < self._limit

    def gap_after(self, moment: float) -> float:
        """Return the smallest gap up to a time."""
        return min(gap for after, gap in self._steps if after <= moment)


def _print_larger(console: Console, scenes: dict[str, Scene]) -> None:
    table = Table(
        "body",
        "samples",
        "gap",
        "optimal",
        "2-view all, from EM",
        "… per sort of the interval ends",
        "bound alone",
        "bound below the best plan",
        title="Seconds to a gap; of a tight bound alone for the 2-view plan",
    )
    for name, scene in scenes.items():
        for samples, gap in _LARGER:
            formulated = problem(scene, samples)
            with kernels.threads_for(len(formulated.depth)):
                taken, best = timed(lambda p=formulated, g=gap: _until(p, g, _PATIENCE))
                two_view = np.median(
                    [from_em_to_convergence(formulated, Options()) for _ in range(3)]
                )
                plan = k_view.solve(formulated)
                bounding, bound = timed(lambda p=formulated, s=plan: _tight(p, s))
            ends = np.concatenate([formulated.focus_near, formulated.focus_far])
            sort = seconds(lambda e=ends: np.sort(e), 5)
            least = min(best.cost, plan.cost)
            table.add_row(
                name,
                f"{samples:,}",
                f"{gap:.2%}",
                f"{taken:.2f}" if best.converged else f"> {_PATIENCE:.0f} ({_gap(best):.3%})",
                f"{two_view:.3f}",
                f"{two_view / sort:.0f} ×",
                f"{bounding:.2f}",
                f"{1 - bound.lower_bound / least:.3%}",
            )
    console.print(table)


def _until(formulated: Problem, gap: float, limit: float) -> Solution:
    return optimal.solve(formulated, Options(gap=gap), _Trace(limit))


def _gap(solution: Solution) -> float:
    assert solution.lower_bound is not None
    return 1 - solution.lower_bound / solution.cost


def _tight(formulated: Problem, plan: Solution) -> Bound:
    return lower_bound(formulated, plan.cost, plan.cost, _GAP)


def _print_gaps_in_time(console: Console, scenes: dict[str, Scene]) -> None:
    samples, _ = _LARGER[-1]
    table = Table(
        "body",
        *(f"{moment:g} s" for moment in _MOMENTS),
        title=f"Gap proven by `optimal` after so many seconds, {samples:,} samples",
    )
    for name, scene in scenes.items():
        formulated = problem(scene, samples)
        with kernels.threads_for(len(formulated.depth)):
            trace = _Trace(_MOMENTS[-1])
            optimal.solve(formulated, Options(gap=_GAP), trace)
        table.add_row(name, *(f"{trace.gap_after(moment):.3%}" for moment in _MOMENTS))
    console.print(table)


def _print_above_optimum(console: Console, scenes: dict[str, Scene]) -> None:
    samples = 4096
    methods = {
        "em": (em, Options()),
        "k_view": (k_view, Options()),
        "k_view, k = 3": (k_view, Options(k=3)),
    }
    table = Table(
        "body",
        "optimum",
        "proven to",
        "seconds",
        *methods,
        title=f"Above the optimum, {samples:,} samples",
    )
    for name, scene in scenes.items():
        formulated = problem(scene, samples)
        with kernels.threads_for(len(formulated.depth)):
            taken, best = timed(lambda p=formulated: _until(p, _GAP, _PATIENCE))
            costs = [solver.solve(formulated, options).cost for solver, options in methods.values()]
        table.add_row(
            name,
            f"{best.cost:.3f}",
            f"{_gap(best):.1e}",
            f"{taken:.1f}",
            *(f"{cost / best.cost - 1:.3%}" for cost in costs),
        )
    console.print(table)
