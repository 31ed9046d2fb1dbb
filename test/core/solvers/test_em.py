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

from focus_planner.core.solvers import Options, em
from testing import reference
from testing.problems import random_problem


def run(problem, start):
    costs = []

    def on_progress(progress):
        costs.append(progress.cost)
        return True

    return em.solve(problem, Options(start=start), on_progress), costs


@pytest.mark.parametrize("share", [0.3, 0.8])
def test_em_goes_by_the_book(share):
    iterations = 0
    for seed in range(20):
        problem = random_problem(seed, 30, 4, share=share)
        cells, random = problem.cells, np.random.default_rng(seed)
        start = cells.distances()[random.integers(cells.offsets[:-1], cells.offsets[1:])]
        solution, costs = run(problem, start)
        expected, _ = reference.em(reference.table(problem), start)
        # What a camera holds is told by the cell; which distance in it stands for it is not.
        assert costs == pytest.approx(expected, rel=1e-9)
        assert solution.iterations == len(expected)
        assert solution.cost <= costs[-1] + 1e-9
        iterations += len(expected)
    assert iterations > 35


def test_em_starts_from_the_closest_depths():
    for seed in range(10):
        problem = random_problem(seed, 40, 5)
        closest = [problem.depth[problem.camera_index == c].min() for c in range(5)]
        default, costs = run(problem, None)
        given, same = run(problem, np.array(closest))
        assert costs == same
        np.testing.assert_array_equal(default.focus_distances, given.focus_distances)
        assert costs[0] <= problem.cost(np.array(closest)) + 1e-9


def test_a_start_without_a_distance_is_some_start():
    problem = random_problem(0, 40, 5)
    solution, _ = run(problem, np.array([np.nan, 0.6, 100.0, 0.0, np.inf]))
    assert np.isfinite(solution.focus_distances).all()


def test_cameras_are_centred_on_what_they_hold_for_the_rig():
    for seed in range(10):
        problem = random_problem(seed, 30, 4)
        solution, _ = run(problem, None)
        table, focus = reference.table(problem), solution.focus_distances
        phi = reference.assign(table, focus)
        for c in range(4):
            own = [
                (seen.near, seen.far)
                for p, seen in table.of_camera(c).items()
                if phi[p] == c and seen.near <= focus[c] <= seen.far
            ]
            if own:
                near, far = max(near for near, _ in own), min(far for _, far in own)
                assert near <= focus[c] <= far
