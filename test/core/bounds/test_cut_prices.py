# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.
"""Bounds with cuts against all plans there are, and against the same sums one by one."""

import numpy as np
import pytest

from focus_planner import Lens
from focus_planner.core import kernels
from focus_planner.core.bounds.branch_and_bound import Branching
from focus_planner.core.bounds.branch_and_cut import BranchingWithCuts
from focus_planner.core.bounds.cut_prices import CutPrices, whole_of
from focus_planner.core.bounds.lagrangian import Prices
from focus_planner.core.bounds.odd_holes import no_cuts, separate
from focus_planner.core.problem.gains import gains_of
from testing import reference
from testing.cut_problems import UNIT, random_plan, relaxed_gain, ring
from testing.problems import random_problem, tiny_problem, with_threads

SHALLOW = Lens(0.05, 40.0)


def priced(gains, goal):
    """Prices that steps hardly lower any more."""
    prices = Prices(gains)
    while not prices.settled(goal):
        prices.descend(goal)
    return prices


def descended(gains, goal, rounds=30):
    """Prices of samples and cuts after some rounds."""
    prices = priced(gains, goal)
    cuts = CutPrices(gains, prices.price, prices.bound)
    for _ in range(rounds):
        if cuts.bound > goal:
            cuts.descend(goal)
    return prices, cuts


def parts(gains, price):
    return price[: len(gains.most)], price[len(gains.most) :]


def no_plan(gains):
    return kernels.FractionalPlan(np.zeros(len(gains.gain)), np.zeros(int(gains.cell_offsets[-1])))


def some_cuts(gains, random):
    """Cuts, and prices of samples and of the cuts, at random."""
    plan = random_plan(gains, random)
    cuts = separate(gains, whole_of(gains).camera, plan, random)
    price = (random.random(len(gains.most)) * gains.most).astype(np.int64)
    most = int(gains.most.max(initial=0))
    shares = random.random(len(cuts.limit)) * (random.random(len(cuts.limit)) < 0.7)
    return cuts, price, (0.3 * most * shares).astype(np.int64)


def test_with_any_multipliers_no_plan_gains_more():
    cut = 0
    for seed in range(500):
        gains, random = gains_of(tiny_problem(seed)), np.random.default_rng(seed)
        cuts, price, multiplier = some_cuts(gains, random)
        most = reference.largest_gain(gains)
        assert reference.cut_bound(gains, cuts, price, multiplier) >= most
        cut += multiplier.any()
    assert cut > 40


@pytest.mark.parametrize("steps", [1, 2, 40])
def test_what_steps_prove_is_exact(steps):
    lower = cut = 0
    for seed in range(150):
        problem = random_problem(seed, 14, 4, share=0.8, lens=Lens(0.05, 8.0))
        gains, random = gains_of(problem), np.random.default_rng(seed)
        cuts, price, multiplier = some_cuts(gains, random)
        low, high = reference.all_cells(gains)
        high = (high - random.integers(0, 2, len(high)) * (high > 0)).astype(np.int32)
        before = reference.cut_bound(gains, cuts, price, multiplier, low, high)
        cut += multiplier.any()
        node = kernels.CutNode(low, high, price, multiplier)
        last = price.copy(), multiplier.copy()
        bound, final = kernels.adapt_all(
            node,
            last,
            cuts,
            whole_of(gains),
            before,
            0,
            int(random.integers(0, 5)),
            kernels.Steps(steps, before / 20, before / 1000),
            no_plan(gains),
        )
        assert bound == reference.cut_bound(gains, cuts, price, multiplier, low, high)
        assert final == reference.cut_bound(gains, cuts, *last, low, high)
        assert bound <= final
        assert (price >= 0).all()
        assert (multiplier >= 0).all()
        lower += bound < before
    assert lower > 100 or steps == 1
    assert cut > 50


