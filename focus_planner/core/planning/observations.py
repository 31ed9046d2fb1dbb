# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What a plan's user should know of its inputs although they can be planned with."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from focus_planner.core.notes import Note
from focus_planner.core.planning.request import PlanRequest
from focus_planner.core.planning.subjects import Subject
from focus_planner.core.planning.suspicions import blind_cameras, seen_from_behind, suspect_frames
from focus_planner.core.problem.problem import Problem
from focus_planner.core.rig.rig import Rig
from focus_planner.core.surface.resolution import pairs_metres_per_pixel
from focus_planner.core.surface.scene import Scene
from focus_planner.core.surface.surface import Mesh
from focus_planner.core.surface.visibility import visible_pairs
from focus_planner.core.validation import first_few

# More cameras than this that see nothing, or less of the surface than that seen, is remarkable.
_BLIND = 0.25
_SEEN_MOSTLY = 0.5
# So much of the surface may be seen from behind only: the rim of a hole, the inside of a sleeve.
_FROM_BEHIND = 0.05
# Samples on which it is found what is seen too coarsely, and the share that is remarkable.
_TRIAL_SAMPLES = 1000
_COARSE = 0.005


def observe(
    subjects: Sequence[Subject],
    rig: Rig,
    request: PlanRequest,
    problems: Sequence[Problem],
    fresh: Sequence[Problem],
) -> tuple[Note, ...]:
    """Return notes on what was read, and on how the surfaces and the rig fit each other.

    Of several subjects they name the one that they are about.

    Parameters
    ----------
    subjects, rig, request
    problems, fresh : sequences of Problem
        Each subject's, on the samples to plan on, and on fresh ones.
    """
    of_each = [
        _of_subject(subject.scene, rig, request, *on)
        for subject, *on in zip(subjects, problems, fresh, strict=True)
    ]
    if len(subjects) == 1:
        read, fit = of_each[0]
        return (*read, *rig.notes, *fit)
    named = [
        subject.noted([*read, *fit]) for subject, (read, fit) in zip(subjects, of_each, strict=True)
    ]
    return (*rig.notes, *(note for notes in named for note in notes))


def _of_subject(
    scene: Scene, rig: Rig, request: PlanRequest, problem: Problem, fresh: Problem
) -> tuple[list[Note], list[Note]]:
    """Return notes on what was read of a surface, and on how it fits the rig and the request."""
    fit = [
        *_importance(scene),
        *_fit(scene, rig, problem, fresh),
        *_resolution(scene, rig, request, problem, fresh),
    ]
    return list(scene.notes), fit


def fewer_samples(request: PlanRequest, problem: Problem, fresh: Problem, *, stopped: bool) -> Note:
    """Return the note on a plan that is for fewer samples than were asked for.

    Parameters
    ----------
    request : PlanRequest
    problem, fresh : Problem
        On the samples that were planned on, and on the fresh ones.
    stopped : bool
        Whether the caller stopped the plan, rather than its time budget.
    """
    count = len(problem.subjects)
    times = f"{count} times " if count > 1 else ""
    asked = f"{times}{request.samples}" if request.samples else "all of the cloud's"
    counts = (
        f"{problem.sample_count} samples, of {asked}, and {fresh.sample_count} fresh ones, of"
        f" {times}{request.fresh_samples}"
    )
    if stopped:
        seen, remedy = f"the request was stopped when there were {counts}", "let it end"
    else:
        seen = f"the time budget of {request.time_budget:g} s left room for {counts}"
        remedy = "allow more time, or ask for fewer samples"
    return Note(
        "budget", f"{seen}: the plan fits the surface less well than one on all of them; {remedy}"
    )


def cost_of_tolerance(tolerance: float, area: float, within: float, nominal: float) -> Note:
    """Return the note on what a plan gives for its depth tolerance.

    Parameters
    ----------
    tolerance : float
        Metres, above 0.
    area : float
        Of the surface; this and the following in square metres.
    within, nominal : float
        What the plan holds in focus with depths off by the tolerance, and with depths as planned.
    """
    return Note(
        "tolerance",
        f"{1000 * tolerance:g} mm are allowed for errors of depth: {within / area:.1%} of the"
        f" surface stays in focus with them, {nominal / area:.1%} is in focus if depths are as"
        " planned; allowing for more than about half of their standard error costs more coverage"
        " than it saves: compare with a plan without",
    )


