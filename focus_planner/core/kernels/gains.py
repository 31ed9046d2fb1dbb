# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What focus gains, pair by pair."""

from __future__ import annotations

from numba import prange

from focus_planner.core.kernels.compiling import parallel_kernel


@parallel_kernel
def most_gains(by_sample, focus, unseen, out, most):
    """Fill each sample's cost with all cameras out of focus, and the most that focus gains."""
    offsets, _, base, first, last = by_sample
    for p in prange(len(out)):
        low, high = offsets[p], offsets[p + 1]
        least = base[low] if low < high else unseen[p]
        sharp = least
        for q in range(low, high):
            least = min(least, base[q])
        least += focus[p] if low < high else 0
        sharp = least
        for q in range(low, high):
            if first[q] <= last[q]:
                sharp = min(sharp, base[q])
        out[p] = least
        most[p] = least - sharp


@parallel_kernel
def count_gains(by_camera, out, counts):
    """Fill ``counts`` (C,): how many of each camera's pairs gain anything from focus."""
    offsets, seen, base, first, last = by_camera
    for c in prange(len(counts)):
        count = 0
        for j in range(offsets[c], offsets[c + 1]):
            if first[j] <= last[j] and base[j] < out[seen[j]]:
                count += 1
        counts[c] = count


@parallel_kernel
def list_gains(by_camera, out, gains):
    """Fill the gains that :func:`count_gains` counted; their ``offsets`` are given."""
    pair_offsets, seen, base, first, last = by_camera
    offsets, sample, gain, gain_first, gain_last = gains
    for c in prange(len(offsets) - 1):
        at = offsets[c]
        for j in range(pair_offsets[c], pair_offsets[c + 1]):
            if first[j] <= last[j] and base[j] < out[seen[j]]:
                sample[at], gain_first[at], gain_last[at] = seen[j], first[j], last[j]
                gain[at] = out[seen[j]] - base[j]
                at += 1
