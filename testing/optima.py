# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What tests ask of proven optima."""

from __future__ import annotations

import numpy as np
import pytest

from focus_planner.core.problem.cells import UNITS
from focus_planner.core.problem.gains import gains_of
from testing import reference


class Log:
    """A callback that remembers, and stops the solver after some steps."""

    def __init__(self, steps=np.inf):
        self.progress, self.steps = [], steps

    def __call__(self, progress):
        self.progress.append(progress)
        return len(self.progress) < self.steps

    @property
    def costs(self):
        return [progress.cost for progress in self.progress]

    @property
    def stages(self):
        return [progress.stage for progress in self.progress]


def least_cost(problem):
    """The optimum, from all choices of cells; these are tested against the table below."""
    gains = gains_of(problem)
    return 1000 * (gains.out - reference.largest_gain(gains)) / UNITS


def check(problem, solution, best):
    """What holds of every solution, proven or not."""
    assert solution.cost == problem.cost(solution.focus_distances)
    assert solution.lower_bound <= best + 1e-9
    assert solution.lower_bound <= solution.cost
    assert solution.cost >= best - 1e-8
    if solution.converged:
        assert solution.cost == pytest.approx(best, abs=1e-8)
        # Less one unit per sample, for what the units round off.
        assert solution.lower_bound >= solution.cost - 1e-8