def test_what_the_last_step_takes_is_a_fractional_plan():
    gains = gains_of(random_problem(0, 40, 6, share=0.8, lens=SHALLOW))
    plan = no_plan(gains)
    low, high = reference.all_cells(gains)
    price, none = gains.most // 2, np.zeros(0, dtype=np.int64)
    node, last = kernels.CutNode(low, high, price, none), (price.copy(), none.copy())
    bound = reference.confined_bound(gains, price)
    steps = kernels.Steps(300, bound / 100, bound / 100)
    kernels.adapt_all(node, last, no_cuts(), whole_of(gains), bound, 0, 0, steps, plan)
    totals = np.add.reduceat(plan.stands, gains.cell_offsets[:-1])
    np.testing.assert_allclose(totals, 1.0, atol=1e-9)
    assert ((plan.held >= 0) & (plan.held <= 1 + 1e-9)).all()
    camera = np.repeat(np.arange(gains.camera_count), np.diff(gains.offsets))
    up_to = np.concatenate([[0.0], np.cumsum(plan.stands)])
    start = gains.cell_offsets[camera]
    assert (plan.held <= up_to[start + gains.last + 1] - up_to[start + gains.first] + 1e-9).all()


def test_the_least_bound_is_the_relaxation_with_the_same_cuts():
    lower = 0
    for seed in range(40):
        gains = gains_of(random_problem(seed, 40, 5, share=0.8, lens=Lens(0.05, 8.0)))
        goal = int(0.9 * reference.largest_gain(gains))
        _, root = descended(gains, goal, rounds=10)
        most, low_high = relaxed_gain(gains, root.cuts), reference.all_cells(gains)
        price, multiplier = parts(gains, root.price)
        bound, width = root.bound, most / 1000
        for _ in range(6):
            node = kernels.CutNode(*low_high, price, multiplier)
            last, steps = (price.copy(), multiplier.copy()), kernels.Steps(400, width, width / 4)
            bound, _ = kernels.adapt_all(
                node, last, root.cuts, root.whole, bound, goal, 0, steps, no_plan(gains)
            )
            width /= 4
        assert most * (1 - 1e-9) <= bound <= most * (1 + 1e-5)
        lower += most < relaxed_gain(gains, no_cuts()) * (1 - 1e-4)
    assert lower > 20


@pytest.mark.parametrize(("cameras", "best", "relaxed"), [(3, 4, 4.5), (5, 7, 7.5), (7, 10, 10.5)])
def test_of_a_ring_of_cameras_cuts_prove_the_best_plan(cameras, best, relaxed):
    gains = ring(cameras)
    assert reference.largest_gain(gains) == best * UNIT
    prices, cuts = descended(gains, best * UNIT, rounds=50)
    assert prices.bound >= relaxed * UNIT
    assert best * UNIT <= cuts.bound <= (best + 1e-3) * UNIT


def test_the_bound_with_cuts_is_one_and_no_worse_than_without():
    closed = 0
    for seed in range(60):
        gains = gains_of(random_problem(seed, 40, 5, share=0.8, lens=Lens(0.05, 8.0)))
        most = reference.largest_gain(gains)
        prices, cuts = descended(gains, most, rounds=12)
        assert most <= cuts.bound <= prices.bound
        assert cuts.bound == reference.cut_bound(gains, cuts.cuts, *parts(gains, cuts.price))
        closed += cuts.bound - most < 0.5 * (prices.bound - most)
    assert closed > 3


def test_rounds_end_and_drop_cuts_that_have_no_price(monkeypatch):
    gains = gains_of(random_problem(2, 120, 8, share=0.6, lens=Lens(0.05, 8.0)))
    cuts = descended(gains, 0, rounds=0)[1]
    add, added = cuts.add_cuts, []
    monkeypatch.setattr(cuts, "add_cuts", lambda plan: added.append(add(plan)) or added[-1])
    goal = int(0.98 * cuts.bound)
    for _ in range(2000):
        cuts.descend(goal)
        if cuts.settled:
            break
    assert cuts.settled
    assert 0 < len(cuts.cuts.limit) < sum(added)


# --- Branching -----------------------------------------------------------------------------------


