"""k-view optimisation: exact joint steps of two or three cameras (paper, Sec. 3.4)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from focus_planner.core import kernels
from focus_planner.core.problem import Problem
from focus_planner.core.solvers import em
from focus_planner.core.solvers.solution import (
    Options,
    Progress,
    Solution,
    Watch,
    assign_samples,
    cost_of_units,
    finish_cells,
    go_on,
    start_cells,
)
from focus_planner.core.tuples import camera_tuples


def solve(problem: Problem, options: Options | None = None, watch: Watch = go_on) -> Solution:
    """From EM's solution, take every tuple's best step until none pays.

    With scope "all" each step is exact block-coordinate descent on the total cost; with
    "assigned", the paper's, a step re-assigns the tuple's own samples among its cameras, and
    after each pass every sample goes to its cheapest camera. The cost never rises.
    """
    options = options or Options()
    going_on = True

    def remember(progress: Progress) -> bool:
        nonlocal going_on
        going_on = watch(progress)
        return going_on

    before = em.solve(problem, options, remember)
    if not going_on:  # even where EM had just converged
        return replace(before, converged=False)
    cells = problem.cells
    cell = start_cells(problem, before.focus_distances)
    best, units = assign_samples(problem, cell)
    tuples = camera_tuples(problem, options.k, options.scope, options.grid)
    by_sample = (problem.sample_offsets, problem.camera_index, cells.base)
    ranges = (cells.first, cells.last)
    # Only one of them tells the kernels what stands around a tuple: see kernels/k_view.py.
    ranked = problem.sample_count if options.scope == "all" else 0
    ranking = np.empty((ranked, options.k + 1), dtype=np.int64)
    kernels.rank_cameras(*by_sample, cells.focus, *ranges, cell, ranking)
    steps = np.empty(len(cells.near) + problem.camera_count, dtype=np.int64)
    summed, solved = (np.zeros(n, np.int64) for n in (len(cell), len(tuples.cameras)))
    touched, clock = (np.ones(n, np.int64) for n in (len(cell), 1))
    iteration = 0
    while True:
        iteration += 1
        gain = kernels.improve_tuples(
            tuples.cameras,
            tuples.batch_offsets,
            tuples.shared_offsets,
            tuples.samples,
            tuples.bases,
            tuples.firsts,
            tuples.lasts,
            problem.camera_offsets,
            cells.seen,
            cells.seen_base,
            cells.seen_first,
            cells.seen_last,
            *by_sample,
            *ranges,
            cells.focus,
            cells.offsets,
            cell,
            ranking,
            best,
            steps,
            summed,
            touched,
            solved,
            clock,
        )
        if options.scope == "assigned":
            kernels.reassign(*by_sample, cells.focus, *ranges, cell, best, summed, touched, clock)
            # A step counts its gain from the best assignment within its tuple, not the present.
            gain = units - assign_samples(problem, cell)[1]
        units -= gain
        going_on = watch(Progress("k_view", iteration, cost_of_units(units)))
        if not (gain and going_on):
            return finish_cells(problem, cell, before.iterations + iteration, not gain)
