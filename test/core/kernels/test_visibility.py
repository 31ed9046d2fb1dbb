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

from focus_planner.core import kernels


def test_what_is_in_view_is_listed_and_no_more_than_there_is_room_for():
    random = np.random.default_rng(1)
    points = random.uniform(-2, 2, (300, 3))
    points = points[np.argsort(points[:, 2])] * [1, 1, 5]  # some blocks lie behind
    normals = random.normal(size=(300, 3))
    blocks = kernels.bound_blocks(points, normals)
    positions, rotations = random.uniform(-1, 1, (5, 3)), np.tile(np.eye(3), (5, 1, 1))
    frustums = np.tile([100.0, 100, 50, 40, 100, 80, 0.05], (5, 1))
    views = kernels.Views(positions, rotations, frustums)
    for facing in (False, True):
        most = kernels.count_near_view(blocks, len(points), views, facing)
        assert 0 < most.sum() < 5 * 300
        room = np.concatenate([[0], np.cumsum(most)])
        listed = np.full(room[-1], -1, dtype=np.int32)
        counts = kernels.list_in_view(points, normals, blocks, views, facing, room, listed)
        assert (counts <= most).all()
        for c in range(5):
            offset = points - positions[c]
            u, v = (100 * offset[:, :2] / offset[:, 2:]).T + [[50], [40]]
            expected = (offset[:, 2] > 0.05) & (u >= -0.5) & (u < 99.5) & (v >= -0.5) & (v < 79.5)
            if facing:
                expected &= (offset * normals).sum(axis=1) < 0
            np.testing.assert_array_equal(
                listed[room[c] : room[c] + counts[c]], np.flatnonzero(expected)
            )
        assert counts.sum() > 20
