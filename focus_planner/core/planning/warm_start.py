"""Starting from the plan of a similar surface, rig or request: its distances and its prices."""

from __future__ import annotations

from dataclasses import replace
from itertools import groupby

import numpy as np
from scipy.spatial import cKDTree

from focus_planner.core.planning.plan import WarmStart
from focus_planner.core.problem.problem import Problem
from focus_planner.core.solvers import Options


def warm_options(options: Options, warm_start: WarmStart, problem: Problem) -> Options:
    """Return the options with a start for a problem that resembles the one warm_start.

    Cameras are known again by their names, and shots by their order; those that are new, and all
    brackets of another number of shots, start as they would have. A sample takes the price of the
    nearest sample before: prices are what a place gains from focus, and change little with it.
    """
    start = options.start
    if start is None:
        start = np.full(problem.camera_count, np.nan)
    shots = _numbered(problem.names)
    distances = dict(zip(_numbered(warm_start.names), warm_start.focus_distances, strict=True))
    if len(warm_start.names) == problem.shots * len(set(warm_start.names)):
        known = [distances.get(shot, np.nan) for shot in shots]
        start = np.where(np.isnan(known), start, known)
    if warm_start.prices is None:
        return replace(options, start=start)
    tree = cKDTree(warm_start.points)
    nearest = tree.query(problem.samples.points, workers=-1)[1]
    return replace(options, start=start, prices=warm_start.prices[nearest])


def _numbered(names: tuple[str, ...]) -> list[tuple[str, int]]:
    """Return every camera's shots: its name, and their numbers from 0."""
    return [(name, shot) for name, shots in groupby(names) for shot, _ in enumerate(shots)]
