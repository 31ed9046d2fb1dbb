# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.
"""Iterated local search: kicks of neighbouring cameras, each followed by a descent.

H. R. Lourenço, O. C. Martin and T. Stützle, *Iterated Local Search*, Handbook of Metaheuristics
(2003). A kick moves a camera and some of its neighbours anywhere; mostly where a fractional
solution has them, once there is one. A descent then mends what that spoiled, which takes a few
steps of a few tuples, and now and then finds what no pair could. What has not become better for
long starts again from a whole plan drawn from the fractional solution.
"""

from __future__ import annotations

import numpy as np

from focus_planner.core import kernels
from focus_planner.core.arrays import FloatArray, IntArray, Offsets
from focus_planner.core.solvers.k_view import Descent

# A camera and so many of its neighbours are kicked, if there are as many.
_FEWEST, _MOST = 2, 8
# Plans that cost a little more are accepted now and then: e times less often for each such part of
# the cost.
_WARMTH = 3e-5
# So many kicked cameras move where a fractional solution has them, and the others anywhere.
_GUIDED = 0.7
# After so many kicks without a better plan the search starts again from a plan drawn like that.
_PATIENCE = 160


class Kicks:
    """A search that goes on from one plan to the next.

    Parameters
    ----------
    descent : Descent
        With scope "all".
    offsets : (C + 1,) array of int64
        Camera c's cells are number ``offsets[c]`` to ``offsets[c + 1]`` of all.

    Attributes
    ----------
    cell : (C,) array of int32
        The best plan so far.
    units : int
        Its cost; at first more than any.
    """

    def __init__(self, descent: Descent, offsets: Offsets) -> None:
        self._descent = descent
        self._offsets = offsets
        self._up_to: FloatArray | None = None
        self._near = descent.neighbours
        near = np.array([len(cameras) for cameras in self._near])
        self._able = np.flatnonzero((np.diff(offsets) > 0) & (near > 0))
        self._random = np.random.default_rng(0)
        self.units = int(kernels.NEVER)

    def start(self, cell: IntArray) -> None:
        """Descend from a plan, and go on from there."""
        self._descent.run(cell.copy(), lambda _: True)
        self._standing = self._descent.standing()
        self._least, self._since = self._descent.units, 0
        self._keep()

    def guide(self, share: FloatArray) -> None:
        """Kick cameras mostly where a fractional solution has them.

        Parameters
        ----------
        share : (M,) array
            How much of its camera stands at each cell, 0 to 1.
        """
        self._up_to = np.concatenate([[0.0], np.cumsum(share)])

    def kick(self) -> bool:
        """Kick once; return whether the best plan became better."""
        if not len(self._able):
            return False
        if self._up_to is not None and self._since >= _PATIENCE:
            before = self.units
            self.start(self._drawn_plan())
            return self.units < before
        descent, now = self._descent, self._standing[1]
        descent.stand(*self._standing)
        descent.run_from(*self._draw())
        self._since += 1
        rise = (descent.units - now) / (_WARMTH * now)
        if rise > 0 and self._random.random() >= np.exp(-rise):
            return False
        self._standing = descent.standing()
        if descent.units < self._least:
            self._least, self._since = descent.units, 0
        return self._keep()

    def _keep(self) -> bool:
        """Keep where the descent stands if it is the best plan so far; return whether it is."""
        descent = self._descent
        if descent.units >= self.units:
            return False
        self.cell, self.units = descent.cell.copy(), descent.units
        return True

    def _drawn_plan(self) -> IntArray:
        """Draw a cell for every camera that has any."""
        cell = self.cell.copy()
        cameras = np.flatnonzero(np.diff(self._offsets) > 0).astype(np.int32)
        cell[cameras] = self._draw_cells(cameras)
        return cell

    def _draw(self) -> tuple[IntArray, IntArray]:
        """Draw a camera with some of its neighbours, and a cell for each."""
        first = self._random.choice(self._able)
        near = self._near[first]
        count = min(int(self._random.integers(_FEWEST, _MOST + 1)), len(near))
        drawn = np.append(self._random.choice(near, count, replace=False), first)
        cameras = drawn.astype(np.int32)
        return cameras, self._draw_cells(cameras).astype(np.int32)

    def _draw_cells(self, cameras: IntArray) -> Offsets:
        """Draw a cell for each of some cameras."""
        begin, end = self._offsets[cameras], self._offsets[cameras + 1]
        cells = self._random.integers(end - begin)
        if self._up_to is None:
            return cells
        low, high = self._up_to[begin], self._up_to[end]
        at = low + self._random.random(len(cameras)) * (high - low)
        likely = np.clip(np.searchsorted(self._up_to, at, side="right") - 1, begin, end - 1) - begin
        return np.where(self._random.random(len(cameras)) < _GUIDED, likely, cells)
