# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A plan: a focus distance per camera and shot, and how good they are."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import IntEnum
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from focus_planner.core.arrays import FloatArray
from focus_planner.core.brief import brief_repr
from focus_planner.core.notes import Note
from focus_planner.core.planning.plan_text import for_views, plan_line, plan_text
from focus_planner.core.planning.sharp_views import Resolution, SharpArea
from focus_planner.core.planning.stop_log import StopLog
from focus_planner.core.planning.subject_quality import SubjectQuality

if TYPE_CHECKING:
    # Importing it loads compiled kernels, and plans are also read where nothing is planned.
    from focus_planner.core.problem.problem import Problem


class CameraStatus(IntEnum):
    """What a camera has to do in a plan; equal to the constants of ``CameraFocus.msg``."""

    UNKNOWN = 0
    PLANNED = 1
    UNASSIGNED = 2
    SEES_NOTHING = 3
    DROPPED = 4


@dataclass(frozen=True)
class Shot:
    """One picture that a camera is to take.

    Attributes
    ----------
    focus_distance : float
        Along the optical axis from the centre of projection, metres.
    near_limit, far_limit : float
        The depth of field, metres; far may be inf.
    assigned_samples : int
        Samples that this shot images best of all shots of all cameras; in a plan for several
        views, samples of which it is one of the best views.
    in_focus_samples : int
        How many of them are in focus, given the depth tolerance.
    device_value : float or None
        The distance in the unit of the lens's table; None without a table.
    from_sensor : float or None
        The same distance as a focus ring is marked, from the sensor plane, metres; see
        :func:`~focus_planner.core.rig.optics.distance_from_sensor`. None in plans of versions that
        did not tell it.
    """

    focus_distance: float
    near_limit: float
    far_limit: float
    assigned_samples: int
    in_focus_samples: int
    device_value: float | None = None
    from_sensor: float | None = None

    def holds(self, depths: NDArray[np.floating], tolerance: float) -> NDArray[np.bool_]:
        """Return where a depth, and all that differ from it by the tolerance, are in focus.

        Parameters
        ----------
        depths : array
            Metres; inf, where nothing is, is never in focus.
        tolerance : float
            The plan's depth tolerance, metres.
        """
        held: NDArray[np.bool_] = (
            np.isfinite(depths)
            & (depths >= self.near_limit + tolerance)
            & (depths <= self.far_limit - tolerance)
        )
        return held


@dataclass(frozen=True)
class CameraFocus:
    """One camera's part of a plan.

    Attributes
    ----------
    name : str
    status : CameraStatus
    focus_distance, near_limit, far_limit : float
        Those of the shot with the most samples assigned, metres; see :class:`Shot`. Without any
        shot, a harmless neutral distance.
    assigned_samples, in_focus_samples : int
        Totals of all shots.
    shots : tuple of Shot
        Ascending by focus distance, the same number for every camera of a plan unless pictures are
        limited: a camera may then have fewer, or none. A shot without assigned samples need not be
        taken.
    device_value : float or None
        ``focus_distance`` in the unit of the lens's table; None without a table.
    device_unit : str or None
        The table's unit.
    from_sensor : float or None
        ``focus_distance`` as a focus ring is marked, from the sensor plane, metres; see
        :class:`Shot`.
    """

    name: str
    status: CameraStatus
    focus_distance: float
    near_limit: float
    far_limit: float
    assigned_samples: int
    in_focus_samples: int
    shots: tuple[Shot, ...]
    device_value: float | None = None
    device_unit: str | None = None
    from_sensor: float | None = None

    __repr__ = brief_repr


