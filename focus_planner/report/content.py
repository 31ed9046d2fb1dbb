# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What is in a report, whatever draws it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from focus_planner.core.arrays import FloatArray, IntArray
from focus_planner.core.notes import Note
from focus_planner.core.planning.plan import FocusPlan
from focus_planner.core.planning.sharp_views import Resolution
from focus_planner.core.problem.cost_model import CostModel
from focus_planner.core.rig.lens import Lens
from focus_planner.core.rig.rig import Rig
from focus_planner.io.lens_sheet.content import LensSheet


@dataclass(frozen=True, eq=False)
class SampledSurface:
    """The surface as samples that no plan was made on, and which cameras see them.

    The P pairs of a sample and a camera that sees it are ordered by sample, then by camera.

    Attributes
    ----------
    points, normals : (N, 3) arrays
        Metres, in the rig's frame; normals outward, of unit length.
    areas : (N,) array
        Square metres.
    importance : (N,) array or None
        From 0 to 1, the greatest; None if all are equal.
    spacing : float
        Between neighbouring samples, metres.
    pair_offsets : (N + 1,) array
        Sample p's pairs are ``pair_offsets[p]`` to ``pair_offsets[p + 1]``.
    pair_camera : (P,) array of int32
        Index into the rig's cameras.
    pair_depth, pair_cost : (P,) arrays
        Metres along the optical axis, and the pair's cost in focus (paper, Eq. 1), 0 to 1.
    focus_weight : float
        What a pair costs more out of focus.
    model : CostModel
        What ``pair_cost`` comes from; its terms are told apart for a point.
    depth_tolerance : float
        That counts as in focus only what stays so when its depth is off by this much, metres.
    max_mm_per_pixel : float
        What a camera images more coarsely counts as unseen by it; inf without a limit.
    views : int
        That a sample needs: it costs the mean of so many of its least costs.
    """

    points: FloatArray
    normals: FloatArray
    areas: FloatArray
    importance: FloatArray | None
    spacing: float
    pair_offsets: NDArray[np.int64]
    pair_camera: IntArray
    pair_depth: FloatArray
    pair_cost: FloatArray
    focus_weight: float
    model: CostModel = field(default_factory=CostModel)
    depth_tolerance: float = 0.0
    max_mm_per_pixel: float = math.inf
    views: int = 1


@dataclass(frozen=True)
class Shares:
    """What becomes of the surface: shares of its area, as the plan itself tells them.

    They are estimated on the fresh samples of the plan, not on those of the report, so that a
    report says what the plan says everywhere else. What has no importance is in none of them.

    Attributes
    ----------
    sharp, blurred : float
        In focus in the camera that images it best, and seen but out of focus there.
    unseen : float
        Seen by no camera.
    views : tuple of float
        Of what some camera sees: in focus in no picture, in those of one camera, of two, and so on;
        the last is of as many cameras or more. Empty if unknown.
    """

    sharp: float
    blurred: float
    unseen: float
    views: tuple[float, ...] = ()


@dataclass(frozen=True, eq=False)
class ReportedPlan:
    """One of the plans that a report compares.

    Attributes
    ----------
    title : str
        "k_view", "closest (autofocus)".
    plan : FocusPlan
    cost : (N,) array
        Of each sample in the camera that images it best, 0 to 1; 1 where none sees it. Where
        several views are asked for, the mean over its best ones, 1 for each that is missing.
    camera : (N,) array of int32
        The camera that images it best; -1 where none sees it.
    in_focus : (N,) array of bool
        Whether it is in focus in that camera.
    sharp_views : (N,) array of int32
        How many cameras hold it in focus.
    pair_in_focus : (P,) array of bool
        Whether some shot of the pair's camera holds the sample in focus.
    held_area : (C,) array
        Square metres that each camera holds in focus.
    shares : Shares or None
        What becomes of the surface as a whole; None if only the samples tell.
    pictures : tuple of bytes
        WebP of what each camera will see, in the rig's order; empty if none were made.
    lenses : tuple of Lens
        That it was made for, in the rig's order; empty if those of the report's rig.
    sees_the_same : bool
        Whether the cameras that it was made for see the same samples as the report's: otherwise the
        pairs of the report do not tell of them.
    """

    title: str
    plan: FocusPlan
    cost: FloatArray
    camera: IntArray
    in_focus: NDArray[np.bool_]
    sharp_views: IntArray
    pair_in_focus: NDArray[np.bool_]
    held_area: FloatArray
    shares: Shares | None = None
    pictures: tuple[bytes, ...] = ()
    lenses: tuple[Lens, ...] = ()
    sees_the_same: bool = True


