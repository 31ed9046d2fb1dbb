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
from focus_planner.core.bounds import branch_and_bound as branching
from focus_planner.core.bounds.branch_and_bound import Branching
from focus_planner.core.bounds.lagrangian import Prices
from focus_planner.core.problem.gains import gains_of
from testing import reference
from testing.problems import random_problem, ring_mask, tiny_problem, with_threads

SHALLOW = Lens(0.05, 40.0)


def search(gains, goal, steps=60):
    """Branching from prices that a few steps were spent on."""
    prices = Prices(gains)
    while prices.steps < steps:
        prices.descend(goal)
        if prices.bound <= goal:
            break
    return Branching(gains, prices.price, prices.bound, goal)


def test_the_bound_is_never_below_what_can_be_gained_and_closes_on_it():
    branched = 0
    for seed in range(500):
        gains = gains_of(tiny_problem(seed))
        most = reference.largest_gain(gains)
        open_nodes = search(gains, most)
        for _ in range(200):
            if open_nodes.exhausted:
                break
            branched += 1
            assert open_nodes.bound > most
            open_nodes.step(most)
        assert open_nodes.exhausted
        assert open_nodes.bound == 0
        assert open_nodes.leaf is None or reference.cells_gain(gains, open_nodes.leaf) <= most
    assert branched > 50


@pytest.mark.parametrize("part", [0.999999, 0.99, 0.9])
def test_with_a_goal_below_the_optimum_the_bound_stays_above_it(part):
    leaves = branched = 0
    for seed in range(250):
        gains = gains_of(tiny_problem(seed))
        most = reference.largest_gain(gains)
        goal = int(part * most) - 1
        open_nodes, found = search(gains, goal), 0
        for _ in range(3000):
            if open_nodes.exhausted:
                break
            branched += 1
            before = open_nodes.bound
            open_nodes.step(goal)
            if open_nodes.leaf is not None:
                leaves += 1
                found = max(found, reference.cells_gain(gains, open_nodes.leaf))
                open_nodes.leaf = None
            # The best plan is in an open node, or was come down to.
            assert max(open_nodes.bound, found) >= most
            assert open_nodes.bound <= before
        assert open_nodes.exhausted
        assert found == most
    assert leaves >= 250
    assert branched > leaves


def test_a_goal_that_rises_drops_nodes():
    gains = gains_of(random_problem(0, 60, 8, lens=SHALLOW))
    prices = Prices(gains)
    prices.descend(0)
    low = Branching(gains, prices.price, prices.bound, 0)
    for _ in range(5):
        low.step(0)
    assert not low.exhausted
    goal = low.bound
    low.step(goal)
    assert low.exhausted
    assert low.bound == 0


def test_nothing_is_open_where_the_bound_is_at_the_goal():
    gains = gains_of(random_problem(1, 60, 8))
    prices = Prices(gains)
    prices.descend(0)
    at_once = Branching(gains, prices.price, prices.bound, prices.bound)
    assert at_once.exhausted
    assert at_once.bound == 0
    assert at_once.nodes == 1


def test_leaves_and_cells_know_the_cameras_without_cells():
    seen = 0
    for seed in range(40):
        problem = random_problem(seed, 14, 4, share=0.9, lens=SHALLOW)
        blind = problem.camera_index == seed % 4
        problem.focus_near[blind], problem.focus_far[blind] = np.inf, -np.inf
        gains = gains_of(problem)
        counts = np.diff(gains.cell_offsets)
        open_nodes = search(gains, 0, 5)
        for _ in range(100):
            if open_nodes.exhausted:
                break
            chosen = open_nodes.plans(1)
            open_nodes.step(0)
            if open_nodes.leaf is not None:
                chosen.append(open_nodes.leaf)
                open_nodes.leaf = None
                seen += 1
            for cell in chosen:
                assert cell[seed % 4] == -1
                assert (np.where(counts > 0, cell, 0) >= 0).all()
                assert (cell < counts).all()
    assert seen > 20


def test_where_prices_tell_no_camera_ranges_are_halved():
    # All in one cell at any price: nothing alternates, but the goal is out of reach.
    problem = random_problem(2, 12, 2, share=1.0, lens=SHALLOW)
    gains = gains_of(problem)
    most = reference.largest_gain(gains)
    open_nodes = Branching(gains, gains.most.copy(), int(gains.most.sum()), most - 1)
    for _ in range(200):
        if open_nodes.exhausted or open_nodes.leaf is not None:
            break
        open_nodes.step(most - 1)
    assert open_nodes.leaf is not None
    assert reference.cells_gain(gains, open_nodes.leaf) == most


