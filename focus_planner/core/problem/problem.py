# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The discrete problem: samples, the cameras that see them, and the cost of each pair.

Solvers see nothing but this.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise, starmap

import numpy as np
from numpy.typing import NDArray

from focus_planner.core import kernels
from focus_planner.core.arrays import FloatArray, IntArray, Offsets
from focus_planner.core.brief import brief_repr
from focus_planner.core.problem.cells import UNITS, Cells, group_by_lens, lens_kinds, to_units
from focus_planner.core.problem.cost_model import CostModel
from focus_planner.core.rig.geometry import camera_positions, camera_rotations
from focus_planner.core.rig.lens import Lens
from focus_planner.core.rig.optics import settable_interval
from focus_planner.core.rig.remembered import remembered
from focus_planner.core.rig.rig import Rig
from focus_planner.core.surface.surface import Samples
from focus_planner.core.surface.visibility import Visibility

# Calls of ``keep_going`` while cells are found.
_QUESTIONS = 3


@dataclass(frozen=True, eq=False)
class Problem:
    """A sampled surface in front of a rig.

    The P pairs of a sample and a camera that sees it are ordered by sample, then by camera.

    Attributes
    ----------
    samples : Samples
        N samples, normals outward.
    names : tuple of str
        The C cameras. With several shots, each of the rig's cameras is repeated that often.
    lenses : tuple of Lens
        One per camera.
    sample_offsets : (N + 1,) array of int64
        Sample p's pairs are ``sample_offsets[p]`` to ``sample_offsets[p + 1]``.
    sample_index, camera_index : (P,) arrays of int32
    depth : (P,) array
        Along the camera's optical axis, metres.
    base_cost : (P,) array
        The pair's cost in focus: the first two terms of Eq. 1.
    focus_near, focus_far : (P,) arrays
        The interval of the camera's focus distances that hold the sample in focus, metres;
        (inf, -inf) if none does.
    focus_weight : float
        w₃, the pair's extra cost out of focus.
    shots : int
        Shots per camera of the rig (:mod:`focus_planner.core.problem.shots`).
    views : int
        How many views each sample needs: its cost is the mean of as many least costs, each in
        another camera of the rig, and 1 for each that is missing.
    subject_offsets : tuple of int
        Of several subjects (:mod:`focus_planner.core.problem.joined`): subject s's samples are
        ``subject_offsets[s]`` to ``subject_offsets[s + 1]``; empty for one.
    """

    samples: Samples
    names: tuple[str, ...]
    lenses: tuple[Lens, ...]
    sample_offsets: Offsets
    sample_index: IntArray
    camera_index: IntArray
    depth: FloatArray
    base_cost: FloatArray
    focus_near: FloatArray
    focus_far: FloatArray
    focus_weight: float
    shots: int = 1
    views: int = 1
    subject_offsets: tuple[int, ...] = ()

    __repr__ = brief_repr

    @property
    def sample_count(self) -> int:
        """The number of samples, N."""
        return len(self.samples)

    @property
    def camera_count(self) -> int:
        """The number of cameras, C."""
        return len(self.names)

    @property
    def subjects(self) -> tuple[slice, ...]:
        """The samples of each subject."""
        offsets = self.subject_offsets or (0, self.sample_count)
        return tuple(starmap(slice, pairwise(offsets)))

    @cached_property
    def view(self) -> IntArray:
        """(C,) the camera of the rig whose shot each camera is: shots of one are one view."""
        return np.arange(self.camera_count, dtype=np.int32) // np.int32(self.shots)

    @cached_property
    def camera_offsets(self) -> Offsets:
        """(C + 1,) camera c's pairs are ``camera_pairs[camera_offsets[c]:camera_offsets[c+1]]``."""
        counts = np.bincount(self.camera_index, minlength=self.camera_count)
        return np.concatenate([[0], np.cumsum(counts)])

    @cached_property
    def camera_pairs(self) -> IntArray:
        """(P,) indices of pairs, ordered by camera, then by sample."""
        pairs: IntArray = kernels.sort_by_camera(self.camera_index, self.camera_offsets)
        return pairs

    @cached_property
    def cells(self) -> Cells:
        """The focus distances worth choosing between; found on first use."""
        cells = _find_cells(self, lambda: True)
        assert cells is not None
        return cells

    @cached_property
    def pairs_by_sample(self) -> kernels.PairsBySample:
        """The pairs sample by sample, with the cells that hold them in focus."""
        cells = self.cells
        return kernels.PairsBySample(
            self.sample_offsets, self.camera_index, cells.base, cells.first, cells.last
        )

    @cached_property
    def pairs_by_camera(self) -> kernels.PairsByCamera:
        """The same camera by camera."""
        cells = self.cells
        return kernels.PairsByCamera(
            self.camera_offsets, cells.seen, cells.seen_base, cells.seen_first, cells.seen_last
        )

    @cached_property
    def camera_views(self) -> kernels.CameraViews:
        """Which cameras are one view, and what a view costs that is missing."""
        missing = self.cells.unseen
        if self.views == 1:
            missing = np.full_like(missing, kernels.NEVER)
        number = self.view
        offsets = np.concatenate([[0], np.cumsum(np.bincount(number))])
        return kernels.CameraViews(number, offsets, self.views, missing)

    def find_cells(self, keep_going: Callable[[], bool]) -> bool:
        """Find the cells ahead of their first use; return False if stopped.

        Parameters
        ----------
        keep_going : callable
            Called a few times meanwhile, as often if they are known; return False to stop.
        """
        if "cells" in self.__dict__:
            return all(keep_going() for _ in range(_QUESTIONS))
        cells = _find_cells(self, keep_going)
        if cells is not None:
            self.__dict__["cells"] = cells
        return cells is not None

    def evaluate(self, focus: FloatArray) -> tuple[FloatArray, IntArray]:
        """Return each sample's cost and its best camera at the given focus distances (Eq. 2, 5).

        Parameters
        ----------
        focus : (C,) array
            Metres.

        Returns
        -------
        costs : (N,) array
            From 0 to 1, unweighted; with several views, the mean of the least costs.
        best : (N,) array of int32
            The camera that images the sample best; -1 where none sees it.
        """
        costs, best = self.assign(focus)
        return costs, best[:, 0].copy()

    def assign(self, focus: FloatArray) -> tuple[FloatArray, IntArray]:
        """Return each sample's cost and the cameras that it costs that in (Eq. 2, 5).

        Parameters
        ----------
        focus : (C,) array
            Metres.

        Returns
        -------
        costs : (N,) array
            As :meth:`evaluate` returns them.
        best : (N, views) array of int32
            Cameras, each of another view, the cheapest first; -1 for views that are missing.
        """
        costs = np.empty(self.sample_count)
        best = np.empty((self.sample_count, self.views), dtype=np.int32)
        chosen = np.ascontiguousarray(focus, dtype=np.float64)
        kernels.best_cameras(self._pair_costs, chosen, self.view, costs, best)
        return costs, best

    @property
    def _pair_costs(self) -> kernels.PairCosts:
        return kernels.PairCosts(
            self.sample_offsets,
            self.camera_index,
            self.base_cost,
            self.focus_near,
            self.focus_far,
            self.focus_weight,
        )

    def in_focus(self, focus: FloatArray, best: IntArray) -> NDArray[np.bool_]:
        """Return, as an (N,) array, whether each sample is in focus in its best camera.

        Parameters
        ----------
        focus : (C,) array
            Metres.
        best : (N,) array of int32
            As :meth:`evaluate` returns it.
        """
        held = np.empty(self.sample_count, dtype=np.bool_)
        chosen = np.ascontiguousarray(focus, dtype=np.float64)
        of_each = np.ascontiguousarray(best, dtype=np.int32)
        kernels.held_in_best(self._pair_costs, chosen, of_each, held)
        return held

    def cost(self, focus: FloatArray) -> float:
        """Return the cost at the given focus distances (Eq. 3): 1000 × the weighted mean."""
        return mean_cost(self.samples.weights, self.evaluate(focus)[0])


