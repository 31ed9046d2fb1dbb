# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The methods that experiments compare, and how plots show them."""

from __future__ import annotations

from dataclasses import dataclass

from focus_planner.core.problem.problem import Problem
from focus_planner.core.rig.rig import Rig
from focus_planner.core.solvers import SOLVERS, Options, Solution


@dataclass(frozen=True)
class Method:
    """A solver with its options, by the name that tables and plots give it.

    Attributes
    ----------
    name : str
    colour : str
        Of its lines, bars and dots.
    solver : str
    scope : {"all", "assigned"}
    on_grid : bool
        Whether it takes tuples from the rig's grid, where it has one.
    k : int
    """

    name: str
    colour: str
    solver: str
    scope: str = "all"
    on_grid: bool = False
    k: int = 2

    def options(self, rig: Rig) -> Options:
        """Return its solver's options for problems of this rig."""
        return Options(self.k, self.scope, rig.grid if self.on_grid else None)

    def solve(self, problem: Problem, rig: Rig) -> Solution:
        """Return the method's solution of a problem of this rig."""
        return SOLVERS[self.solver](problem, self.options(rig))


CLOSEST = Method("closest", "#9aa3ab", "closest")
AVERAGE = Method("average", "#c98d2b", "average")
EM = Method("EM", "#2c6fb5", "em")
#: The paper's own: neighbours on the grid, and only the samples assigned to them.
TWO_VIEW = Method("2-view", "#b5482c", "k_view", scope="assigned", on_grid=True)
TWO_VIEW_ALL = Method("2-view, all samples", "#2f8f5b", "k_view")
THREE_VIEW = Method("3-view, all samples", "#6b4fa3", "k_view", k=3)
