# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""From a scene, a rig and a request to the discrete problem."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from focus_planner.core import kernels
from focus_planner.core.planning.diagnosis import (
    SEEN_MOSTLY,
    check_cameras_outside,
    check_depths,
    check_distance,
    check_resolution,
    explain_unseen,
)
from focus_planner.core.planning.methods import solver_of
from focus_planner.core.planning.quality import estimate_quality
from focus_planner.core.planning.request import MAX_SAMPLES, PlanRequest
from focus_planner.core.problem.cost_model import CostModel
from focus_planner.core.problem.joined import concatenate, separated
from focus_planner.core.problem.problem import Problem, build_problem
from focus_planner.core.problem.shots import spread_start, with_shots
from focus_planner.core.progress import ProgressCallback, never_stop
from focus_planner.core.rig.remembered import remembered
from focus_planner.core.rig.rig import MAX_CAMERAS, Rig
from focus_planner.core.solvers import Options
from focus_planner.core.solvers.solution import fill_missing_distances
from focus_planner.core.surface.resolution import only_pairs, pairs_metres_per_pixel
from focus_planner.core.surface.sampling import Density
from focus_planner.core.surface.scene import Scene
from focus_planner.core.surface.surface import Mesh, Samples
from focus_planner.core.surface.visibility import Visibility, visible_pairs
from focus_planner.core.validation import InputError

# Enough to know the costs' standard deviation within three percent; that of EM's plan is another
# two percent too large, which is on the safe side.
_PILOT_SAMPLES = 2048
# Enough samples to tell whether a surface and a rig fit each other, too few to cost time; and of so
# many cameras one.
_TRIAL = PlanRequest(method="closest", samples=500)
_SOME = 8


def formulate_problem(
    scene: Scene,
    rig: Rig,
    request: PlanRequest,
    model: CostModel | None = None,
    by: Density = "importance",
    *,
    fresh: bool = False,
    keep_going: Callable[[float], bool] | None = None,
    enough: Callable[[], float] = lambda: math.inf,
) -> Problem:
    """Return the discrete problem of a request, to plan on or to estimate a plan's quality on.

    Parameters
    ----------
    scene, rig, request, model
        As for :func:`plan_focus`.
    by : {"importance", "area"}
        The density of the samples.
    fresh : bool
        Whether to take the request's fresh samples, which no solver sees, in place of those to
        plan on. That they fit is checked with the latter only.
    keep_going : callable, optional
        Called every few hundredths of a second of ray casting, with the share of it that is
        done; return False to stop. The problem is then on the samples so far: fewer, but still
        a random draw.
    enough : callable, optional
        Called after a stop: how many of the samples so far are enough. Parts beyond are left out.

    Raises
    ------
    InputError
        As :func:`plan_focus`.
    """
    request = choose_samples(scene, rig, request, model)
    if fresh:
        samples = scene.fresh_samples(request.fresh_samples, request.seed, by)
        order = None
    else:
        _check_counts(rig, request)
        check_distance(scene, rig)
        check_cameras_outside(scene, rig)
        samples = scene.sample(request.samples, request.seed, by)
        order = _fair_order(request, samples, keep_going)
    visibility = visible_pairs(scene, rig, samples, keep_going, order, enough)
    samples = _standing_for_all(samples, visibility.taken)
    if not fresh:
        _check_importance(samples, request)
        explain_unseen(scene, rig, samples, visibility)
    visibility = _fine_enough(visibility, samples, rig, request, check=not fresh)
    problem = build_problem(samples, visibility, rig, model, request.depth_tolerance)
    if not fresh:
        check_depths(scene, problem, request.depth_tolerance)
    return replace(with_shots(problem, request.shots), views=request.views)


def check_fit(scene: Scene, rig: Rig) -> None:
    """Raise if a surface and a rig do not fit each other, as far as a few samples tell.

    That most of the surface is seen, and some of it can be brought into focus, some of the cameras
    tell; all are tried only if those do not.

    Raises
    ------
    InputError
        As :func:`plan_focus`.
    """
    check_distance(scene, rig)
    check_cameras_outside(scene, rig)
    with suppress(InputError):
        problem = formulate_problem(scene, _some_cameras(rig), _TRIAL)
        weights, seen = problem.samples.weights, np.diff(problem.sample_offsets) > 0
        if weights[seen].sum() >= SEEN_MOSTLY * weights.sum():
            return
    formulate_problem(scene, rig, _TRIAL)


@remembered
def _some_cameras(rig: Rig) -> Rig:
    return Rig(rig.cameras[::_SOME], frame_id=rig.frame_id)


