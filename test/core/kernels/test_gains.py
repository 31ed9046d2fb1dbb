# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Against the same in whole numbers, one by one."""

import numpy as np

from focus_planner.core.problem.gains import gains_of
from testing.problems import tiny_problem


def test_gains_are_counted_and_listed_camera_by_camera():
    for seed in range(200):
        problem = tiny_problem(seed)
        cells, gains = problem.cells, gains_of(problem)
        out = [int(unseen) for unseen in cells.unseen]
        sharp = list(out)
        pairs = {c: [] for c in range(problem.camera_count)}
        for p in range(problem.sample_count):
            seen = range(problem.sample_offsets[p], problem.sample_offsets[p + 1])
            if seen:
                out[p] = min(int(cells.base[q]) for q in seen) + int(cells.focus[p])
                sharp[p] = out[p]
            for q in seen:
                if cells.first[q] <= cells.last[q] and cells.base[q] < out[p]:
                    sharp[p] = min(sharp[p], int(cells.base[q]))
                    pair = (p, out[p] - cells.base[q], cells.first[q], cells.last[q])
                    pairs[problem.camera_index[q]].append(pair)
        assert gains.out == sum(out)
        np.testing.assert_array_equal(gains.most, np.subtract(out, sharp))
        counts = [len(pairs[c]) for c in range(problem.camera_count)]
        np.testing.assert_array_equal(np.diff(gains.offsets), counts)
        listed = zip(gains.sample, gains.gain, gains.first, gains.last, strict=True)
        assert list(listed) == [pair for c in pairs for pair in pairs[c]]
