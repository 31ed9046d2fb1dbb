# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The options of all solvers."""

from __future__ import annotations

from dataclasses import dataclass

from focus_planner.core.arrays import FloatArray
from focus_planner.core.brief import brief_repr
from focus_planner.core.rig.rig import Grid


@dataclass(frozen=True)
class Options:
    """Options of the solvers; each uses those that apply to it.

    Attributes
    ----------
    k : int
        How many cameras ``k_view`` moves together: 2 or 3, or all if there are fewer.
    scope : {"all", "assigned"}
        Which samples a step may re-assign: all that its cameras see, or those assigned to them.
    grid : Grid, optional
        Take the tuples from the cameras' neighbourhood on this grid; by default, from the overlap
        of what they see.
    rings : int
        How many edges of the grid there are at most between neighbours.
    start : (C,) array, optional
        Focus distances to start from, metres; by default, and where NaN, the closest depths.
    gap : float
        ``optimal`` stops once (cost − lower bound) / cost is no more than this.
    prices : (N,) array, optional
        Prices of the samples, 0 to 1, to start bounds from: those of a solution of a similar
        problem.
    """

    k: int = 2
    scope: str = "all"
    grid: Grid | None = None
    rings: int = 1
    start: FloatArray | None = None
    gap: float = 1e-6
    prices: FloatArray | None = None

    __repr__ = brief_repr
