# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.
"""Cuts against all plans there are."""

import numpy as np
import pytest

from focus_planner import Lens
from focus_planner.core.bounds.cut_prices import whole_of
from focus_planner.core.bounds.odd_holes import chosen, joined, no_cuts, separate
from focus_planner.core.problem.gains import gains_of
from testing import reference
from testing.cut_problems import random_plan, ring
from testing.problems import random_problem, tiny_problem

SHALLOW, DEEPER = Lens(0.05, 40.0), Lens(0.05, 8.0)


def found(gains, plan, seed=0):
    return separate(gains, whole_of(gains).camera, plan, np.random.default_rng(seed))


def half_of(gains):
    """The plan that has half of everything."""
    return random_plan(gains, np.random.default_rng(0))._replace(
        held=np.full(len(gains.gain), 0.5), stands=np.full(int(gains.cell_offsets[-1]), 0.5)
    )


def members(cuts):
    return [reference.cut_members(cuts, k) for k in range(len(cuts.limit))]


def test_whatever_is_taken_cuts_hold_in_every_plan():
    count = wide = apart = 0
    for seed in range(200):
        if seed % 2:
            gains = gains_of(tiny_problem(seed, most_choices=300))
        else:
            gains = gains_of(random_problem(seed, 14, 4, share=0.8, lens=DEEPER))
        cuts = found(gains, random_plan(gains, np.random.default_rng(seed)))
        if not len(cuts.limit):
            continue
        plans = list(reference.cells_between(*reference.all_cells(gains)))
        for cell in plans[:: max(1, len(plans) // 400)]:
            for k in range(min(len(cuts.limit), 20)):
                assert reference.cut_excess(gains, cuts, k, cell) <= 0
        count += len(cuts.limit)
        wide += sum(last > first for _, _, ranges in members(cuts) for _, first, last in ranges)
        # Of k samples these count more than k // 2: ranges of one camera exclude each other.
        apart += sum(limit > len(pairs) // 4 for limit, pairs, _ in members(cuts))
    assert count > 150
    assert wide > 150
    assert apart > 10


@pytest.mark.parametrize("cameras", [3, 5, 7])
def test_of_a_ring_of_cameras_the_cut_is_found(cameras):
    gains = ring(cameras)
    cuts = found(gains, half_of(gains))
    assert len(cuts.limit)
    for limit, pairs, ranges in members(cuts):
        assert limit == cameras // 2
        assert len(pairs) == 2 * cameras
        assert sorted(ranges) == [(c, 0, 0) for c in range(cameras)]


@pytest.mark.parametrize("cameras", [4, 6])
def test_an_even_ring_has_none(cameras):
    gains = ring(cameras)
    assert len(found(gains, half_of(gains)).limit) == 0


def test_a_plan_violates_no_cut():
    for seed in range(100):
        gains = gains_of(random_problem(seed, 20, 4, share=0.8, lens=SHALLOW))
        random = np.random.default_rng(seed)
        cell = random.integers(np.diff(gains.cell_offsets))
        camera = np.repeat(np.arange(gains.camera_count), np.diff(gains.offsets))
        held = (gains.first <= cell[camera]) & (cell[camera] <= gains.last)
        taken = np.zeros(len(gains.gain))
        for p in np.unique(gains.sample):
            taken[np.flatnonzero(held & (gains.sample == p))[:1]] = 1.0
        stands = np.zeros(int(gains.cell_offsets[-1]))
        stands[gains.cell_offsets[:-1] + cell] = 1.0
        plan = random_plan(gains, random)._replace(held=taken, stands=stands)
        assert len(found(gains, plan).limit) == 0


def test_each_cycle_gives_cuts_for_other_samples_of_its_cameras():
    gains = ring(3, copies=5)
    cuts = found(gains, half_of(gains))
    samples = [{int(gains.sample[j]) for j in pairs} for _, pairs, _ in members(cuts)]
    assert set.union(*samples) == set(range(15))


def test_pools_are_joined_and_chosen_from():
    gains = [gains_of(random_problem(seed, 30, 5, share=0.8, lens=DEEPER)) for seed in (0, 2)]
    pools = [found(g, random_plan(g, np.random.default_rng(1))) for g in gains]
    both = joined(joined(no_cuts(), pools[0]), pools[1])
    assert members(both) == members(pools[0]) + members(pools[1])
    assert len(members(both)) > 4
    kept = np.array([0, 2, len(both.limit) - 1])
    assert members(chosen(both, kept)) == [members(both)[k] for k in kept]
    assert members(chosen(both, kept[:0])) == []


def test_the_same_plan_and_generator_give_the_same_cuts():
    gains = gains_of(random_problem(0, 60, 6, share=0.8, lens=SHALLOW))
    plan = random_plan(gains, np.random.default_rng(0))
    first, second = (found(gains, plan, seed=4) for _ in range(2))
    assert len(first.limit)
    assert members(first) == members(second)
