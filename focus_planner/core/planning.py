"""From a scene, a rig and a request to a plan: the one path that every user takes."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from focus_planner.core import kernels
from focus_planner.core.checks import InputError, check_choice, check_number, check_whole
from focus_planner.core.deadline import FRESH_SHARE, SAMPLES_SHARE, Deadline
from focus_planner.core.diagnosis import (
    check_cameras_outside,
    check_depths,
    check_distance,
    explain_unseen,
)
from focus_planner.core.optics import depth_of_field
from focus_planner.core.problem import Problem, build_problem, mean_cost, settable
from focus_planner.core.proof.bound import lower_bound
from focus_planner.core.quality import judge
from focus_planner.core.scene import Scene
from focus_planner.core.shots import sort_shots, spread_start, with_shots
from focus_planner.core.solvers import SOLVERS, Options, Solution, Watch, go_on
from focus_planner.core.surface import Density
from focus_planner.core.types import (
    MAX_CAMERAS,
    CameraStatus,
    CostModel,
    FloatArray,
    Mesh,
    Rig,
    Samples,
)
from focus_planner.core.visibility import visible_pairs
from focus_planner.core.warm_start import Warmth, warm_options

METHODS = tuple(SOLVERS)
SCOPES = ("all", "assigned")
TUPLES = ("overlap", "grid")
BOUNDS = ("none", "quick", "tight")
#: More would need more memory than rigs' computers have, and change no plan.
MAX_SAMPLES = 2_000_000
MAX_SHOTS = 16
# A quick bound's price steps: on bodies it is then within a quarter of a percent, in about the time
# that a 2-view plan takes.
_QUICK_STEPS = 60
# Enough to tell the costs' standard deviation to three percent; that it is EM's adds two, on the
# safe side.
_PILOT_SAMPLES = 2048


@dataclass(frozen=True)
class PlanRequest:
    """What to plan with.

    Parameters
    ----------
    method : {"closest", "average", "em", "k_view", "optimal"}
    samples : int
        How many to plan on. 0 takes a cloud's points themselves, and on a mesh as many as
        ``standard_error`` asks for.
    seed : int
    k : {2, 3}
        How many cameras ``k_view`` moves together.
    scope : {"all", "assigned"}
        Which samples a ``k_view`` step may re-assign.
    tuples : {"overlap", "grid"}
        Whether ``k_view`` takes its tuples from what the cameras see or from the rig's grid.
    time_budget : float
        Seconds after which to return the best plan so far, with its bound; inf for no limit. What
        rays cannot be cast for in half of it is left out of the samples.
    shots : int
        How many pictures each camera takes, each with a focus distance of its own, planned
        together; 1 to 16.
    depth_tolerance : float
        How far, in metres, a sample's depth may be off either way: it counts as in focus only
        where all these depths are.
    fresh_samples : int
        How many to judge the plan on, which the solver does not see.
    standard_error : float
        Where ``samples`` is 0 on a mesh, the standard error that the cost is to have, in its
        unit: both numbers of samples, to plan on and to judge on, are then chosen for it.
    bound : {"none", "quick", "tight"}
        What to spend on a lower bound of a plan that comes without one: nothing, about as much
        as on a 2-view plan, or until it hardly rises any more. ``optimal`` always has its own.
    gap : float
        ``optimal`` stops when its plan is proven to cost at most this part of its cost too much,
        and so does a tight bound.

    Raises
    ------
    InputError
        If a value is out of range.
    """

    method: str = "k_view"
    samples: int = 4096
    seed: int = 0
    k: int = 2
    scope: str = "all"
    tuples: str = "overlap"
    time_budget: float = np.inf
    shots: int = 1
    depth_tolerance: float = 0.0
    fresh_samples: int = 4096
    standard_error: float = 2.0
    bound: str = "quick"
    gap: float = 1e-6

    def __post_init__(self) -> None:
        check_choice("method", self.method, METHODS)
        for name, at_least in (("samples", 0), ("fresh_samples", 2)):
            number = getattr(self, name)
            if check_whole(name, number, at_least) > MAX_SAMPLES:
                raise InputError(name, f"at most {MAX_SAMPLES}", str(number))
        check_whole("seed", self.seed, 0)
        if isinstance(self.k, bool) or not isinstance(self.k, int) or self.k not in (2, 3):
            raise InputError("k", "2 or 3", repr(self.k))
        check_choice("scope", self.scope, SCOPES)
        check_choice("tuples", self.tuples, TUPLES)
        check_number("time_budget", self.time_budget, above=0, infinite=True)
        if check_whole("shots", self.shots, 1) > MAX_SHOTS:
            raise InputError("shots", f"at most {MAX_SHOTS}", str(self.shots))
        check_number("depth_tolerance", self.depth_tolerance, at_least=0)
        check_number("standard_error", self.standard_error, above=0)
        check_choice("bound", self.bound, BOUNDS)
        check_number("gap", self.gap, at_least=0)


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
    """

    focus_distance: float
    near_limit: float
    far_limit: float
    assigned_samples: int
    in_focus_samples: int


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
    """

    name: str
    status: CameraStatus
    focus_distance: float
    near_limit: float
    far_limit: float
    assigned_samples: int
    in_focus_samples: int
    shots: tuple[Shot, ...]


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

    @property
    def focus_distances(self) -> FloatArray:
        """(C · shots,) metres, camera by camera: what a ``Problem`` of as many shots evaluates."""
        return np.array([shot.focus_distance for camera in self.cameras for shot in camera.shots])


@dataclass(frozen=True)
class SolvedPlan(FocusPlan):
    """A plan that was just made.

    Attributes
    ----------
    converged : bool
        False if the time budget, or the watch, ended the solver or left samples out, or if
        ``optimal`` could not prove its gap.
    problem : Problem
        What was solved; with several shots each camera stands in it as often.
    prices : (N,) array or None
        Of its samples, 0 to 1, that prove the lower bound.
    """

    converged: bool
    problem: Problem = field(repr=False, compare=False)
    prices: FloatArray | None = field(repr=False, compare=False)


def plan_focus(
    scene: Scene,
    rig: Rig,
    request: PlanRequest | None = None,
    model: CostModel | None = None,
    watch: Watch = go_on,
    before: SolvedPlan | None = None,
) -> SolvedPlan:
    """Sample the surface, find what each camera sees, and solve for the focus distances.

    The same arguments give the same plan, bit for bit, but for its seconds, unless a time budget
    or the watch ends it.

    Parameters
    ----------
    scene : Scene
        Of the surface, in the rig's frame.
    rig : Rig
    request : PlanRequest, optional
    model : CostModel, optional
        The paper's constants by default.
    watch : callable, optional
        Told of every step: of ray casting (stages "fresh" and "visibility", of no cost yet), of
        the solver, of the bound ("prices"); answers whether to go on. If not, the plan is the
        best so far.
    before : SolvedPlan, optional
        Of a similar surface, rig and request, to start from; the plan depends on it then.

    Raises
    ------
    InputError
        If the request does not fit the rig or the surface, no camera sees the surface, or the
        standard error would take too many samples; the message says what was suspected.
    """
    request = request or PlanRequest()
    options = _options(rig, request)
    deadline = Deadline(request.time_budget, watch)
    request = choose_samples(scene, rig, request, model, deadline)
    asked = watch is not go_on or request.time_budget < np.inf
    fresh_part, part = (
        deadline.within(stage, share) if asked else None
        for stage, share in (("fresh", FRESH_SHARE), ("visibility", SAMPLES_SHARE))
    )
    fresh = pose_fresh_problem(scene, rig, request, model, go_on=fresh_part)
    problem = pose_problem(scene, rig, request, model, go_on=part)
    options = replace(options, start=spread_start(problem))
    if before is not None:
        warmth = Warmth(before.problem, before.focus_distances, before.prices)
        options = warm_options(options, warmth, problem)
    posed = time.perf_counter()
    with kernels.threads_for(len(problem.depth)):
        _ = problem.cells
    bounded = request.bound != "none" and request.method != "optimal"
    deadline.allow_for(time.perf_counter() - posed, bounded)
    with kernels.threads_for(len(problem.depth)):
        solution = SOLVERS[request.method](problem, options, deadline)
        solved = time.perf_counter()
        if bounded:
            deadline.bound_now()
            solution = _bounded(problem, solution, request, options, deadline)
    return _plan(
        scene,
        problem,
        fresh,
        request,
        solution,
        shortened=deadline.shortened,
        solve_seconds=solved - posed,
        started=deadline.started,
    )


def _bounded(
    problem: Problem, solution: Solution, request: PlanRequest, options: Options, watch: Watch
) -> Solution:
    """Return a solution that comes without a lower bound, with one."""
    near = solution.cost
    if request.method in {"closest", "average"}:
        near = SOLVERS["em"](problem, options).cost
    steps = _QUICK_STEPS if request.bound == "quick" else None
    bound = lower_bound(problem, solution.cost, near, options, watch, steps)
    return replace(solution, lower_bound=bound.lower_bound, prices=bound.prices)


def pose_problem(
    scene: Scene,
    rig: Rig,
    request: PlanRequest,
    model: CostModel | None = None,
    by: Density = "importance",
    go_on: Callable[[], bool] | None = None,
) -> Problem:
    """Return the discrete problem that a request poses, on samples by importance or by area.

    Parameters
    ----------
    scene, rig, request, model
        As for :func:`plan_focus`.
    go_on : callable, optional
        Asked every few hundredths of a second of ray casting whether to go on. If not, the
        problem is that of the samples so far, which are fewer and as fairly drawn.

    Raises
    ------
    InputError
        As :func:`plan_focus`.
    """
    request = choose_samples(scene, rig, request, model)
    shots = len(rig) * request.shots
    if request.method == "k_view" and request.k > shots:
        raise InputError(
            "k",
            f"at most {shots}, the number of cameras"
            + (" times shots" if request.shots > 1 else ""),
            str(request.k),
            "a single camera is planned for with method em",
        )
    if shots > MAX_CAMERAS:
        raise InputError(
            "shots", f"at most {MAX_CAMERAS // len(rig)} for {len(rig)} cameras", str(request.shots)
        )
    check_distance(scene, rig)
    check_cameras_outside(scene, rig)
    samples = scene.sample(request.samples, request.seed, by)
    visibility = visible_pairs(scene, rig, samples, go_on, _fair_order(request, samples, go_on))
    samples = _standing_for_all(samples, visibility.taken)
    if not samples.weights.any():
        raise InputError(
            "samples", "enough for one to have some importance", str(request.samples), "take more"
        )
    explain_unseen(scene, rig, samples, visibility)
    problem = build_problem(samples, visibility, rig, model, request.depth_tolerance)
    check_depths(scene, problem, request.depth_tolerance)
    return with_shots(problem, request.shots)


def pose_fresh_problem(
    scene: Scene,
    rig: Rig,
    request: PlanRequest,
    model: CostModel | None = None,
    by: Density = "importance",
    go_on: Callable[[], bool] | None = None,
) -> Problem:
    """Return the discrete problem that a request's plan is judged on.

    Parameters
    ----------
    scene, rig, request, model, by, go_on
        As for :func:`pose_problem`.

    Raises
    ------
    InputError
        As :func:`choose_samples`.
    """
    request = choose_samples(scene, rig, request, model)
    samples = scene.fresh_samples(request.fresh_samples, request.seed, by)
    visibility = visible_pairs(scene, rig, samples, go_on)
    samples = _standing_for_all(samples, visibility.taken)
    problem = build_problem(samples, visibility, rig, model, request.depth_tolerance)
    return with_shots(problem, request.shots)


def choose_samples(
    scene: Scene,
    rig: Rig,
    request: PlanRequest,
    model: CostModel | None = None,
    watch: Watch = go_on,
) -> PlanRequest:
    """Return the request with as many samples on a mesh as its standard error asks for.

    The standard error falls with the square root of the number of samples; what it is for a few
    of them, at the focus distances of EM on those, tells how many it takes. A request that says
    how many, or takes a cloud's points, is returned as it is.

    Raises
    ------
    InputError
        If it takes too many, or as :func:`plan_focus`.
    """
    if request.samples or not isinstance(scene.surface, Mesh):
        return request
    pilot = pose_problem(scene, rig, replace(request, method="em", samples=_PILOT_SAMPLES), model)
    with kernels.threads_for(len(pilot.depth)):
        solution = SOLVERS["em"](pilot, Options(start=spread_start(pilot)), watch)
    quality = judge(pilot, fill_in(pilot, solution.focus_distances))
    ratio = quality.cost.standard_error / request.standard_error
    enough = _PILOT_SAMPLES * ratio * ratio
    if enough > MAX_SAMPLES:
        least = quality.cost.standard_error * math.sqrt(_PILOT_SAMPLES / MAX_SAMPLES)
        raise InputError(
            "standard_error",
            f"at least {1.005 * least:.3g} for this surface and rig",  # rounded, still enough
            f"{request.standard_error:g}",
            f"it would take {enough:.3g} samples, and {MAX_SAMPLES} is the most",
        )
    count = max(_PILOT_SAMPLES, math.ceil(enough))
    return replace(request, samples=count, fresh_samples=count)


def _fair_order(
    request: PlanRequest, samples: Samples, go_on: Callable[[], bool] | None
) -> NDArray[np.int64] | None:
    """Return the order in which the first samples stand for all, if it is not their own.

    A cloud's own points come as they were scanned, place by place.
    """
    if go_on is None or request.samples > 0:
        return None
    return np.random.default_rng(request.seed).permutation(len(samples))


def _standing_for_all(samples: Samples, taken: NDArray[np.int64]) -> Samples:
    """Return the samples taken; each stands for as much more of the surface as they are fewer."""
    if len(taken) == len(samples):
        return samples
    part = samples.take(taken)
    return replace(
        part,
        areas=part.areas * (samples.areas.sum() / part.areas.sum()),
        weights=part.weights * (samples.weights.sum() / (part.weights.sum() or 1.0)),
    )


def _options(rig: Rig, request: PlanRequest) -> Options:
    if request.method == "k_view" and request.tuples == "grid" and rig.grid is None:
        raise InputError(
            "tuples", "overlap, for a rig without a grid", "'grid'", "or give the rig's grid"
        )
    return Options(
        k=request.k,
        scope=request.scope,
        grid=rig.grid if request.tuples == "grid" else None,
        gap=request.gap,
    )


def _plan(
    scene: Scene,
    problem: Problem,
    fresh: Problem,
    request: PlanRequest,
    solution: Solution,
    *,
    shortened: bool,
    solve_seconds: float,
    started: float,
) -> SolvedPlan:
    focus = sort_shots(problem, fill_in(problem, solution.focus_distances))
    costs, best = problem.evaluate(focus)
    count = problem.camera_count
    assigned = np.bincount(best[best >= 0], minlength=count)
    in_focus = np.bincount(best[problem.in_focus(focus, best)], minlength=count)
    shots = []
    for c, lens in enumerate(problem.lenses):
        near, far = depth_of_field(focus[c], lens)
        shots.append(
            Shot(float(focus[c]), float(near), float(far), int(assigned[c]), int(in_focus[c]))
        )
    cameras = [
        _camera_focus(problem, c, tuple(shots[c : c + problem.shots]))
        for c in range(0, count, problem.shots)
    ]
    quality = judge(fresh, focus)
    cost = mean_cost(problem.samples.weights, costs)
    bound = solution.lower_bound
    return SolvedPlan(
        method=request.method,
        cost=cost,
        lower_bound=None if bound is None else min(bound, cost),
        samples=problem.sample_count,
        seed=request.seed,
        depth_tolerance=request.depth_tolerance,
        fresh_cost=quality.cost.value,
        fresh_standard_error=quality.cost.standard_error,
        fresh_samples=fresh.sample_count,
        surface_area=scene.area,
        covered_area=quality.covered_area.value,
        in_focus_area=quality.in_focus_area.value,
        in_focus_standard_error=quality.in_focus_area.standard_error,
        solve_seconds=solve_seconds,
        total_seconds=time.perf_counter() - started,
        cameras=tuple(cameras),
        converged=solution.converged and not shortened,
        problem=problem,
        prices=solution.prices,
    )


def _camera_focus(problem: Problem, first: int, shots: tuple[Shot, ...]) -> CameraFocus:
    """Return what the shots of one camera, whose first is ``first`` in the problem, amount to."""
    main = max(shots, key=lambda shot: shot.assigned_samples)
    assigned = sum(shot.assigned_samples for shot in shots)
    status = CameraStatus.PLANNED if assigned else CameraStatus.UNASSIGNED
    sees = problem.camera_offsets[first] < problem.camera_offsets[first + 1]
    return CameraFocus(
        name=problem.names[first],
        status=status if sees else CameraStatus.SEES_NOTHING,
        focus_distance=main.focus_distance,
        near_limit=main.near_limit,
        far_limit=main.far_limit,
        assigned_samples=assigned,
        in_focus_samples=sum(shot.in_focus_samples for shot in shots),
        shots=shots,
    )


def fill_in(problem: Problem, focus: FloatArray) -> FloatArray:
    """Give cameras without a distance of their own the others' median, as far as their lens goes.

    They see nothing, or nothing they can focus: any distance does, but a lens will be set to it.
    """
    missing = ~np.isfinite(focus)
    wanted = np.array([lens.hyperfocal_distance for lens in problem.lenses])
    if not missing.all():
        wanted[:] = np.nanmedian(focus)
    wanted = np.maximum(wanted, [2 * lens.focal_length for lens in problem.lenses])
    settled = settable(problem.lenses, np.arange(problem.camera_count), wanted)
    return np.where(missing, settled, focus)
