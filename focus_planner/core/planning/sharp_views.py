# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""In how many views a surface is sharp, and how finely it is imaged, as plans tell it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from focus_planner.core.arrays import FloatArray, IntArray

if TYPE_CHECKING:
    # Importing it loads compiled kernels, and plans are also read where nothing is planned.
    from focus_planner.core.problem.problem import Problem

#: The numbers of views that every plan tells the sharp area of.
TOLD_VIEWS = (1, 2, 3, 5)


@dataclass(frozen=True)
class SharpArea:
    """The part of a surface that is sharp in at least so many views.

    Attributes
    ----------
    views : int
    area : float
        Square metres.
    standard_error : float
        Of the area, square metres.
    """

    views: int
    area: float
    standard_error: float


@dataclass(frozen=True)
class Resolution:
    """How finely the surface that is in focus is imaged by the camera that images it best.

    By area of what is in focus there; along the surface, in the direction in which it is coarsest
    (:mod:`focus_planner.core.surface.resolution`).

    Attributes
    ----------
    median : float
        Millimetres per pixel.
    percentile_90 : float
        90 % of that area is imaged at so many millimetres per pixel or fewer.
    """

    median: float
    percentile_90: float


def pairs_in_focus(problem: Problem, focus: FloatArray) -> NDArray[np.bool_]:
    """Return (P,) whether focus distances (C,), metres, hold each pair of a problem in focus."""
    chosen = focus[problem.camera_index]
    held: NDArray[np.bool_] = (problem.focus_near <= chosen) & (chosen <= problem.focus_far)
    return held


def sharp_views(problem: Problem, focus: FloatArray) -> IntArray:
    """Return (N,) in how many views each sample of a problem is sharp.

    It is sharp in a view if the camera sees it and holds it in focus in at least one of its shots:
    shots of one camera are one view.

    Parameters
    ----------
    problem : Problem
    focus : (C,) array
        Metres.
    """
    held = np.flatnonzero(pairs_in_focus(problem, focus))
    sample, view = problem.sample_index[held], problem.view[problem.camera_index[held]]
    # Pairs are ordered by sample, then by camera: a view's pairs of a sample are neighbours.
    first = np.ones(len(held), dtype=np.bool_)
    first[1:] = (sample[1:] != sample[:-1]) | (view[1:] != view[:-1])
    return np.bincount(sample[first], minlength=problem.sample_count).astype(np.int32)