@dataclass(frozen=True)
class CostRow:
    """A row of the comparison of costs.

    Attributes
    ----------
    title : str
    cost : float or None
        On the samples that it was planned on.
    fresh_cost, standard_error : float or None
        On fresh samples.
    in_focus_share : float or None
        Of the surface.
    change : float or None
        Of the fresh cost, relative to autofocus.
    reported : bool
        Whether it is the plan that the report is about.
    other_samples : bool
        Whether it was planned on other samples than the plan that the report is about.
    other_measure : bool
        Whether it was planned for another number of views, or another limit of resolution: its cost
        as planned means something else.
    """

    title: str
    cost: float | None
    fresh_cost: float | None = None
    standard_error: float | None = None
    in_focus_share: float | None = None
    change: float | None = None
    reported: bool = False
    other_samples: bool = False
    other_measure: bool = False


@dataclass(frozen=True)
class SharpRow:
    """How much of the surface a plan has sharp in how many views, and how finely it is imaged.

    Attributes
    ----------
    title : str
    shares : tuple of (int, float, float)
        A number of views, the share of the surface that is sharp in at least so many, and its
        standard error; empty if not told.
    resolution : Resolution or None
        Of what is in focus.
    reported : bool
        Whether it is the plan that the report is about.
    """

    title: str
    shares: tuple[tuple[int, float, float], ...]
    resolution: Resolution | None
    reported: bool = False


@dataclass(frozen=True)
class Step:
    """A step of the search.

    Attributes
    ----------
    stage : str
    iteration : int
    cost, lower_bound : float or None
    elapsed : float or None
        Seconds since planning began; None if it was not recorded.
    """

    stage: str
    iteration: int
    cost: float | None
    lower_bound: float | None
    elapsed: float | None


@dataclass(frozen=True, eq=False)
class DepthHistogram:
    """How much of the surface a camera sees at which depth.

    Attributes
    ----------
    edges : (B + 1,) array
        Of the bins, metres along the optical axis; empty for a camera that sees nothing.
    areas : (B,) array
        Square metres.
    """

    edges: FloatArray
    areas: FloatArray


@dataclass(frozen=True, eq=False)
class ReportContent:
    """All that a report shows.

    Attributes
    ----------
    title : str
    verdict : str
        What the plan achieves, in a sentence or two.
    notes : tuple of Note
        The plan's, and the report's own about what it rests on.
    facts : tuple of (str, str)
        What was planned, when and by what: name and text.
    rig : Rig
    surface : SampledSurface
    plans : tuple of ReportedPlan
        The plan that the report is about first; then those it is compared with.
    costs : tuple of CostRow
        Plans, baselines and the lower bound.
    sharp : tuple of SharpRow
        Plan by plan.
    steps : tuple of Step
        Of the first plan; empty if unknown.
    sheet : LensSheet
        The table of cameras, which is printed to set lenses by.
    histograms : tuple of DepthHistogram
        Per camera.
    parameters, software : tuple of (str, Any)
        Of the run: names and values, names and versions.
    decimals : int
        That a distance takes, in metres, to be told more finely than depths of field are.
    """

    title: str
    verdict: str
    notes: tuple[Note, ...]
    facts: tuple[tuple[str, str], ...]
    rig: Rig
    surface: SampledSurface
    plans: tuple[ReportedPlan, ...]
    costs: tuple[CostRow, ...]
    steps: tuple[Step, ...]
    sheet: LensSheet
    histograms: tuple[DepthHistogram, ...]
    parameters: tuple[tuple[str, Any], ...] = ()
    software: tuple[tuple[str, str], ...] = ()
    decimals: int = 3
    sharp: tuple[SharpRow, ...] = ()
