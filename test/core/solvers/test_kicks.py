# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.
"""Kicks, against the cost of what they end at."""

import numpy as np
import pytest

from focus_planner import Lens
from focus_planner.core.problem.shots import with_shots
from focus_planner.core.solvers import Options, k_view
from focus_planner.core.solvers.k_view import Descent
from focus_planner.core.solvers.kicks import Kicks
from focus_planner.core.solvers.solution import assign_samples, start_cells
from testing.problems import random_problem, ring_mask

SHALLOW = Lens(0.05, 40.0)


def kicks_of(problem):
    descent = Descent(problem, Options())
    kicks = Kicks(descent, problem.cells.offsets)
    kicks.start(start_cells(problem, k_view.solve(problem).focus_distances))
    return descent, kicks


@pytest.mark.parametrize(("views", "shots"), [(1, 1), (1, 2), (2, 1)])
def test_after_every_kick_the_descent_is_where_it_says(views, shots):
    visible = ring_mask(200, 12)
    problem = random_problem(0, 200, 12, visible=visible, lens=SHALLOW, views=views)
    problem = with_shots(problem, shots)
    descent, kicks = kicks_of(problem)
    better = 0
    for _ in range(60):
        before = kicks.units
        found = kicks.kick()
        assert descent.units == assign_samples(problem, descent.cell)[1]
        assert kicks.units == assign_samples(problem, kicks.cell)[1]
        assert (kicks.units < before) == found
        assert kicks.units <= before
        better += found
    assert better or shots == 1


def test_no_pair_improves_what_a_kick_ends_at():
    problem = random_problem(1, 200, 12, visible=ring_mask(200, 12), lens=SHALLOW)
    descent, kicks = kicks_of(problem)
    for _ in range(20):
        kicks.kick()
        fresh = Descent(problem, Options())
        fresh.run(descent.cell.copy(), lambda _: True)
        assert fresh.units == descent.units


def test_a_descent_stands_again_where_it_stood():
    problem = random_problem(2, 200, 12, visible=ring_mask(200, 12), lens=SHALLOW)
    descent, _ = kicks_of(problem)
    state, units = descent.standing()
    kept = [array.copy() for array in state]
    descent.run_from(np.arange(4, dtype=np.int32), np.zeros(4, dtype=np.int32))
    descent.stand(state, units)
    again, units_again = descent.standing()
    assert units_again == units
    for array, before in zip(again, kept, strict=True):
        np.testing.assert_array_equal(array, before)


def test_kicks_repeat():
    problem = random_problem(3, 200, 12, visible=ring_mask(200, 12), lens=SHALLOW)
    runs = []
    for _ in range(2):
        _, kicks = kicks_of(problem)
        runs.append([(kicks.kick(), kicks.units) for _ in range(40)])
    assert runs[0] == runs[1]


def test_cameras_that_see_nothing_or_share_nothing_are_not_kicked():
    alone = random_problem(
        0, 12, 3, visible=np.arange(12)[:, None] % 3 == np.arange(3), lens=SHALLOW
    )
    _, kicks = kicks_of(alone)
    assert not any(kicks.kick() for _ in range(5))


def test_guided_kicks_draw_cells_by_their_share():
    problem = random_problem(4, 200, 12, visible=ring_mask(200, 12), lens=SHALLOW)
    _, kicks = kicks_of(problem)
    offsets = problem.cells.offsets
    share = np.zeros(offsets[-1])
    share[offsets[:-1] + 1] = 1.0
    kicks.guide(share)
    drawn = [kicks._draw() for _ in range(300)]
    cells = np.concatenate([cells for _, cells in drawn])
    assert 0.65 < (cells == 1).mean() < 0.85
    counts = np.diff(offsets)
    assert all(((cells >= 0) & (cells < counts[cameras])).all() for cameras, cells in drawn)


def test_what_stays_as_it_is_starts_again_from_a_drawn_plan(monkeypatch):
    monkeypatch.setattr("focus_planner.core.solvers.kicks._PATIENCE", 3)
    problem = random_problem(5, 200, 12, visible=ring_mask(200, 12), lens=SHALLOW)
    descent, kicks = kicks_of(problem)
    run, started = descent.run, []
    monkeypatch.setattr(descent, "run", lambda cell, tell: started.append(1) or run(cell, tell))
    kicks.guide(np.ones(problem.cells.offsets[-1]))
    for _ in range(60):
        before = kicks.units
        assert kicks.kick() == (kicks.units < before)
        assert kicks.units == assign_samples(problem, kicks.cell)[1]
    assert len(started) > 3