def mean_cost(weights: FloatArray, costs: FloatArray) -> float:
    """Return 1000 × the weighted mean of the samples' costs."""
    return 1000.0 * float((weights * costs).sum() / weights.sum())


def build_problem(
    samples: Samples,
    visibility: Visibility,
    rig: Rig,
    model: CostModel | None = None,
    depth_tolerance: float = 0.0,
) -> Problem:
    """Return the discrete problem for samples and the cameras that see them.

    A pair's base cost is w₁·min(ε₁d²/cos θ, 1) + w₂·min(r/ε₂, 1) (Eq. 1), where d is the depth, θ
    the angle between the optical axis and the inward normal, and r the distance from the axis. If
    cos θ ≤ 0, which is possible off the axis, the first term takes its maximum.

    Parameters
    ----------
    samples : Samples
        Those that visibility was tested for.
    visibility : Visibility
    rig : Rig
    model : CostModel, optional
        The paper's by default.
    depth_tolerance : float
        Metres; a pair counts as in focus only if every depth within this distance of its own is.

    Returns
    -------
    Problem
        With one shot per camera.
    """
    sample_offsets = np.zeros(len(samples) + 1, dtype=np.int64)
    with kernels.threads_for(len(visibility.sample_index)):
        sample_index, camera_index = kernels.sort_by_sample(
            visibility.camera_offsets, visibility.sample_index, sample_offsets
        )
        depth, base_cost = np.empty(len(sample_index)), np.empty(len(sample_index))
        kernels.base_costs(
            (samples.points, visibility.normals),
            (camera_positions(rig), camera_rotations(rig)),
            sample_index,
            camera_index,
            _cost_terms(model or CostModel()),
            depth,
            base_cost,
        )
        near, far = _intervals(depth, lenses_of(rig), camera_index, depth_tolerance)
    return Problem(
        samples=Samples(samples.points, visibility.normals, samples.areas, samples.weights),
        names=tuple(camera.name for camera in rig.cameras),
        lenses=lenses_of(rig),
        sample_offsets=sample_offsets,
        sample_index=sample_index,
        camera_index=camera_index,
        depth=depth,
        base_cost=base_cost,
        focus_near=near,
        focus_far=far,
        focus_weight=(model or CostModel()).focus_weight,
    )


