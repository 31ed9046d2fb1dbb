# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The quality of focus distances on a surface, estimated from samples."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from focus_planner.core.arrays import FloatArray, IntArray
from focus_planner.core.planning.sharp_views import (
    TOLD_VIEWS,
    Resolution,
    SharpArea,
    sharp_views,
)
from focus_planner.core.problem.problem import Problem
from focus_planner.core.rig.rig import Rig
from focus_planner.core.surface.resolution import metres_per_pixel


@dataclass(frozen=True)
class Estimate:
    """A mean over a surface, estimated from samples.

    Attributes
    ----------
    value : float
    standard_error : float
        In the value's unit.
    """

    value: float
    standard_error: float

    def scaled(self, factor: float) -> Estimate:
        """Return the estimate of ``factor`` times the mean."""
        return Estimate(factor * self.value, factor * self.standard_error)


@dataclass(frozen=True)
class Quality:
    """How well focus distances image a surface.

    Attributes
    ----------
    cost : Estimate
        1000 × the weighted mean over the surface of the pointwise cost (Eq. 3).
    covered_area, in_focus_area : Estimate
        Of the part that some camera sees, and of the part that is in focus in the camera that
        images it best; square metres.
    sharp_areas : tuple of SharpArea
        Of the parts that are sharp in at least 1, 2, 3 and 5 views.
    resolution : Resolution or None
        Of the part in focus; None where there is none, or no rig is given.
    """

    cost: Estimate
    covered_area: Estimate
    in_focus_area: Estimate
    sharp_areas: tuple[SharpArea, ...]
    resolution: Resolution | None


def estimate_quality(problem: Problem, focus: FloatArray, rig: Rig | None = None) -> Quality:
    """Estimate from a problem's samples how well focus distances image its surface.

    The estimate is unbiased if the samples are a random draw on which the distances do not
    depend; a solver's distances look better than they are on the samples that it was given.

    Of several subjects it tells the quality on average: each was drawn from by itself, so that
    errors are those of each, and how much subjects differ adds nothing to them.

    Parameters
    ----------
    problem : Problem
        Of at least 2 samples of each subject.
    focus : (C,) array
        Metres.
    rig : Rig, optional
        Its cameras are those of the problem; without it no resolution is estimated.
    """
    costs, best = problem.evaluate(focus)
    weights, areas = problem.samples.weights, problem.samples.areas
    area = float(areas.sum())
    in_focus = problem.in_focus(focus, best)
    mean = partial(mean_of_subjects, problem.subjects)
    return Quality(
        cost=mean(weights, costs).scaled(1000),
        covered_area=mean(areas, best >= 0).scaled(area),
        in_focus_area=mean(areas, in_focus).scaled(area),
        sharp_areas=_sharp_areas(problem, focus),
        resolution=None if rig is None else _resolution(problem, rig, best, in_focus),
    )


def mean_of_subjects(
    subjects: Sequence[slice], weights: FloatArray, values: FloatArray | NDArray[np.bool_]
) -> Estimate:
    """Return the ratio Σ w·v / Σ w over all subjects' samples, each drawn independently.

    Parameters
    ----------
    subjects : sequence of slice
        The samples of each.
    weights, values : (N,) arrays
    """
    if len(subjects) == 1:
        return weighted_mean(weights, values)
    means = [weighted_mean(weights[part], values[part]) for part in subjects]
    shares = np.array([weights[part].sum() for part in subjects]) / weights.sum()
    return Estimate(
        float(shares @ [mean.value for mean in means]),
        float(np.sqrt(shares**2 @ [mean.standard_error**2 for mean in means])),
    )


def _sharp_areas(problem: Problem, focus: FloatArray) -> tuple[SharpArea, ...]:
    areas, views = problem.samples.areas, sharp_views(problem, focus)
    total = float(areas.sum())
    estimates = (
        (count, mean_of_subjects(problem.subjects, areas, views >= count)) for count in TOLD_VIEWS
    )
    return tuple(
        SharpArea(count, total * share.value, total * share.standard_error)
        for count, share in estimates
    )


def _resolution(
    problem: Problem, rig: Rig, best: IntArray, in_focus: NDArray[np.bool_]
) -> Resolution | None:
    """Return how finely the samples that are in focus are imaged by their best cameras."""
    samples = problem.samples.take(np.flatnonzero(in_focus))
    if not samples.areas.sum() > 0:
        return None
    camera = problem.view[best[in_focus]]
    lengths = 1000 * metres_per_pixel(samples.points, samples.normals, rig, camera)
    median, most = weighted_quantiles(samples.areas, lengths, (0.5, 0.9))
    return Resolution(median, most)


def weighted_quantiles(
    weights: FloatArray, values: FloatArray, shares: Sequence[float]
) -> tuple[float, ...]:
    """Return the least values that this share of the weight, at least, does not exceed.

    Parameters
    ----------
    weights, values : (N,) arrays
        N at least 1; the weights not all 0.
    shares : sequence of float
        Above 0, at most 1.
    """
    order = np.argsort(values, kind="stable")
    below = np.cumsum(weights[order])
    # Without the slack, rounding might pass over the value at which the share is reached.
    places = np.searchsorted(below, np.asarray(shares) * below[-1] * (1 - 1e-12))
    return tuple(values[order[places]].tolist())


def weighted_mean(weights: FloatArray, values: FloatArray | NDArray[np.bool_]) -> Estimate:
    """Return the ratio Σ w·v / Σ w of independent samples and its linearised standard error.

    The total weight is as random as the weighted sum, so the mean is a ratio estimator: to first
    order its error is that of the sum of w·(v − mean) (Cochran, *Sampling Techniques*, Sec. 6.3).

    Parameters
    ----------
    weights, values : (N,) arrays
        N at least 2.
    """
    total = weights.sum()
    mean = (weights * values).sum() / total
    residuals = weights * (values - mean)
    count = len(weights)
    error = np.sqrt((residuals**2).sum() * count / (count - 1)) / total
    return Estimate(float(mean), float(error))
