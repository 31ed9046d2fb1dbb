# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.


"""Large problems with neighbouring samples next to one another, as solvers run through them best.

Samples are drawn in random order, so that each prefix is a fair draw, and a camera's lie all over
memory. Sorted by place, what a camera or a pair of them sees lies together. Costs are in whole
units, whose sums do not depend on the order, so the solvers choose the same cells.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from focus_planner.core import kernels
from focus_planner.core.arrays import FloatArray
from focus_planner.core.brief import brief_repr
from focus_planner.core.problem.cells import Cells
from focus_planner.core.problem.problem import Problem
from focus_planner.core.surface.visibility import spatial_order


@dataclass(frozen=True, eq=False)
class SortedProblem:
    """A problem whose samples are sorted by place, those of each subject among themselves.

    Attributes
    ----------
    problem : Problem
        With the cells of the problem that was sorted.
    order : (N,) array of int64 or None
        Sample p of it is sample ``order[p]`` of the problem that was sorted; None if it is the
        same.
    """

    problem: Problem
    order: NDArray[np.int64] | None

    __repr__ = brief_repr

    def sorted(self, values: FloatArray) -> FloatArray:
        """Return (N,) values of the original's samples in the order of this one's."""
        return values if self.order is None else values[self.order]

    def restored(self, values: FloatArray) -> FloatArray:
        """Return (N,) values of this problem's samples in the order of the original's."""
        if self.order is None:
            return values
        original = np.empty_like(values)
        original[self.order] = values
        return original


def sort_by_place(problem: Problem) -> SortedProblem:
    """Return a problem with its samples sorted by place, along a Morton curve; O(pairs)."""
    order = np.concatenate(
        [part.start + spatial_order(problem.samples.take(part)) for part in problem.subjects]
    )
    offsets = np.concatenate([[0], np.cumsum(np.diff(problem.sample_offsets)[order])])
    came_from, pairs = problem.sample_offsets, _pairs(problem)
    moved = kernels.Pairs(*map(np.empty_like, pairs))
    kernels.move_pairs(order, came_from, offsets, pairs, moved)
    placed = replace(
        problem,
        samples=problem.samples.take(order),
        sample_offsets=offsets,
        sample_index=moved.sample,
        camera_index=moved.camera,
        depth=moved.depth,
        base_cost=moved.base_cost,
        focus_near=moved.near,
        focus_far=moved.far,
    )
    which, seen = np.empty_like(moved.sample), _room_by_camera(problem)
    kernels.list_by_camera(moved, which, seen)
    cells = _moved_cells(problem.cells, order, moved, seen)
    placed.__dict__.update(
        camera_offsets=problem.camera_offsets, camera_pairs=which, pairs_by_camera=seen, cells=cells
    )
    return SortedProblem(placed, order)


def _pairs(problem: Problem) -> kernels.Pairs:
    cells = problem.cells
    return kernels.Pairs(
        problem.sample_index,
        problem.camera_index,
        problem.depth,
        problem.base_cost,
        problem.focus_near,
        problem.focus_far,
        cells.base,
        cells.first,
        cells.last,
    )


def _room_by_camera(problem: Problem) -> kernels.PairsByCamera:
    offsets, *others = problem.pairs_by_camera
    return kernels.PairsByCamera(offsets, *map(np.empty_like, others))


def _moved_cells(
    cells: Cells, order: NDArray[np.int64], moved: kernels.Pairs, seen: kernels.PairsByCamera
) -> Cells:
    """Return the cells with their pairs moved: sample by sample, and camera by camera."""
    return replace(
        cells,
        base=moved.base,
        first=moved.first,
        last=moved.last,
        seen=seen.sample,
        seen_base=seen.base,
        seen_first=seen.first,
        seen_last=seen.last,
        focus=cells.focus[order],
        unseen=cells.unseen[order],
    )
