"""Starting from the plan of a similar surface, rig or request: its distances and its prices."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from focus_planner.core.problem import Problem
from focus_planner.core.solvers import Options
from focus_planner.core.types import FloatArray


@dataclass(frozen=True, eq=False)
class Warmth:
    """What a plan leaves to the next.

    Attributes
    ----------
    problem : Problem
        What was solved.
    focus_distances : (C,) array
        Metres.
    prices : (N,) array, optional
        Of its samples, 0 to 1, if a bound was made.
    """

    problem: Problem
    focus_distances: FloatArray
    prices: FloatArray | None


def warm_options(options: Options, before: Warmth, problem: Problem) -> Options:
    """Return the options with a start for a problem that resembles the one before.

    Cameras are known again by their names, and shots by their order; those that are new, and all
    brackets of another number of shots, start as they would have. A sample takes the price of the
    nearest sample before: prices are what a place gains from focus, and change little with it.
    """
    start = options.start
    if start is None:
        start = np.full(problem.camera_count, np.nan)
    if problem.shots == before.problem.shots:
        distances = dict(zip(_shot_names(before.problem), before.focus_distances, strict=True))
        known = [distances.get(name, np.nan) for name in _shot_names(problem)]
        start = np.where(np.isnan(known), start, known)
    if before.prices is None:
        return replace(options, start=start)
    tree = cKDTree(before.problem.samples.points)
    nearest = tree.query(problem.samples.points, workers=-1)[1]
    return replace(options, start=start, prices=before.prices[nearest])


def _shot_names(problem: Problem) -> list[tuple[str, int]]:
    return [(name, i % problem.shots) for i, name in enumerate(problem.names)]
