# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Against the same in whole numbers, one by one; sums and bounds in test/core/bounds."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from focus_planner.core import kernels
from focus_planner.core.problem.gains import gains_of
from testing.problems import tiny_problem


def test_active_pairs_gain_more_than_what_is_within_reach():
    left_out = 0
    for seed in range(200):
        gains, random = gains_of(tiny_problem(seed)), np.random.default_rng(seed)
        price = (random.random(len(gains.most)) * gains.most).astype(np.int64)
        reach = gains.most // 8
        active = kernels.GainsByCamera(*(np.empty_like(array) for array in gains.by_camera))
        floor = np.zeros(len(gains.most), dtype=np.int64)
        kernels.activate(gains.by_camera, price, reach, active, floor, 1 + seed % 3)
        at, highest = 0, np.zeros_like(floor)
        for c in range(gains.camera_count):
            assert active[0][c] == at
            for j in range(gains.offsets[c], gains.offsets[c + 1]):
                p = gains.sample[j]
                if gains.gain[j] > price[p] - reach[p]:
                    assert [array[at] for array in active[1:]] == [
                        array[j] for array in gains.by_camera[1:]
                    ]
                    at += 1
                else:
                    highest[p] = max(highest[p], gains.gain[j])
                    left_out += 1
        assert active[0][-1] == at
        np.testing.assert_array_equal(floor, highest)
        assert (floor <= price).all()
    assert left_out > 100


@given(st.lists(st.lists(st.integers(0, 3), max_size=5), min_size=1, max_size=6))
def test_the_most_frequent_of_each_camera_the_first_of_equal_ones(chosen):
    offsets = np.cumsum([0] + [len(part) for part in chosen])
    flat = np.array([count for part in chosen for count in part], dtype=np.int64)
    cell = np.full(len(chosen), -7, dtype=np.int32)
    kernels.most_frequent(offsets, flat, cell)
    assert cell.tolist() == [part.index(max(part)) if part else -7 for part in chosen]
