# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A camera's best cell at given prices, from those of its pairs that gain more than them.

These are copied to where they lie together: the rest is passed over once only, without branches,
which would be mispredicted half the time.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from focus_planner.core.arrays import IntArray, Offsets
from focus_planner.core.kernels.compiling import kernel


class Above(NamedTuple):
    """Pairs that gain more than their prices: samples, first and last cells, and ``by`` how much.

    Where pairs have numbers of prices instead of samples, so do these.
    """

    sample: IntArray
    first: IntArray
    last: IntArray
    by: Offsets


@kernel
def room_above(pairs):
    """Return room for so many pairs, and one more."""
    return Above(
        np.empty(pairs + 1, dtype=np.int32),
        np.empty(pairs + 1, dtype=np.int32),
        np.empty(pairs + 1, dtype=np.int32),
        np.empty(pairs + 1, dtype=np.int64),
    )


@kernel
def _list_above(c, pairs, price, at, above):
    """List camera c's pairs that gain more than their prices, from a place on; return its end."""
    begin, end = pairs.offsets[c], pairs.offsets[c + 1]
    sample, gain = pairs.sample[begin:end], pairs.gain[begin:end]
    first, last = pairs.first[begin:end], pairs.last[begin:end]
    for j in range(len(gain)):
        more = gain[j] - price[sample[j]]
        above.sample[at], above.first[at], above.last[at] = sample[j], first[j], last[j]
        above.by[at] = more
        at += more > 0
    return at


@kernel
def take_best_cell(c, gains, blurred, price, steps, above, chosen, served):
    """Find camera c's best cell, count it and the samples it takes, and return how much it takes.

    Parameters
    ----------
    gains, blurred : GainsByCamera
        What pairs gain in focus, and what out of it.
    price : array of int64
    steps : array of int64
        What else its cells take, as differences from cell to cell, one longer than the cells;
        what its pairs take is added.
    above : Above
        Scratch, with room for all of a camera's pairs.
    chosen : array of int64
        One more for that cell.
    served : array of int32 or float64
        One more for each sample taken in focus, one less for what would be taken out of it.
    """
    count = _list_above(c, gains, price, 0, above)
    end = _list_above(c, blurred, price, count, above)
    sample, first, last, by = above
    for n in range(count):
        steps[first[n]] += by[n]
        steps[last[n] + 1] -= by[n]
    for n in range(count, end):
        steps[first[n]] -= by[n]
        steps[last[n] + 1] += by[n]
    best, cell, total = np.int64(-1), 0, np.int64(0)
    for i in range(len(steps) - 1):
        total += steps[i]
        if total > best:
            best, cell = total, i
    chosen[cell] += 1
    for n in range(count):
        served[sample[n]] += (first[n] <= cell) & (cell <= last[n])
    for n in range(count, end):
        served[sample[n]] -= (first[n] <= cell) & (cell <= last[n])
    return best
