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

from focus_planner import cylinder_rig
from focus_planner.core.problem.cells import UNITS
from focus_planner.core.problem.gains import gains_of
from focus_planner.core.solvers.solution import assign_samples, distances_of_cells
from testing import reference
from testing.problems import body, problem_of, random_problem, tiny_problem


def random_cells(problem, random):
    """Some cell of each camera's, -1 where there is none."""
    counts = np.diff(problem.cells.offsets)
    return np.where(counts, random.integers(0, np.maximum(counts, 1)), -1).astype(np.int32)


def test_a_plan_costs_what_is_out_of_focus_less_what_it_gains():
    gaining = 0
    for seed in range(400):
        problem, random = tiny_problem(seed), np.random.default_rng(seed)
        gains, table = gains_of(problem), reference.table(problem)
        for _ in range(3):
            cell = random_cells(problem, random)
            gain = reference.cells_gain(gains, cell)
            assert gains.out - gain == assign_samples(problem, cell)[1]
            focus = np.nan_to_num(distances_of_cells(problem, cell), nan=1e9)
            expected = reference.cost(table, focus)
            assert 1000 * (gains.out - gain) / UNITS == pytest.approx(expected, abs=1e-9)
            gaining += gain > 0
    assert gaining > 600


def test_gains_are_those_of_the_table():
    for seed in range(400):
        problem = tiny_problem(seed)
        gains, table = gains_of(problem), reference.table(problem)
        out, expected = reference.focus_gains(table)
        assert 1000 * gains.out / UNITS == pytest.approx(out, abs=1e-8)
        found = [{} for _ in expected]
        for c in range(gains.camera_count):
            pairs = range(gains.offsets[c], gains.offsets[c + 1])
            assert (np.diff(gains.sample[pairs.start : pairs.stop]) > 0).all()
            for j in pairs:
                assert gains.gain[j] > 0
                found[gains.sample[j]][c] = 1000 * int(gains.gain[j]) / UNITS
        for p, (some, others) in enumerate(zip(found, expected, strict=True)):
            for c in some.keys() | others.keys():  # what is less than a unit may be there or not
                assert some.get(c, 0.0) == pytest.approx(others.get(c, 0.0), abs=1e-9)
            assert 1000 * int(gains.most[p]) / UNITS == pytest.approx(
                max(others.values(), default=0.0), abs=1e-9
            )


def test_ranges_are_those_of_the_problems_cells():
    problem = random_problem(3, 60, 6)
    gains, cells = gains_of(problem), problem.cells
    np.testing.assert_array_equal(gains.cell_offsets, cells.offsets)
    ranges = {
        (p, c): (first, last)
        for p, c, first, last in zip(
            problem.sample_index, problem.camera_index, cells.first, cells.last, strict=True
        )
    }
    for c in range(6):
        for j in range(gains.offsets[c], gains.offsets[c + 1]):
            assert (gains.first[j], gains.last[j]) == ranges[gains.sample[j], c]


def test_out_of_focus_everything_costs_what_no_plan_exceeds():
    problem = problem_of(body(), cylinder_rig(3, 8), 500)
    gains = gains_of(problem)
    nowhere = problem.cost(np.full(problem.camera_count, np.nan))
    assert 1000 * gains.out / UNITS == pytest.approx(nowhere, rel=1e-10)
    # All in focus in their best cameras: the bound that leaves the focus term out.
    assert 1000 * (gains.out - int(gains.most.sum())) / UNITS == pytest.approx(
        nowhere - 1000 / 3 * np.mean(np.diff(problem.sample_offsets) > 0), rel=1e-3
    )