def _fit(scene: Scene, rig: Rig, problem: Problem, fresh: Problem) -> Iterator[Note]:
    blind = ~(_sees(problem) | _sees(fresh))
    unseen = np.diff(problem.sample_offsets) == 0
    weights = problem.samples.weights
    share_unseen = float(weights[unseen].sum() / weights.sum())
    suspicion = None
    if blind.mean() > _BLIND or share_unseen > 1 - _SEEN_MOSTLY:
        suspicion = suspect_frames(scene, rig)
    if suspicion:
        yield Note(suspicion.code, str(suspicion))
    if blind.mean() > _BLIND:
        blind &= blind_cameras(scene, rig)  # others see surface of no importance
    if blind.mean() > _BLIND:
        yield _unseen_cameras(rig, blind, explained=suspicion is not None)
    if share_unseen > _FROM_BEHIND and scene.oriented:
        behind = seen_from_behind(scene, rig)
        if behind > _FROM_BEHIND:
            yield _winding(scene, behind)


def _resolution(
    scene: Scene, rig: Rig, request: PlanRequest, problem: Problem, fresh: Problem
) -> Iterator[Note]:
    """Yield a note on what is seen, but more coarsely than the request lets count."""
    most = request.max_mm_per_pixel
    if math.isinf(most):
        return
    samples = scene.sample(_TRIAL_SAMPLES, 0)
    visibility = visible_pairs(scene, rig, samples)
    fine = 1000 * pairs_metres_per_pixel(visibility, samples, rig) <= most
    seen, seen_well = np.zeros((2, len(samples)), dtype=np.bool_)
    seen[visibility.sample_index] = True
    seen_well[visibility.sample_index[fine]] = True
    share = float(samples.weights[seen & ~seen_well].sum() / samples.weights.sum())
    coarse = (np.diff(visibility.camera_offsets) > 0) & ~(_sees(problem) | _sees(fresh))
    found = []
    if share > _COARSE:
        found.append(
            f"{share:.0%} of the surface is imaged only more coarsely and counts as unseen"
        )
    if coarse.any():
        names = first_few(rig.cameras[c].name for c in np.flatnonzero(coarse))
        found.append(f"{coarse.sum()} of {len(rig)} cameras image nothing that finely ({names})")
    if found:
        yield Note(
            "resolution",
            f"of max_mm_per_pixel {most:g}: {'; '.join(found)}; to have them count, allow more"
            " millimetres per pixel, bring cameras closer, or give them longer lenses",
        )


def _sees(problem: Problem) -> NDArray[np.bool_]:
    """Return (C,) whether each camera sees a sample; with several shots, all see the same."""
    sees: NDArray[np.bool_] = (np.diff(problem.camera_offsets) > 0)[:: problem.shots]
    return sees


def _unseen_cameras(rig: Rig, blind: NDArray[np.bool_], *, explained: bool) -> Note:
    remedy = "" if explained else ", or leave these cameras out"
    names = first_few(rig.cameras[c].name for c in np.flatnonzero(blind))
    return Note(
        "unseen_cameras",
        f"{blind.sum()} of {len(rig)} cameras see nothing ({names}): they look past the surface, or"
        f" something of it hides the rest; check its frame and size and the camera poses{remedy}",
    )


def _winding(scene: Scene, share: float) -> Note:
    """Return the note that this share of the surface is seen from behind only."""
    if isinstance(scene.surface, Mesh):
        meaning = (
            "triangles are probably wound both ways, or are there twice, once from either side;"
            " make their winding consistent (counter-clockwise seen from outside) and drop doubles"
        )
    else:
        meaning = (
            "some normals probably point inward; turn them outward, or leave the normals out to"
            " have them estimated"
        )
    return Note(
        "winding",
        f"{share:.0%} of the surface is seen from behind only, and counts as unseen: {meaning} (of"
        " a sheet without thickness, one side counts)",
    )


def _importance(scene: Scene) -> Iterator[Note]:
    """Yield a note if the surface has an importance of its own."""
    surface = scene.surface
    given = surface.vertex_importance if isinstance(surface, Mesh) else surface.importance
    if given is None:
        return
    none = float((given == 0).mean())
    what = "vertices" if isinstance(surface, Mesh) else "points"
    yield Note(
        "importance",
        f"the surface has an importance, from {given.min():.3g} to {given.max():.3g}, 0 at"
        f" {none:.0%} of its {what}: more important parts count for more, and those of importance 0"
        " not at all; leave it out to plan by area",
    )