def _fine_enough(
    visibility: Visibility, samples: Samples, rig: Rig, request: PlanRequest, *, check: bool
) -> Visibility:
    """Return the pairs that are imaged as finely as the request asks; raise if none is."""
    most = request.max_mm_per_pixel
    if math.isinf(most):
        return visibility
    lengths = 1000 * pairs_metres_per_pixel(visibility, samples, rig)
    if check:
        check_resolution(lengths, most)
    return only_pairs(visibility, lengths <= most)


def _check_counts(rig: Rig, request: PlanRequest) -> None:
    """Raise if there are too many cameras and shots to plan."""
    if len(rig) * request.shots > MAX_CAMERAS:
        raise InputError(
            "shots", f"at most {MAX_CAMERAS // len(rig)} for {len(rig)} cameras", str(request.shots)
        )


def _check_importance(samples: Samples, request: PlanRequest) -> None:
    """Raise if no sample has any importance."""
    if not samples.weights.any():
        raise InputError(
            "samples", "enough for one to have some importance", str(request.samples), "take more"
        )


def subsample(problem: Problem, count: int, seed: int) -> Problem:
    """Return the problem on ``count`` of a problem's samples, drawn at random.

    Of several subjects, of each as large a part.
    """
    if problem.subject_offsets:
        share = count / problem.sample_count
        return concatenate(
            [
                subsample(part, max(1, int(share * part.sample_count)), seed)
                for part in separated(problem)
            ]
        )
    drawn = np.random.default_rng(seed).permutation(problem.sample_count)[:count]
    return _part_of(problem, np.sort(drawn))


def leading_part(problem: Problem, count: int) -> Problem:
    """Return the problem on the first ``count`` of a problem's samples.

    A plan that was stopped while rays were cast was estimated on the first of its fresh samples.
    """
    return _part_of(problem, np.arange(min(count, problem.sample_count)))


def _part_of(problem: Problem, taken: NDArray[np.int64]) -> Problem:
    counts = np.diff(problem.sample_offsets)[taken]
    offsets = np.concatenate([[0], np.cumsum(counts)])
    shifts = np.repeat(problem.sample_offsets[taken] - offsets[:-1], counts)
    pairs = np.arange(offsets[-1]) + shifts
    return replace(
        problem,
        samples=_standing_for_all(problem.samples, taken),
        sample_offsets=offsets,
        sample_index=np.repeat(np.arange(len(taken), dtype=np.int32), counts),
        camera_index=problem.camera_index[pairs],
        depth=problem.depth[pairs],
        base_cost=problem.base_cost[pairs],
        focus_near=problem.focus_near[pairs],
        focus_far=problem.focus_far[pairs],
    )


def choose_samples(
    scene: Scene,
    rig: Rig,
    request: PlanRequest,
    model: CostModel | None = None,
    on_progress: ProgressCallback = never_stop,
) -> PlanRequest:
    """Return the request with as many samples on a mesh as its standard error takes.

    The standard error falls with the square root of the number of samples, so a pilot plan by EM
    on a few of them tells how many are needed. A request that gives a number of samples, or takes
    a cloud's own points, is returned unchanged.

    Raises
    ------
    InputError
        If it takes too many, or as :func:`plan_focus`.
    """
    if request.samples or not isinstance(scene.surface, Mesh):
        return request
    pilot = formulate_problem(
        scene, rig, replace(request, method="em", samples=_PILOT_SAMPLES), model
    )
    with kernels.threads_for(len(pilot.depth)):
        solver = solver_of(pilot, replace(request, method="em"))
        solution = solver(pilot, Options(start=spread_start(pilot)), on_progress)
    quality = estimate_quality(pilot, fill_missing_distances(pilot, solution.focus_distances))
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
    request: PlanRequest, samples: Samples, keep_going: Callable[[float], bool] | None
) -> NDArray[np.int64] | None:
    """Return an order of which every prefix is a random draw; None to keep the samples' own.

    Drawn samples are in random order already. A cloud's own points come as they were scanned,
    place by place.
    """
    if keep_going is None or request.samples > 0:
        return None
    return np.random.default_rng(request.seed).permutation(len(samples))


def _standing_for_all(samples: Samples, taken: NDArray[np.int64]) -> Samples:
    """Return the samples taken, scaled so that they stand for the area and weight of all."""
    if len(taken) == len(samples):
        return samples
    part = samples.take(taken)
    return replace(
        part,
        areas=part.areas * (samples.areas.sum() / part.areas.sum()),
        weights=part.weights * (samples.weights.sum() / (part.weights.sum() or 1.0)),
    )
