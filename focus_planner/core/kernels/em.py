# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Each camera's best cell for the samples assigned to it: weighted interval stabbing."""

from __future__ import annotations

import numpy as np
from numba import prange

from focus_planner.core.kernels.compiling import parallel_kernel
from focus_planner.core.kernels.solution import is_assigned


@parallel_kernel
def stab(by_camera, focus, cell_offsets, best, cell):
    """Move each camera to the cell that holds most of its samples' weight in focus (Eq. 8).

    Camera c's samples are those with it in ``best`` (N, needed). Ties go to the cell that holds
    most of everything the camera sees, which the next assignment may profit from; without a better
    cell a camera stays. Two prefix sums per camera. Returns how many cameras moved.
    """
    offsets, seen, _, first, last = by_camera
    moved = 0
    for c in prange(len(offsets) - 1):
        count = cell_offsets[c + 1] - cell_offsets[c]
        if count > 0:
            own, all_seen = np.zeros((2, count + 1), dtype=np.int64)
            for j in range(offsets[c], offsets[c + 1]):
                if first[j] <= last[j]:
                    p = seen[j]
                    all_seen[first[j]] += focus[p]
                    all_seen[last[j] + 1] -= focus[p]
                    if is_assigned(p, c, best):
                        own[first[j]] += focus[p]
                        own[last[j] + 1] -= focus[p]
            own, all_seen = np.cumsum(own[:-1]), np.cumsum(all_seen[:-1])
            where = cell[c]
            for i in range(count):
                if own[i] > own[where] or (own[i] == own[where] and all_seen[i] > all_seen[where]):
                    where = i
            if where != cell[c]:
                cell[c] = where
                moved += 1
    return moved
