# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Confined bounds against sums by hand; what is cut off, against all plans there are."""

import numpy as np
import pytest

from focus_planner.core import kernels
from focus_planner.core.problem.gains import gains_of
from testing import reference
from testing.problems import random_problem, ring_mask, tiny_problem, with_threads

REACH, STEPS = 3, 40


def by_sample(gains):
    offsets, camera, gain = [0], [], []
    cameras = np.repeat(np.arange(gains.camera_count), np.diff(gains.offsets))
    for p in range(len(gains.most)):
        of_sample = np.flatnonzero(gains.sample == p)
        camera.extend(cameras[of_sample])
        gain.extend(gains.gain[of_sample])
        offsets.append(len(camera))
    return kernels.GainsBySample(
        np.array(offsets),
        np.array(camera, dtype=np.int32),
        np.array(gain, dtype=np.int64),
        gains.most,
    )


def random_nodes(gains, random, count):
    """Nodes with random prices and ranges, and within them a camera's part to confine it to."""
    low, high = (np.tile(ends, (count, 1)) for ends in reference.all_cells(gains))
    price = (random.random((count, len(gains.most))) * gains.most).astype(np.int64)
    first, last = np.zeros((2, count), dtype=np.int64)
    camera = np.full(count, -1, dtype=np.int64)
    for b in range(count):
        for c in range(gains.camera_count):
            if low[b, c] < high[b, c]:
                low[b, c], high[b, c] = np.sort(random.integers(low[b, c], high[b, c] + 1, 2))
        if random.random() < 0.8 and (high[b] >= low[b]).any():
            camera[b] = c = random.choice(np.flatnonzero(high[b] >= low[b]))
            first[b], last[b] = np.sort(random.integers(low[b, c], high[b, c] + 1, 2))
    score, split, cell = np.zeros_like(low, dtype=np.int64), 0 * low, 0 * low - 1
    bounds = [reference.confined_bound(gains, *node) for node in zip(price, low, high, strict=True)]
    return (
        kernels.Nodes(np.array(bounds), low, high, price, score, split, cell),
        camera,
        first,
        last,
    )


def confine(gains, nodes, camera, first, last, wide, near, goal, steps=STEPS):
    offsets = np.cumsum([0] + [len(some) for some in near])
    kernels.confine(
        kernels.Cuts(camera, first, last, wide),
        kernels.Neighbourhoods(offsets, np.concatenate(near).astype(np.int32)),
        *gains.priced,
        by_sample(gains),
        nodes,
        goal,
        REACH,
        steps,
    )


def random_near(gains, random):
    """Per camera itself and some of the others."""
    return [
        np.concatenate(
            [[c], [d for d in range(gains.camera_count) if d != c and random.random() < 0.5]]
        )
        for c in range(gains.camera_count)
    ]


def gain_of_each(gains, low, high):
    return {cell: reference.cells_gain(gains, cell) for cell in reference.cells_between(low, high)}


def test_bounds_are_exact_and_nothing_better_than_the_goal_is_cut_off():
    lowered = cut = 0
    for seed in range(700):
        gains, random = gains_of(tiny_problem(seed)), np.random.default_rng(seed)
        most = reference.largest_gain(gains)
        goal = int(most * random.choice([0.0, 0.7, 0.95, 1.0]))
        nodes, camera, first, last = random_nodes(gains, random, 3)
        before = nodes.price.copy()
        low, high = nodes.low.copy(), nodes.high.copy()
        for b in np.flatnonzero(camera >= 0):
            low[b, camera[b]], high[b, camera[b]] = first[b], last[b]
        wide = (camera < 0) | (random.random(3) < 0.5)
        confine(gains, nodes, camera, first, last, wide, random_near(gains, random), goal)
        for b in range(3):
            plans = gain_of_each(gains, low[b], high[b])
            if nodes.bound[b] <= goal:
                assert max(plans.values()) <= max(nodes.bound[b], 0)
                continue
            assert nodes.bound[b] == reference.confined_bound(
                gains, nodes.price[b], nodes.low[b], nodes.high[b]
            )
            start = reference.confined_bound(gains, before[b], low[b], high[b])
            assert max(plans.values()) <= nodes.bound[b] <= start
            lowered += nodes.bound[b] < start
            assert (nodes.low[b] >= low[b]).all()
            assert (nodes.high[b] <= high[b]).all()
            for cell, gain in plans.items():
                if gain > goal:
                    within = (nodes.low[b] <= cell) & (cell <= nodes.high[b])
                    assert (within | (nodes.low[b] > nodes.high[b])).all()
            cut += (nodes.high[b] - nodes.low[b]).sum() < (high[b] - low[b]).sum()
            assert (nodes.price[b] >= 0).all()
            assert (nodes.price[b] <= gains.most).all()
    assert lowered > 300
    assert cut > 20


