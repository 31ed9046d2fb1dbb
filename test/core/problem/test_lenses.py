# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

import numpy as np
import pytest

from focus_planner import Lens
from focus_planner.core.problem.lenses import with_lenses
from focus_planner.core.rig.diffraction import GREEN, sharp_interval
from testing.problems import random_problem


def test_with_its_own_lenses_a_problem_stays_as_it_is():
    problem = random_problem(3)
    again = with_lenses(problem, problem.lenses)
    assert np.array_equal(again.focus_near, problem.focus_near)
    assert np.array_equal(again.focus_far, problem.focus_far)


@pytest.mark.parametrize("wavelength", [0.0, GREEN])
def test_every_pair_gets_the_interval_of_its_own_lens(wavelength):
    problem = random_problem(3)
    lenses = tuple(
        Lens(0.05, 8.0 + c % 2, circle_of_confusion=30e-6) for c in range(problem.camera_count)
    )
    changed = with_lenses(problem, lenses, wavelength)
    assert changed.lenses == lenses
    for pair in range(0, len(problem.depth), 7):
        lens = lenses[problem.camera_index[pair]]
        near, far = sharp_interval(problem.depth[pair : pair + 1], lens, wavelength)
        assert changed.focus_near[pair] == pytest.approx(near[0], rel=1e-9)
        assert changed.focus_far[pair] == pytest.approx(far[0], rel=1e-9)
