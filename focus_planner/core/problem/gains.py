# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A problem in terms of the gain of focus: the form that bounds and exact solvers work on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from focus_planner.core import kernels
from focus_planner.core.arrays import IntArray, Offsets
from focus_planner.core.brief import brief_repr
from focus_planner.core.problem.problem import Problem


@dataclass(frozen=True, eq=False)
class Gains:
    """How much each camera reduces a sample's cost by holding it in focus, in whole units.

    Gains are relative to the sample's cost with every camera out of focus. A plan costs ``out``
    less the sum, over the samples, of the largest gain among the cameras that hold it in focus.
    Pairs without a gain, where another camera is better even out of focus, are left out.

    Attributes
    ----------
    offsets : (C + 1,) array of int64
        Camera c's G pairs are ``offsets[c]`` to ``offsets[c + 1]``, samples ascending.
    sample : (G,) array of int32
    gain : (G,) array of int64
        Above 0.
    first, last : (G,) arrays of int32
        The first and last cell that holds the sample in focus, counted from the camera's first.
    cell_offsets : (C + 1,) array of int64
        Camera c's cells are ``cell_offsets[c]`` to ``cell_offsets[c + 1]``.
    most : (N,) array of int64
        Each sample's largest gain; 0 if it has none.
    out : int
        The cost with every camera out of focus.
    """

    offsets: Offsets
    sample: IntArray
    gain: Offsets
    first: IntArray
    last: IntArray
    cell_offsets: Offsets
    most: Offsets
    out: int

    __repr__ = brief_repr

    @property
    def by_camera(self) -> kernels.GainsByCamera:
        """The pairs, as kernels take them."""
        return kernels.GainsByCamera(self.offsets, self.sample, self.gain, self.first, self.last)

    @property
    def camera_count(self) -> int:
        """The number of cameras, C."""
        return len(self.offsets) - 1


def gains_of(problem: Problem) -> Gains:
    """Return the problem's gains, in O(pairs)."""
    cells = problem.cells
    out, most = np.empty((2, problem.sample_count), dtype=np.int64)
    kernels.most_gains(problem.pairs_by_sample, cells.focus, cells.unseen, out, most)
    counts = np.empty(problem.camera_count, dtype=np.int64)
    kernels.count_gains(problem.pairs_by_camera, out, counts)
    offsets = np.concatenate([[0], np.cumsum(counts)])
    sample, first, last = np.empty((3, offsets[-1]), dtype=np.int32)
    gain = np.empty(offsets[-1], dtype=np.int64)
    gains = Gains(offsets, sample, gain, first, last, cells.offsets, most, int(out.sum()))
    kernels.list_gains(problem.pairs_by_camera, out, gains.by_camera)
    return gains
