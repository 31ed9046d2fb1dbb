# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The surface as samples that no plan was made on, and what plans make of each of them."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from focus_planner.core.arrays import FloatArray
from focus_planner.core.planning.plan import FocusPlan
from focus_planner.core.planning.sharp_views import pairs_in_focus, sharp_views
from focus_planner.core.problem.cost_model import CostModel
from focus_planner.core.problem.problem import Problem
from focus_planner.core.problem.shots import with_shots
from focus_planner.report.content import DepthHistogram, ReportedPlan, SampledSurface

# Bins of the depths that a camera sees, about.
_BINS = 24
# Depths that differ by a smaller part of them are one.
_ONE_DEPTH = 1e-3


def sample_surface(
    problem: Problem,
    model: CostModel | None = None,
    depth_tolerance: float = 0.0,
    max_mm_per_pixel: float = math.inf,
) -> SampledSurface:
    """Return the surface of a problem with one shot per camera, on samples drawn by area.

    Parameters
    ----------
    problem : Problem
    model : CostModel, optional
        That the problem was built with; the paper's by default.
    depth_tolerance : float
        That it was built with, metres.
    max_mm_per_pixel : float
        That it was built with.
    """
    samples = problem.samples
    area = float(samples.areas.sum())
    return SampledSurface(
        points=samples.points,
        normals=samples.normals,
        areas=samples.areas,
        importance=_importance(samples.areas, samples.weights),
        spacing=math.sqrt(area / len(samples)),
        pair_offsets=problem.sample_offsets,
        pair_camera=problem.camera_index,
        pair_depth=problem.depth,
        pair_cost=problem.base_cost,
        focus_weight=problem.focus_weight,
        model=model or CostModel(),
        depth_tolerance=depth_tolerance,
        max_mm_per_pixel=max_mm_per_pixel,
        views=problem.views,
    )


def report_plan(
    title: str, plan: FocusPlan, problem: Problem, surface: SampledSurface
) -> ReportedPlan:
    """Return what a plan makes of a surface's samples; its pictures are added later.

    Parameters
    ----------
    title : str
    plan : FocusPlan
    problem : Problem
        On the surface's samples, with one shot per camera and the lenses of the plan's own rig.
    surface : SampledSurface
    """
    shots, focus = with_shots(problem, plan.shots), plan.focus_distances
    cost, best = shots.evaluate(focus)
    held = pairs_in_focus(shots, focus).reshape(-1, shots.shots).any(axis=1)
    index = problem.sample_index
    return ReportedPlan(
        title=title,
        plan=plan,
        cost=cost,
        camera=np.where(best < 0, np.int32(-1), best // np.int32(plan.shots)).astype(np.int32),
        in_focus=shots.in_focus(focus, best),
        sharp_views=sharp_views(shots, focus),
        pair_in_focus=_on_pairs_of(surface, problem, held),
        held_area=np.bincount(
            problem.camera_index[held],
            weights=problem.samples.areas[index[held]],
            minlength=problem.camera_count,
        ),
        sees_the_same=_sees_the_same(surface, problem),
    )


def depth_histograms(problem: Problem) -> tuple[DepthHistogram, ...]:
    """Return, for each camera of a problem with one shot per camera, the depths that it sees."""
    areas = problem.samples.areas[problem.sample_index]
    offsets, pairs = problem.camera_offsets, problem.camera_pairs
    return tuple(
        _histogram(problem.depth[seen], areas[seen])
        for seen in (pairs[low:high] for low, high in pairwise(offsets))
    )


def _importance(areas: FloatArray, weights: FloatArray) -> FloatArray | None:
    """Return each sample's importance relative to the greatest; None if all are equal."""
    importance = weights / areas
    greatest = float(importance.max())
    if greatest <= 0 or np.allclose(importance, greatest, rtol=1e-9, atol=0.0):
        return None
    return np.minimum(importance, 1.0)


def _sees_the_same(surface: SampledSurface, problem: Problem) -> bool:
    return np.array_equal(problem.sample_offsets, surface.pair_offsets) and np.array_equal(
        problem.camera_index, surface.pair_camera
    )


def _on_pairs_of(
    surface: SampledSurface, problem: Problem, held: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """Return which of the surface's pairs are held: cameras of another rig may see others."""
    if problem.camera_index is surface.pair_camera:
        return held
    count = problem.camera_count
    sample = np.repeat(np.arange(len(surface.points)), np.diff(surface.pair_offsets))
    here = sample * count + surface.pair_camera
    there = problem.sample_index.astype(np.int64) * count + problem.camera_index
    return np.isin(here, there[held])


def _histogram(depths: FloatArray, areas: FloatArray) -> DepthHistogram:
    if not len(depths):
        return DepthHistogram(np.empty(0), np.empty(0))
    low, high = float(depths.min()), float(depths.max())
    if high - low < _ONE_DEPTH * high:
        middle, reach = (low + high) / 2, _ONE_DEPTH * high
        return DepthHistogram(np.array([middle - reach, middle + reach]), areas.sum(keepdims=True))
    width = _round_width((high - low) / _BINS)
    first, last = math.floor(low / width), math.floor(high / width) + 1
    edges: FloatArray = width * np.arange(first, last + 1, dtype=np.float64)
    bins = np.clip(np.floor(depths / width).astype(np.int64) - first, 0, last - first - 1)
    return DepthHistogram(edges, np.bincount(bins, weights=areas, minlength=last - first))


def _round_width(width: float) -> float:
    """Return the least of 1, 2, 5, 10, 20, ... that is not less, as powers of ten go."""
    power: float = 10.0 ** math.floor(math.log10(width))
    return next(power * step for step in (1, 2, 5, 10) if power * step >= width * (1 - 1e-9))