def test_nodes_are_exact():
    confined = 0
    for seed in range(120):
        gains = gains_of(random_problem(seed, 30, 5, share=0.7, lens=Lens(0.05, 8.0)))
        most, random = reference.largest_gain(gains), np.random.default_rng(seed)
        _, root = descended(gains, most, rounds=4)
        counts = np.diff(gains.cell_offsets)
        c = int(np.argmax(counts))
        if counts[c] < 2:
            continue
        split = int(random.integers(counts[c] - 1))
        low, high = reference.all_cells(gains)
        nodes = kernels.Nodes(
            np.array([root.bound]),
            low[None],
            high[None],
            root.price[None].copy(),
            np.zeros((1, len(low)), dtype=np.int64),
            np.zeros((1, len(low)), dtype=np.int32),
            np.zeros((1, len(low)), dtype=np.int32),
        )
        near = kernels.Neighbourhoods(
            np.arange(len(low) + 1, dtype=np.int64) * 3,
            np.stack([(np.arange(len(low)) + i) % len(low) for i in range(3)], axis=1)
            .ravel()
            .astype(np.int32),
        )
        kernels.confine_with_cuts(
            kernels.Cuts(
                np.array([c]), np.array([0]), np.array([split]), np.array([bool(seed % 2)])
            ),
            near,
            root.cuts,
            *root.whole,
            nodes,
            0,
            3,
            kernels.Steps(25, most / 100, most / 1000),
        )
        high[c] = split
        told = reference.cut_bound(gains, root.cuts, *parts(gains, nodes.price[0]), low, high)
        assert nodes.bound[0] == told
        assert reference.largest_gain(gains, low, high) <= told <= root.bound
        assert (
            reference.largest_gain(gains, nodes.low[0], nodes.high[0])
            == (reference.largest_gain(gains, low, high))
            or nodes.bound[0] <= most
        )
        confined += 1
    assert confined > 100


def test_branching_with_cuts_comes_down_to_the_optimum_and_never_below():
    branched = fewer = 0
    for seed in range(80):
        gains = gains_of(random_problem(seed, 40, 5, share=0.8, lens=Lens(0.05, 8.0)))
        most = reference.largest_gain(gains)
        prices, root = descended(gains, most, rounds=6)
        if root.bound <= most:
            continue
        search, plain = (
            BranchingWithCuts(gains, root, most),
            Branching(gains, prices.price, prices.bound, most),
        )
        for tree in (search, plain):
            for _ in range(400):
                if tree.exhausted:
                    break
                assert tree.bound > most
                tree.step(most)
            assert tree.exhausted
        branched += 1
        fewer += search.nodes < plain.nodes
    assert branched > 10
    assert fewer > branched / 2


def test_with_a_goal_below_the_optimum_the_bound_stays_above_it(monkeypatch):
    monkeypatch.setattr("focus_planner.core.bounds.branch_and_cut._SEARCH_EVERY", 1)
    found_some = 0
    for seed in range(60):
        gains = gains_of(random_problem(seed, 25, 4, share=0.8, lens=Lens(0.05, 8.0)))
        most = reference.largest_gain(gains)
        goal = int(0.99 * most)
        _, root = descended(gains, goal, rounds=1)
        tree, best = BranchingWithCuts(gains, root, goal), 0
        before = len(root.cuts.limit)
        for _ in range(500):
            if tree.exhausted:
                break
            tree.step(goal)
            if tree.leaf is not None:
                best = max(best, reference.cells_gain(gains, tree.leaf))
                tree.leaf = None
            assert max(tree.bound, best) >= most
        assert tree.exhausted
        assert best == most
        found_some += len(root.cuts.limit) > before
    assert found_some > 3


@pytest.mark.parametrize("threads", [1, 2])
def test_a_search_with_cuts_repeats_bit_for_bit(threads):
    gains = gains_of(random_problem(0, 300, 12, share=0.5, lens=SHALLOW))

    def run():
        _, root = descended(gains, 0, rounds=10)
        tree = BranchingWithCuts(gains, root, 0)
        bounds = [root.bound]
        for _ in range(30):
            tree.step(0)
            bounds.append(tree.bound)
        return bounds, root.price.tobytes()

    assert run() == with_threads(threads, run)
