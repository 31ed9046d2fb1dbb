"""What a plan is asked for with, and what it says."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from focus_planner.core.arrays import FloatArray

if TYPE_CHECKING:
    # It compiles kernels; requests and plans are also read where nothing is planned.
    from focus_planner.core.problem.problem import Problem


from enum import IntEnum


class CameraStatus(IntEnum):
    """What a plan says of one camera; equal to the constants of ``CameraFocus.msg``."""

    UNKNOWN = 0
    PLANNED = 1
    UNASSIGNED = 2
    SEES_NOTHING = 3


@dataclass(frozen=True)
class Shot:
    """One picture that a camera is to take.

    Attributes
    ----------
    focus_distance : float
        Along the optical axis from the centre of projection, metres.
    near_limit, far_limit : float
        What is sharp there, metres; far may be inf.
    assigned_samples : int
        Samples that this shot images better than all others of all cameras.
    in_focus_samples : int
        Those of them that are in focus, within the depth tolerance.
    device_value : float or None
        What the lens's table has for the distance; None without a table.
    """

    focus_distance: float
    near_limit: float
    far_limit: float
    assigned_samples: int
    in_focus_samples: int
    device_value: float | None = None


@dataclass(frozen=True)
class CameraFocus:
    """What a plan says of one camera.

    Attributes
    ----------
    name : str
    status : CameraStatus
    focus_distance, near_limit, far_limit : float
        Those of the shot that images most samples best, metres; see :class:`Shot`.
    assigned_samples, in_focus_samples : int
        Totals of all shots.
    shots : tuple of Shot
        Ascending by focus distance, as many for every camera of a plan. One that images nothing
        best has no samples assigned and may be left out.
    device_value : float or None
        What the lens's table has for ``focus_distance``; None without a table.
    device_unit : str or None
        The table's unit.
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


@dataclass(frozen=True)
class FocusPlan:
    """Focus distances for a rig, and how good they are.

    On the samples that the solver was given a plan looks better than it is, and the fewer they
    are the more so. Fresh samples, drawn independently of them, tell its cost and its areas
    without that bias. They depend on the seed alone, so plans of one surface and seed are judged
    on the same ones.

    Attributes
    ----------
    method : str
    cost : float
        1000 × the mean over the solver's samples, by weight, of the pointwise cost (Eq. 3).
    lower_bound : float or None
        No plan for the solver's samples costs less on them.
    converged : bool
        False if the time budget, or the watch, ended the solver or left samples out, or if
        ``optimal`` could not prove its gap.
    samples, seed : int
    depth_tolerance : float
        Metres; what it was planned with.
    fresh_cost, fresh_standard_error : float
        The same mean over the fresh samples, and its standard error.
    fresh_samples : int
    surface_area, covered_area, in_focus_area : float
        Of the surface, of what some camera sees, and of what is in focus in the camera that
        images it best; square metres. The last two are estimated on the fresh samples, and leave
        out what has no importance.
    in_focus_standard_error : float
        Of ``in_focus_area``, square metres.
    solve_seconds, total_seconds : float
    cameras : tuple of CameraFocus
        In the rig's order.
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
    cameras: tuple[CameraFocus, ...]

    @property
    def gap(self) -> float | None:
        """By what part of its cost at most another plan could be cheaper on these samples."""
        if self.lower_bound is None:
            return None
        return (self.cost - self.lower_bound) / self.cost if self.cost else 0.0

    @property
    def shots(self) -> int:
        """How many shots each camera takes."""
        return len(self.cameras[0].shots) if self.cameras else 1

    def summary(self) -> str:
        """Return in one line how good the plan is."""
        text = (
            f"{self.method}, cost {self.cost:.1f} on {self.samples} samples,"
            f" {self.fresh_cost:.1f} ± {self.fresh_standard_error:.1f} on {self.fresh_samples}"
            f" fresh ones, in {self.total_seconds:.3f} s"
        )
        if self.gap is not None:
            text += f", within {100 * self.gap:.3g} % of the best"
        return text if self.converged else f"{text}, ended before it converged"

    @property
    def focus_distances(self) -> FloatArray:
        """(C · shots,) metres, camera by camera: what a ``Problem`` of as many shots evaluates."""
        return np.array([shot.focus_distance for camera in self.cameras for shot in camera.shots])


@dataclass(frozen=True, eq=False)
class WarmStart:
    """What a plan leaves to the next.

    Attributes
    ----------
    names : tuple of str
        The C cameras of the problem that was solved: with several shots each of the rig's as
        often, one after the other.
    focus_distances : (C,) array
        Metres.
    points : (N, 3) array
        The samples, metres.
    prices : (N,) array, optional
        Theirs, 0 to 1, if a bound was made.
    """

    names: tuple[str, ...]
    focus_distances: FloatArray
    points: FloatArray
    prices: FloatArray | None


@dataclass(frozen=True)
class SolvedPlan(FocusPlan):
    """A plan that was just made.

    Attributes
    ----------
    problem : Problem
        What was solved; with several shots each camera stands in it as often.
    fresh_problem : Problem
        What it was judged on.
    prices : (N,) array or None
        Of the samples of ``problem``, 0 to 1, that prove the lower bound.
    answers : tuple of int
        How often in a row the time budget and the watch let it go on, then how often not, and so
        on: with these it is made again, bit for bit, whatever the clock says.
    """

    problem: Problem = field(repr=False, compare=False)
    fresh_problem: Problem = field(repr=False, compare=False)
    prices: FloatArray | None = field(repr=False, compare=False)
    answers: tuple[int, ...] = field(repr=False, compare=False)

    @property
    def warm_start(self) -> WarmStart:
        """What the next plan can start from."""
        return WarmStart(
            self.problem.names, self.focus_distances, self.problem.samples.points, self.prices
        )
