# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What samples cost that need one view each: the short path of :mod:`.problem`."""

from __future__ import annotations

import numpy as np
from numba import prange

from focus_planner.core.kernels.compiling import parallel_kernel
from focus_planner.core.kernels.problem import UNSEEN, UNTAKEN


@parallel_kernel
def best_camera(pairs, focus, costs, best):
    """Fill ``costs`` and ``best`` (N,) as ``best_cameras`` does for one view each."""
    offsets, camera, base, near, far, weight = pairs
    for p in prange(len(costs)):
        least, which = np.inf, UNSEEN
        for q in range(offsets[p], offsets[p + 1]):
            s = focus[camera[q]]
            held = (near[q] <= s) & (s <= far[q])  # not where s is NaN
            cost = base[q] if held else base[q] + weight
            if (cost < least) & (s != UNTAKEN):
                least, which = cost, camera[q]
        costs[p] = 1.0 if which == UNSEEN else least
        best[p] = which
