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
    counts = np.diff(problem.sample_offsets)[order]
    offsets = np.concatenate([[0], np.cumsum(counts)])
    pairs = np.arange(offsets[-1]) + np.repeat(problem.sample_offsets[order] - offsets[:-1], counts)
    moved = replace(
        problem,
        samples=problem.samples.take(order),
        sample_offsets=offsets,
        sample_index=np.repeat(np.arange(len(order), dtype=np.int32), counts),
        camera_index=problem.camera_index[pairs],
        depth=problem.depth[pairs],
        base_cost=problem.base_cost[pairs],
        focus_near=problem.focus_near[pairs],
        focus_far=problem.focus_far[pairs],
    )
    moved.__dict__["cells"] = _moved_cells(problem.cells, moved, order, pairs)
    return SortedProblem(moved, order)


def _moved_cells(
    cells: Cells, moved: Problem, order: NDArray[np.int64], pairs: NDArray[np.int64]
) -> Cells:
    """Return the cells, given where each sample and each pair comes from."""
    base, first, last = cells.base[pairs], cells.first[pairs], cells.last[pairs]
    by_camera = moved.camera_pairs
    return replace(
        cells,
        base=base,
        first=first,
        last=last,
        seen=moved.sample_index[by_camera],
        seen_base=base[by_camera],
        seen_first=first[by_camera],
        seen_last=last[by_camera],
        focus=cells.focus[order],
        unseen=cells.unseen[order],
    )
