# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Warm starts: from the distances and prices of a plan for a similar surface, rig or request."""

from __future__ import annotations

from dataclasses import replace
from itertools import groupby

import numpy as np

from focus_planner.core import kernels
from focus_planner.core.arrays import FloatArray
from focus_planner.core.planning.plan import WarmStart
from focus_planner.core.problem.problem import Problem
from focus_planner.core.solvers import Options
from focus_planner.core.surface.tree import tree_of


def warm_options(
    options: Options, warm_start: WarmStart, problem: Problem, *, limited: bool = False
) -> Options:
    """Return the options to solve a problem from a warm start.

    Cameras are matched by name and shots by their order. New cameras start as they would without
    a warm start, and so do all if the number of shots has changed. If pictures are limited, the
    search starts from those that the earlier plan takes; otherwise, shots that it does not take
    start like new ones.
    """
    start = options.start
    if start is None:
        start = np.full(problem.camera_count, np.nan)
    if limited or _same_shots(warm_start, problem):
        known = _distances(warm_start, problem)
        start = np.where(np.isfinite(known), known, kernels.UNTAKEN if limited else start)
    return replace(options, start=start)


def warm_prices(warm_start: WarmStart | None, problem: Problem) -> FloatArray | None:
    """Return (N,) prices to start from; None if an earlier plan left none.

    Each sample takes the price of the nearest sample of the earlier plan: a price is what focus on
    a place gains, and differs little from place to place.
    """
    if warm_start is None or warm_start.prices is None:
        return None
    tree = tree_of(warm_start.points)
    prices: FloatArray = warm_start.prices[tree.query(problem.samples.points, workers=-1)[1]]
    return prices


def earlier_distances(warm_start: WarmStart, problem: Problem) -> FloatArray:
    """Return (C,) where an earlier plan has the cameras of a problem, metres.

    NaN for new cameras, and for all if the number of shots has changed; not finite either for shots
    that the earlier plan does not take.
    """
    if not _same_shots(warm_start, problem):
        return np.full(problem.camera_count, np.nan)
    return _distances(warm_start, problem)


def _same_shots(warm_start: WarmStart, problem: Problem) -> bool:
    return len(warm_start.names) == problem.shots * len(set(warm_start.names))


def _distances(warm_start: WarmStart, problem: Problem) -> FloatArray:
    distances = dict(zip(_numbered(warm_start.names), warm_start.focus_distances, strict=True))
    return np.array([distances.get(shot, np.nan) for shot in _numbered(problem.names)])


def _numbered(names: tuple[str, ...]) -> list[tuple[str, int]]:
    """Return (camera's name, number of the shot from 0) for every shot."""
    return [(name, shot) for name, shots in groupby(names) for shot, _ in enumerate(shots)]
