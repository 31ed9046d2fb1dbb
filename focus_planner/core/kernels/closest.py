# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What is closest to each camera."""

from __future__ import annotations

import numpy as np
from numba import prange

from focus_planner.core.kernels.compiling import parallel_kernel


@parallel_kernel
def least_depths(camera_offsets, pairs, sample, depth, weights, least):
    """Fill ``least`` (C,) with the least depth of the samples of some weight that a camera sees.

    NaN where it sees none. ``pairs`` (P,) are the indices of each camera's pairs, from
    ``camera_offsets[c]`` on; ``sample`` and ``depth`` (P,) are those of the pairs.
    """
    for c in prange(len(least)):
        closest = np.inf
        for j in range(camera_offsets[c], camera_offsets[c + 1]):
            q = pairs[j]
            closest = min(closest, depth[q] if weights[sample[q]] > 0 else np.inf)
        least[c] = closest if closest < np.inf else np.nan