def _cost_terms(model: CostModel) -> kernels.CostTerms:
    return kernels.CostTerms(
        model.projected_area_weight,
        model.axis_deviation_weight,
        model.projected_area_scale,
        model.axis_deviation_limit,
    )


@remembered
def lenses_of(rig: Rig) -> tuple[Lens, ...]:
    """Return each camera's lens."""
    return tuple(camera.lens for camera in rig.cameras)


def with_depth_tolerance(problem: Problem, depth_tolerance: float) -> Problem:
    """Return the same problem with another depth tolerance, in metres."""
    near, far = _intervals(problem.depth, problem.lenses, problem.camera_index, depth_tolerance)
    return replace(problem, focus_near=near, focus_far=far)


def _intervals(
    depth: FloatArray, lenses: tuple[Lens, ...], camera_index: IntArray, depth_tolerance: float
) -> tuple[FloatArray, FloatArray]:
    """Return the focus distances that hold each pair in focus: from where, to where."""
    kinds, kind = lens_kinds(lenses)
    optics = np.array(
        [(each.hyperfocal_distance, each.focal_length, *each.focus_limits) for each in kinds]
    )
    near, far = np.empty(len(depth)), np.empty(len(depth))
    kernels.focus_intervals(depth, camera_index, kind, optics, float(depth_tolerance), near, far)
    if any(each.settable_distances is not None for each in kinds):
        for lens, part in group_by_lens(lenses, camera_index):
            near[part], far[part] = settable_interval(near[part], far[part], lens)
    return near, far


def _find_cells(problem: Problem, keep_going: Callable[[], bool]) -> Cells | None:
    """Return the cells; None if stopped."""
    offsets, pairs, count = problem.camera_offsets, problem.camera_pairs, len(problem.depth)
    base, focus, unseen = _costs_in_units(problem)
    starts, ends = np.empty((2, count))
    seen, seen_base = np.empty(count, dtype=np.int32), np.empty(count, dtype=np.int64)
    kernels.take(
        pairs,
        problem.focus_near,
        problem.focus_far,
        base,
        problem.sample_index,
        starts,
        ends,
        seen_base,
        seen,
    )
    sorted_starts, sorted_ends = starts.copy(), ends.copy()
    for low, high in pairwise(offsets.tolist()):
        sorted_starts[low:high].sort()
        sorted_ends[low:high].sort()
    if not keep_going():
        return None
    counts = np.empty(problem.camera_count, dtype=np.int64)
    near, far = np.empty_like(starts), np.empty_like(ends)
    kernels.maximal_cells(offsets, sorted_starts, sorted_ends, counts, near, far)
    cell_offsets = np.concatenate([[0], np.cumsum(counts)])
    kept = np.arange(cell_offsets[-1]) + np.repeat(offsets[:-1] - cell_offsets[:-1], counts)
    near, far = near[kept], far[kept]
    if not keep_going():
        return None
    seen_first, seen_last, first, last = np.empty((4, count), dtype=np.int32)
    kernels.cell_ranges(offsets, starts, ends, cell_offsets, near, far, seen_first, seen_last)
    kernels.put(pairs, seen_first, seen_last, first, last)
    if not keep_going():
        return None
    return Cells(
        lenses=problem.lenses,
        offsets=cell_offsets,
        near=near,
        far=far,
        base=base,
        first=first,
        last=last,
        seen=seen,
        seen_base=seen_base,
        seen_first=seen_first,
        seen_last=seen_last,
        focus=focus,
        unseen=unseen,
    )


def weigh_cells(problem: Problem, cells: Cells) -> Cells:
    """Return a problem's cells, given those of one that differs in nothing but its weights."""
    base, focus, unseen = _costs_in_units(problem)
    seen_base = base[problem.camera_pairs]
    return replace(cells, base=base, seen_base=seen_base, focus=focus, unseen=unseen)


def _costs_in_units(problem: Problem) -> tuple[Offsets, Offsets, Offsets]:
    """Return the weighted costs of pairs in focus, of samples out of focus, and of unseen ones."""
    weights = problem.samples.weights / problem.samples.weights.sum() * UNITS / problem.views
    base = np.empty(len(problem.base_cost), dtype=np.int64)
    kernels.costs_in_units(problem.sample_offsets, weights, problem.base_cost, base)
    return base, to_units(weights * problem.focus_weight), to_units(weights)