def test_a_split_leaves_cells_on_both_sides():
    torn = 0
    for seed in range(700):
        gains, random = gains_of(tiny_problem(seed)), np.random.default_rng(seed)
        goal = int(0.9 * reference.largest_gain(gains))
        nodes, camera, first, last = random_nodes(gains, random, 2)
        confine(
            gains, nodes, camera, first, last, np.ones(2, bool), random_near(gains, random), goal
        )
        for b in np.flatnonzero(nodes.bound > goal):
            low, high, has = nodes.low[b], nodes.high[b], nodes.low[b] <= nodes.high[b]
            assert (nodes.cell[b][~has] == -1).all()
            assert (nodes.cell[b][has] >= 0).all()
            split = nodes.score[b] > 0
            assert (low[split] <= nodes.split[b][split]).all()
            assert (nodes.split[b][split] < high[split]).all()
            torn += split.any()
    assert torn > 50


def test_only_the_prices_and_ranges_of_near_cameras_change():
    # A chain of cameras, each sharing samples with the next.
    gains = gains_of(random_problem(3, 60, 6, visible=ring_mask(60, 6, 1)))
    random = np.random.default_rng(0)
    nodes, *_ = random_nodes(gains, random, 1)
    nodes.low[:], nodes.high[:] = reference.all_cells(gains)
    nodes.price[:] = gains.most // 2
    nodes.bound[:] = reference.confined_bound(gains, nodes.price[0])
    before = [array.copy() for array in nodes]
    near = [np.array([c, (c + 1) % 6]) for c in range(6)]
    camera, last = np.array([2]), np.array([int(nodes.high[0, 2]) // 2])
    confine(gains, nodes, camera, 0 * last, last, np.array([False]), near, 0)
    assert nodes.bound[0] < before[0][0]
    far = [0, 1, 4, 5]
    for now, was in list(zip(nodes, before, strict=True))[1:3]:
        np.testing.assert_array_equal(now[0, far], was[0, far])
    seen = np.unique(
        np.concatenate([gains.sample[gains.offsets[c] : gains.offsets[c + 1]] for c in (2, 3)])
    )
    elsewhere = np.setdiff1d(np.arange(60), seen)
    np.testing.assert_array_equal(nodes.price[0, elsewhere], before[3][0, elsewhere])
    assert (nodes.price[0] != before[3][0]).any()


@pytest.mark.parametrize("threads", [1, 2])
def test_each_node_for_itself(threads):
    gains, random = gains_of(random_problem(4, 40, 6)), np.random.default_rng(1)
    near = random_near(gains, random)
    nodes, camera, first, last = random_nodes(gains, random, 6)
    wide = camera < 0
    alone = []
    for b in range(6):
        node = kernels.Nodes(*(array[b : b + 1].copy() for array in nodes))
        confine(gains, node, *(a[b : b + 1] for a in (camera, first, last, wide)), near, 0)
        alone.append(node)
    with_threads(threads, lambda: confine(gains, nodes, camera, first, last, wide, near, 0))
    for name in kernels.Nodes._fields:
        np.testing.assert_array_equal(
            getattr(nodes, name), np.concatenate([getattr(node, name) for node in alone])
        )


def test_steps_end_at_the_goal():
    gains = gains_of(random_problem(5, 60, 6))
    near, bounds = [np.arange(6)] * 6, []
    for goal in (int(0.9 * gains.most.sum()), 0):
        nodes, *_, first, last = random_nodes(gains, np.random.default_rng(0), 1)
        nodes.low[:], nodes.high[:] = reference.all_cells(gains)
        nodes.price[:] = 0
        nodes.bound[:] = reference.confined_bound(gains, nodes.price[0])
        root, wide = np.array([-1]), np.array([True])
        confine(gains, nodes, root, first, last, wide, near, goal, 1000)
        bounds.append((nodes.bound[0], goal))
    assert bounds[0][0] <= bounds[0][1]
    assert 0.8 * bounds[0][1] < bounds[0][0]
    assert bounds[1][0] < bounds[0][0]


def test_gains_are_sorted_by_sample():
    for seed in range(50):
        gains = gains_of(tiny_problem(seed))
        expected = by_sample(gains)
        found = kernels.GainsBySample(
            *(np.full_like(array, -1) for array in expected[:3]), gains.most
        )
        kernels.gains_by_sample(gains.by_camera, found)
        for array, other in zip(found, expected, strict=True):
            np.testing.assert_array_equal(array, other)
