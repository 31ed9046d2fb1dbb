# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Several shots per camera: a camera that takes m shots is m cameras of the discrete problem.

These have the same pose and see the same samples, and a sample costs as much as in the best of
all shots. The model is exact: any solver plans the focus brackets of all cameras jointly without
knowing about shots. Camera c's shots are cameras c·m to c·m + m − 1 of the problem.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from focus_planner.core import kernels
from focus_planner.core.arrays import FloatArray
from focus_planner.core.problem.problem import Problem


def with_shots(problem: Problem, shots: int) -> Problem:
    """Return the one-shot problem with this many shots per camera instead."""
    assert problem.shots == 1
    if shots == 1:
        return problem
    repeated = np.repeat(problem.camera_index, shots) * shots
    return replace(
        problem,
        names=tuple(name for name in problem.names for _ in range(shots)),
        lenses=tuple(lens for lens in problem.lenses for _ in range(shots)),
        sample_offsets=problem.sample_offsets * shots,
        sample_index=np.repeat(problem.sample_index, shots),
        camera_index=repeated + np.tile(np.arange(shots, dtype=np.int32), len(problem.depth)),
        depth=np.repeat(problem.depth, shots),
        base_cost=np.repeat(problem.base_cost, shots),
        focus_near=np.repeat(problem.focus_near, shots),
        focus_far=np.repeat(problem.focus_far, shots),
        shots=shots,
    )


def with_one_shot(problem: Problem) -> Problem:
    """Return the one-shot problem that :func:`with_shots` made this problem from."""
    first = slice(None, None, problem.shots)
    return replace(
        problem,
        names=problem.names[first],
        lenses=problem.lenses[first],
        sample_offsets=problem.sample_offsets // problem.shots,
        sample_index=problem.sample_index[first].copy(),
        camera_index=problem.camera_index[first] // problem.shots,
        depth=problem.depth[first].copy(),
        base_cost=problem.base_cost[first].copy(),
        focus_near=problem.focus_near[first].copy(),
        focus_far=problem.focus_far[first].copy(),
        shots=1,
    )


def with_pictures(problem: Problem, taken: NDArray[np.bool_]) -> Problem:
    """Return the problem in which only some shots are taken: the others see nothing.

    Parameters
    ----------
    problem : Problem
    taken : (C,) array of bool
    """
    pairs = taken[problem.camera_index]
    counts = np.bincount(problem.sample_index[pairs], minlength=problem.sample_count)
    return replace(
        problem,
        sample_offsets=np.concatenate([[0], np.cumsum(counts)]),
        sample_index=problem.sample_index[pairs],
        camera_index=problem.camera_index[pairs],
        depth=problem.depth[pairs],
        base_cost=problem.base_cost[pairs],
        focus_near=problem.focus_near[pairs],
        focus_far=problem.focus_far[pairs],
    )


def confined_to(problem: Problem, focus: FloatArray) -> Problem:
    """Return the problem in which lenses can be set only to these focus distances (C,), metres.

    What a camera does not hold in focus there, it cannot: nothing, where its distance is NaN.
    """
    at = focus[problem.camera_index]
    held = (problem.focus_near <= at) & (at <= problem.focus_far)
    return replace(
        problem,
        focus_near=np.where(held, at, np.inf),
        focus_far=np.where(held, at, -np.inf),
    )


def spread_start(problem: Problem) -> FloatArray | None:
    """Return (C,) initial focus distances, metres, apart for a camera's shots; None for one shot.

    Shots that started at the same distance would gain the same, and all but one would stay idle.
    They start at evenly spaced quantiles of the depths that the camera sees, from the closest to
    the farthest: of the spreads tried on bodies, EM's cost came out lowest from this one. NaN for
    cameras that see nothing.
    """
    if problem.shots == 1:
        return None
    start = np.full(problem.camera_count, np.nan)
    shares = np.linspace(0.0, 1.0, problem.shots)
    for c in range(0, problem.camera_count, problem.shots):
        low, high = problem.camera_offsets[c : c + 2]
        if low < high:
            depths = problem.depth[problem.camera_pairs[low:high]]
            start[c : c + problem.shots] = np.quantile(depths, shares)
    return start


def sort_shots(problem: Problem, focus: FloatArray) -> FloatArray:
    """Return the focus distances with each camera's shots ascending, those not taken last."""
    last = np.where(focus == kernels.UNTAKEN, np.inf, focus).reshape(-1, problem.shots)
    order = np.argsort(last, axis=1, kind="stable")
    ascending: FloatArray = np.take_along_axis(focus.reshape(-1, problem.shots), order, axis=1)
    return ascending.ravel()


def most_shots(problem: Problem, focus: FloatArray) -> int:
    """Return how many shots the camera takes that takes most, at least 1."""
    taken = (focus != kernels.UNTAKEN).reshape(-1, problem.shots).sum(axis=1)
    return max(int(taken.max()), 1)
