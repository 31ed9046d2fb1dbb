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
(2003). A kick moves a camera and some of its neighbours anywhere. A descent then mends what that
spoiled, which takes a few steps of a few tuples, and now and then finds what no pair could.
"""

from __future__ import annotations

import numpy as np

from focus_planner.core import kernels
from focus_planner.core.arrays import IntArray
from focus_planner.core.solvers.k_view import Descent

# A camera and so many of its neighbours are kicked, if there are as many.
_FEWEST, _MOST = 2, 8
# Plans that cost a little more are accepted now and then: e times less often for each such part of
# the cost.
_WARMTH = 1e-5


class Kicks:
    """A search that goes on from one plan to the next.

    Parameters
    ----------
    descent : Descent
        With scope "all".
    cells : (C,) array of int64
        How many cells each camera has.

    Attributes
    ----------
    cell : (C,) array of int32
        The best plan so far.
    units : int
        Its cost; at first more than any.
    """

    def __init__(self, descent: Descent, cells: IntArray) -> None:
        self._descent = descent
        self._cells = cells
        self._near = descent.neighbours
        self._able = np.flatnonzero([cells[c] > 0 and len(n) for c, n in enumerate(self._near)])
        self._random = np.random.default_rng(0)
        self.units = int(kernels.NEVER)

    def start(self, cell: IntArray) -> None:
        """Descend from a plan, and go on from there."""
        self._descent.run(cell.copy(), lambda _: True)
        self._standing = self._descent.standing()
        self.cell, self.units = self._descent.cell.copy(), self._descent.units

    def kick(self) -> bool:
        """Kick once; return whether the best plan became better."""
        if not len(self._able):
            return False
        descent, now = self._descent, self._standing[1]
        descent.stand(*self._standing)
        descent.run_from(*self._draw())
        rise = (descent.units - now) / (_WARMTH * now)
        if rise > 0 and self._random.random() >= np.exp(-rise):
            return False
        self._standing = descent.standing()
        if descent.units >= self.units:
            return False
        self.cell, self.units = descent.cell.copy(), descent.units
        return True

    def _draw(self) -> tuple[IntArray, IntArray]:
        """Draw a camera with some of its neighbours, and a cell for each."""
        first = self._random.choice(self._able)
        near = self._near[first]
        count = min(int(self._random.integers(_FEWEST, _MOST + 1)), len(near))
        cameras = np.append(self._random.choice(near, count, replace=False), first)
        return cameras.astype(np.int32), self._random.integers(self._cells[cameras]).astype(
            np.int32
        )
