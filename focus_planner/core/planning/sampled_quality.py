# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""How well a plan images each sample of a surface: what maps of its quality show."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from focus_planner.core.arrays import FloatArray, IntArray
from focus_planner.core.brief import brief_repr
from focus_planner.core.planning.sharp_views import sharp_views

if TYPE_CHECKING:
    # Importing it loads compiled kernels.
    from focus_planner.core.problem.problem import Problem


@dataclass(frozen=True, eq=False)
class SampledQuality:
    """The quality of a plan on N samples.

    Attributes
    ----------
    points : (N, 3) array
        Metres, in the rig's frame.
    spacing : float
        Between neighbouring samples, about; metres.
    cost : (N,) array
        In the picture that images the sample best, 0 to 1; 1 where no camera sees it. Where several
        views are asked for, the mean over its best ones, 1 for each that is missing.
    picture : (N,) array of int32
        The picture that images it best: shot j of camera c is picture c · shots + j; -1 where no
        camera sees it.
    in_focus : (N,) array of bool
        Whether the sample is in focus in that picture.
    views : (N,) array of int32
        How many cameras hold the sample in focus, in any of their pictures
        (:func:`~focus_planner.core.planning.sharp_views.sharp_views`).
    shots : int
        Pictures of each camera.
    """

    points: FloatArray
    spacing: float
    cost: FloatArray
    picture: IntArray
    in_focus: NDArray[np.bool_]
    views: IntArray
    shots: int

    __repr__ = brief_repr

    @property
    def camera(self) -> IntArray:
        """(N,) the camera that images each sample best; -1 where none sees it."""
        cameras: IntArray = self.picture // self.shots  # -1 stays -1
        return cameras


def sampled_quality(problem: Problem, focus: FloatArray) -> SampledQuality:
    """Return how well focus distances image each sample of a problem.

    Parameters
    ----------
    problem : Problem
    focus : (C,) array
        Metres.
    """
    cost, best = problem.evaluate(focus)
    return SampledQuality(
        points=problem.samples.points,
        spacing=float(np.sqrt(problem.samples.areas.mean())),
        cost=cost,
        picture=best,
        in_focus=problem.in_focus(focus, best),
        views=sharp_views(problem, focus),
        shots=problem.shots,
    )
