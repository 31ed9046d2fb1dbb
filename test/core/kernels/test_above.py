# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A camera's best cell at given prices, against a sum for each of its cells."""

import numpy as np
import pytest

from focus_planner.core.kernels.above import room_above, take_best_cell
from focus_planner.core.kernels.arrays import GainsByCamera

CELLS, SAMPLES = 7, 9


def pairs_of_cameras(random, cameras, most):
    """Random pairs, of no sample twice in a camera; some cameras have none."""
    counts = random.integers(0, SAMPLES + 1, cameras)
    sample = [np.sort(random.permutation(SAMPLES)[:count]) for count in counts]
    total = int(counts.sum())
    ends = np.sort(random.integers(0, CELLS, (total, 2)), axis=1)
    return GainsByCamera(
        np.concatenate([[0], np.cumsum(counts)]),
        np.concatenate([*sample, []]).astype(np.int32),
        random.integers(1, most, total),
        *(np.ascontiguousarray(column, dtype=np.int32) for column in ends.T),
    )


def taken(pairs, c, cell, price):
    """The samples that a cell takes above their prices, and by how much."""
    return {
        int(pairs.sample[j]): int(pairs.gain[j] - price[pairs.sample[j]])
        for j in range(pairs.offsets[c], pairs.offsets[c + 1])
        if pairs.first[j] <= cell <= pairs.last[j] and pairs.gain[j] > price[pairs.sample[j]]
    }


@pytest.mark.parametrize("kind", [np.int32, np.float64])
def test_the_first_cell_that_takes_most_is_found_and_what_it_takes_counted(kind):
    random, blurred_counts = np.random.default_rng(4), 0
    for _ in range(300):
        cameras = 4
        gains = pairs_of_cameras(random, cameras, 40)
        blurred = pairs_of_cameras(random, cameras, 6)
        price = random.integers(0, 20, SAMPLES)
        above = room_above(2 * SAMPLES)  # shared by all cameras
        served, chosen = random.integers(-3, 3, SAMPLES).astype(kind), np.zeros(CELLS, np.int64)
        for c in range(cameras):
            fixed = random.integers(0, 15, CELLS)
            steps = np.diff(np.concatenate([[0], fixed, [0]]))
            expected, counted = served.copy(), chosen.copy()
            takings = [
                fixed[cell]
                + sum(taken(gains, c, cell, price).values())
                - sum(taken(blurred, c, cell, price).values())
                for cell in range(CELLS)
            ]
            cell = int(np.argmax(takings))
            expected[list(taken(gains, c, cell, price))] += 1
            less = list(taken(blurred, c, cell, price))
            expected[less] -= 1
            blurred_counts += len(less)
            counted[cell] += 1
            best = take_best_cell(c, gains, blurred, price, steps, above, chosen, served)
            # Less than nothing is no better than a camera that takes nothing at its first cell.
            if max(takings) >= 0:
                assert best == max(takings)
                assert (served == expected).all()
                assert (chosen == counted).all()
            else:
                served[:], chosen[:] = expected, counted
    assert blurred_counts > 50
