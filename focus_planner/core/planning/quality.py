"""How good focus distances are, estimated from samples that no solver has seen."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from focus_planner.core.arrays import FloatArray
from focus_planner.core.problem.problem import Problem


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
    """What focus distances are worth on a surface.

    Attributes
    ----------
    cost : Estimate
        1000 × the weighted mean over the surface of the pointwise cost (Eq. 3).
    covered_area, in_focus_area : Estimate
        Of what some camera sees, and of what is in focus in the camera that images it best;
        square metres.
    """

    cost: Estimate
    covered_area: Estimate
    in_focus_area: Estimate


def estimate_quality(problem: Problem, focus: FloatArray) -> Quality:
    """Return what focus distances are worth on a problem's samples.

    Without bias where the samples are a random draw that the distances do not depend on; on the
    samples that a solver was given its distances look better than they are.

    Parameters
    ----------
    problem : Problem
        Of at least 2 samples.
    focus : (C,) array
        Metres.
    """
    costs, best = problem.evaluate(focus)
    weights, areas = problem.samples.weights, problem.samples.areas
    area = float(areas.sum())
    return Quality(
        cost=weighted_mean(weights, costs).scaled(1000),
        covered_area=weighted_mean(areas, best >= 0).scaled(area),
        in_focus_area=weighted_mean(areas, problem.in_focus(focus, best)).scaled(area),
    )


def weighted_mean(weights: FloatArray, values: FloatArray | NDArray[np.bool_]) -> Estimate:
    """Return the ratio Σ w·v / Σ w of independent samples and its linearised standard error.

    The sample size is random in terms of weight, so the mean is a ratio of two sums: to first
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