@dataclass(frozen=True)
class FocusPlan:
    """Focus distances for a rig, and how good they are.

    A plan looks better than it is on the samples that the solver was given, the more so the fewer
    they are. Its cost and areas on fresh samples, drawn independently, are free of that bias.
    Fresh samples depend on nothing but the surface and the seed, so plans with these in common
    are compared on the same ones; see ``docs/quality.md``.

    Attributes
    ----------
    method : str
    cost : float
        1000 × the mean over the solver's samples, by weight, of the pointwise cost (Eq. 3); with
        several ``views`` of the mean over a sample's best ones. Of several subjects the mean of
        their costs, by weight, or what the worst of them costs if that was planned for.
    lower_bound : float or None
        No plan for the solver's samples costs less on them.
    converged : bool
        False if the time budget or the callback ended the solver or left samples out, or if
        ``optimal`` could not prove its gap.
    samples, seed : int
    depth_tolerance : float
        The request's, metres.
    fresh_cost, fresh_standard_error : float
        The same over the fresh samples, and its standard error.
    fresh_samples : int
    surface_area, covered_area, in_focus_area : float
        Of the surface, of the part that some camera sees, and of the part that is in focus in the
        camera that images it best; square metres. The last two are estimated on the fresh samples
        and leave out surface of no importance. Of several subjects each is the mean, by weight:
        that of a subject on average.
    in_focus_standard_error : float
        Of ``in_focus_area``, square metres.
    solve_seconds, total_seconds : float
    notes : tuple of Note
        What its user should know: suspected mistakes in the inputs, assumptions, what was left out.
    cameras : tuple of CameraFocus
        In the rig's order.
    views : int
        The request's number of views. Costs of plans for different numbers do not compare.
    images : int
        The request's limit of pictures; 0 for none.
    max_mm_per_pixel : float
        The request's: what is imaged more coarsely counts as unseen. Inf without limit.
    sharp_areas : tuple of SharpArea
        The parts that are sharp in at least 1, 2, 3 and 5 views, estimated on the fresh samples.
        Any camera counts, not only the one that images the surface best, so what is sharp in 1 view
        is more than what is in focus. Empty in plans of versions that did not tell it.
    resolution : Resolution or None
        How finely the part in focus is imaged, estimated on the fresh samples; None if there is
        none, or it was not told.
    subjects : tuple of SubjectQuality
        What the plan is worth for each of several; empty for one.
    """

    method: str
    cost: float
    lower_bound: float | None
    converged: bool
    samples: int
    seed: int
    depth_tolerance: float
    fresh_cost: float
    fresh_standard_error: float
    fresh_samples: int
    surface_area: float
    covered_area: float
    in_focus_area: float
    in_focus_standard_error: float
    solve_seconds: float
    total_seconds: float
    notes: tuple[Note, ...]
    cameras: tuple[CameraFocus, ...]
    views: int = field(default=1, kw_only=True)
    images: int = field(default=0, kw_only=True)
    max_mm_per_pixel: float = field(default=math.inf, kw_only=True)
    sharp_areas: tuple[SharpArea, ...] = field(default=(), kw_only=True)
    resolution: Resolution | None = field(default=None, kw_only=True)
    subjects: tuple[SubjectQuality, ...] = field(default=(), kw_only=True)

    @property
    def worst(self) -> SubjectQuality | None:
        """The subject that costs most on its fresh samples; None for a plan for one."""
        return max(self.subjects, key=lambda each: each.fresh_cost, default=None)

    @property
    def is_for_worst(self) -> bool:
        """Whether the cost, and its bound, are those of the worst subject, not of the mean."""
        return any(each.multiplier for each in self.subjects)

    @property
    def gap(self) -> float | None:
        """(cost − lower bound) / cost: at most this much can be saved on these samples."""
        if self.lower_bound is None:
            return None
        return (self.cost - self.lower_bound) / self.cost if self.cost else 0.0

    @property
    def shots(self) -> int:
        """How many shots each camera takes; if pictures are limited, at most."""
        return max([1, *(len(camera.shots) for camera in self.cameras)])

    @property
    def slots(self) -> tuple[Shot | None, ...]:
        """(C · shots,) the shots of all cameras, None after those of a camera that takes fewer."""
        shots = self.shots
        return tuple(
            shot
            for camera in self.cameras
            for shot in (*camera.shots, *(shots - len(camera.shots)) * (None,))
        )

    @property
    def pictures(self) -> int:
        """How many pictures all cameras take."""
        return sum(len(camera.shots) for camera in self.cameras)

    @property
    def sensor_offsets(self) -> tuple[float, float] | None:
        """By how much distances from the sensor are greater, least and most; None if not told."""
        shots = [shot for camera in self.cameras for shot in camera.shots]
        offsets = [s.from_sensor - s.focus_distance for s in shots if s.from_sensor is not None]
        return (min(offsets), max(offsets)) if offsets else None

    def summary(self) -> str:
        """Return the plan's quality in one line."""
        text = (
            f"{self.method}, cost {self.cost:.1f}{for_views(self)} on {self.samples} samples,"
            f" {self.fresh_cost:.1f} ± {self.fresh_standard_error:.1f} on {self.fresh_samples}"
            f" fresh ones, in {self.total_seconds:.3f} s"
        )
        if self.gap is not None:
            text += f", within {100 * self.gap:.3g} % of the best"
        if not self.converged:
            text += ", ended before it converged"
        if self.worst is not None and len(self.subjects) > 1:
            text += f"; worst of {len(self.subjects)} subjects: {self.worst.surface}"
        codes = ", ".join(dict.fromkeys(note.code for note in self.notes))
        return f"{text}; see its notes: {codes}" if codes else text

    def __str__(self) -> str:
        """Return the plan in a few lines: its quality, and what its cameras have to do."""
        return plan_text(self)

    def __repr__(self) -> str:
        return plan_line(self)

    @property
    def focus_distances(self) -> FloatArray:
        """(C · shots,) metres, camera by camera, as ``Problem.evaluate`` takes them.

        -inf, after those that are, for shots that are not taken.
        """
        return np.array([-np.inf if shot is None else shot.focus_distance for shot in self.slots])


@dataclass(frozen=True, eq=False)
class WarmStart:
    """The parts of a plan that the next one can start from.

    Attributes
    ----------
    names : tuple of str
        The C cameras of the problem that was solved: with several shots, each camera of the rig
        is repeated once per shot.
    focus_distances : (C,) array
        Metres.
    points : (N, 3) array
        The samples, metres.
    prices : (N,) array, optional
        The samples' prices, 0 to 1, if a bound was computed.
    """

    names: tuple[str, ...]
    focus_distances: FloatArray
    points: FloatArray
    prices: FloatArray | None

    __repr__ = brief_repr


@dataclass(frozen=True, repr=False)
class SolvedPlan(FocusPlan):
    """A plan together with what it came from.

    Attributes
    ----------
    problem : Problem
        The problem that was solved; with several shots, each camera is in it once per shot.
    fresh_problem : Problem
        The problem on the fresh samples.
    prices : (N,) array or None
        Of the samples of ``problem``, 0 to 1; they prove the lower bound. That of a worst subject
        is proven with each subject's samples weighted by its multiplier.
    stop_log : StopLog
        Where the time budget or the callback ended it: with this log it can be made again, bit
        for bit, on any machine.
    """

    problem: Problem = field(compare=False)
    fresh_problem: Problem = field(compare=False)
    prices: FloatArray | None = field(compare=False)
    stop_log: StopLog = field(compare=False)

    @property
    def warm_start(self) -> WarmStart:
        """The parts that the next plan can start from."""
        return WarmStart(
            self.problem.names, self.focus_distances, self.problem.samples.points, self.prices
        )
