# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Where numbers stand among others that are sorted."""

from __future__ import annotations

import numpy as np

from focus_planner.core.kernels.compiling import kernel


@kernel
def _bucket(value, low, scale, count):
    """Return the bucket that a value falls into: never a later one than a larger value's."""
    place = (value - low) * scale
    if not place > 0:
        return 0
    return count - 1 if place >= count - 1 else np.int64(place)


@kernel
def _buckets(ascending, count):
    """Return where each bucket's numbers begin, (count + 1,), and what tells a value's bucket."""
    low, high = np.inf, -np.inf
    for value in ascending:
        if np.isfinite(value):
            low, high = min(low, value), max(high, value)
    scale = np.divide(count, high - low) if high > low else 0.0
    low = low if np.isfinite(low) else 0.0
    begins = np.zeros(count + 1, dtype=np.int64)
    for value in ascending:
        begins[_bucket(value, low, scale, count) + 1] += 1
    for b in range(count):
        begins[b + 1] += begins[b]
    return begins, low, scale


@kernel
def ranks_among(ascending, values, equal, ranks):
    """Fill how many numbers are below each value, or not above it if ``equal``.

    Each value is looked for in its bucket only, of which there are twice as many as numbers.
    """
    count = 2 * len(ascending) + 1
    begins, least, scale = _buckets(ascending, count)
    for j in range(len(values)):
        value = values[j]
        b = _bucket(value, least, scale, count)
        low, high = begins[b], begins[b + 1]
        while low < high:
            middle = (low + high) >> 1
            if ascending[middle] < value or (equal and ascending[middle] == value):
                low = middle + 1
            else:
                high = middle
        ranks[j] = low