def test_no_more_nodes_than_there_is_room_for(monkeypatch):
    gains = gains_of(random_problem(3, 300, 20, visible=ring_mask(300, 20), lens=SHALLOW))
    open_nodes = search(gains, 0)
    open_nodes.step(0)
    assert not open_nodes.exhausted
    monkeypatch.setattr(branching, "_OPEN_BYTES", 10 * (8 * 300 + 32 * 20))
    for _ in range(100):
        if open_nodes.exhausted:
            break
        open_nodes.step(0)
    assert open_nodes.exhausted
    assert 10 < len(open_nodes._open) <= 10 + 16
    assert open_nodes.bound > 0
    # A node keeps no array but its own.
    for node in open_nodes._open:
        assert node.price.base is None
    before = open_nodes.plans(1)[0]
    open_nodes.plans(1)[0][:] = -5
    np.testing.assert_array_equal(open_nodes.plans(1)[0], before)


def test_the_search_repeats_bit_for_bit_with_any_number_of_threads():
    gains = gains_of(random_problem(4, 400, 20, visible=ring_mask(400, 20), lens=SHALLOW))

    def run():
        open_nodes, bounds = search(gains, 0), []
        for _ in range(6):
            open_nodes.step(0)
            plans = [cell.tobytes() for cell in open_nodes.plans(3)]
            bounds.append((open_nodes.bound, open_nodes.nodes, plans))
        return bounds

    once = run()
    assert once == run()
    assert once == with_threads(2, run)


def test_batches_do_not_depend_on_threads(monkeypatch):
    gains = gains_of(random_problem(5, 400, 20, visible=ring_mask(400, 20), lens=SHALLOW))
    nodes = []
    for work in (1, 20_000_000):
        monkeypatch.setattr(branching, "_WORK", work)
        open_nodes = search(gains, 0)
        most = 0
        for _ in range(60):
            before = open_nodes.nodes
            open_nodes.step(0)
            most = max(most, open_nodes.nodes - before)
        nodes.append(most)
    # Two halves of one node a step; of small problems, up to eight nodes go at once.
    assert nodes == [2, 16]


def test_it_branches_on_the_camera_that_lowers_the_bound_most(monkeypatch):
    monkeypatch.setattr(branching, "_ENOUGH", np.inf)
    monkeypatch.setattr(branching, "_ROOT_TRIES", 20)
    gains = gains_of(random_problem(6, 200, 20, visible=ring_mask(200, 20), lens=SHALLOW))
    goal = int(0.98 * search(gains, 0).bound)
    apart = search(gains, goal)
    root = apart._open[0]
    torn = np.flatnonzero(root.score > 0).tolist()
    assert len(torn) > 3
    worth = {}
    for camera in torn:
        low, high, split = (int(ends[camera]) for ends in (root.low, root.high, root.split))
        cuts = [(low, split), (split + 1, high)]
        halves = apart._adapt([branching.Part(root, camera, *cut) for cut in cuts], goal)
        lowered = [float(half.negative_bound - root.negative_bound) for half in halves]
        least = 1e-3 * (-root.negative_bound - goal)
        worth[camera] = np.sqrt(np.prod(np.clip(lowered, least, 1000 * least)))
    open_nodes = search(gains, goal)
    for _ in torn:
        assert len(open_nodes._choices) in {0, 1}
        open_nodes.step(goal)
    assert not open_nodes._choices
    best = max(worth, key=worth.__getitem__)
    children = open_nodes._first(3)
    assert 1 <= len(children) <= 2
    for child in children:
        assert (child.low[best], child.high[best]) != (root.low[best], root.high[best])
        np.testing.assert_allclose(child.worth[torn], [worth[c] for c in torn])
        assert np.isnan(np.delete(child.worth, torn)).all()


def test_while_cameras_are_tried_the_bound_holds_and_plans_are_told():
    gains = gains_of(random_problem(6, 200, 20, visible=ring_mask(200, 20), lens=SHALLOW))
    goal = int(0.98 * search(gains, 0).bound)
    open_nodes = search(gains, goal)
    bound, plan = open_nodes.bound, open_nodes.plans(1)[0]
    open_nodes.step(goal)
    assert open_nodes._choices
    assert not open_nodes._open
    assert not open_nodes.exhausted
    assert open_nodes.bound == bound
    np.testing.assert_array_equal(open_nodes.plans(1)[0], plan)
    open_nodes.step(bound)
    assert open_nodes.exhausted
