# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The best joint step of three cameras: for each cell of the third, the best pair of the others."""

from __future__ import annotations

import numpy as np

from focus_planner.core.kernels.compiling import kernel
from focus_planner.core.kernels.pairs import best_pair


@kernel
def list_rectangles(shared, step):
    """List the rectangles, and the samples that the third camera may gain; return their numbers."""
    firsts, lasts = shared.firsts, shared.lasts
    costs, third = step.costs, step.third
    triple, count, thirds = costs.shape[1] == 8, 0, 0
    for e in range(len(costs)):
        if costs[e, 0] < 0:
            continue
        if triple and firsts[e, 2] <= lasts[e, 2] and costs[e, 4] < costs[e, 0]:
            third[thirds] = e
            thirds += 1
        else:
            count = _add_rectangle(
                firsts[e], lasts[e], costs[e, :4], step.rectangles, step.weights, count
            )
    return count, thirds


@kernel
def best_triple(shared, step, count, thirds, start_a, start_b, now, move):
    """Find the best cells of three cameras, if they gain more than ``now``; return their gain.

    For each cell of the third camera, the best pair of the others.
    """
    steps, begin = step.steps, step.begin
    gain_c = np.cumsum(steps[begin[2] : begin[3] - 1])
    bound = np.cumsum(steps[begin[0] : begin[1] - 1]).max()
    bound += np.cumsum(steps[begin[1] : begin[2] - 1]).max()
    found = now
    for i_c in range(len(gain_c)):
        # Cameras gain together at most the sum of what each gains.
        if gain_c[i_c] + bound <= found:
            continue
        pair = steps[: begin[2]].copy()
        rectangles = np.empty((count + thirds, 4), dtype=np.int32)
        rectangles[:count] = step.rectangles[:count]
        weights = np.empty(count + thirds, dtype=np.int64)
        weights[:count] = step.weights[:count]
        total = _add_thirds(i_c, shared, step, thirds, pair, rectangles, weights, count)
        gain, i, j = best_pair(
            np.cumsum(pair[: begin[1] - 1]),
            np.cumsum(pair[begin[1] : begin[2] - 1]),
            rectangles,
            weights,
            total,
            start_a,
            start_b,
            found - gain_c[i_c],
        )
        if i >= 0:
            found = gain + gain_c[i_c]
            move[0], move[1], move[2] = i, j, i_c
    return found


@kernel
def _add_thirds(i_c, shared, step, thirds, steps, rectangles, weights, count):
    """Add the rectangles of the samples that the third camera may gain, at its cell ``i_c``.

    Of what that cell holds the two others gain less, and their ``steps`` are corrected. Returns the
    number of rectangles.
    """
    firsts, lasts = shared.firsts, shared.lasts
    third, begin = step.third, step.begin
    for n in range(thirds):
        e = third[n]
        costs = step.costs[e, :4]
        if firsts[e, 2] <= i_c <= lasts[e, 2]:
            costs = step.costs[e, 4:]
            for m in range(2):
                first, last = firsts[e, m], lasts[e, m]
                if first <= last:
                    alone = step.costs[e, 0] - step.costs[e, 1 << m]
                    change = costs[0] - costs[1 << m] - alone
                    steps[begin[m] + first] += change
                    steps[begin[m] + last + 1] -= change
        count = _add_rectangle(firsts[e], lasts[e], costs, rectangles, weights, count)
    return count


@kernel
def _add_rectangle(firsts, lasts, costs, rectangles, weights, count):
    """Add the cells of the first two cameras that both hold a sample, if they share its gain.

    Returns the number of rectangles.
    """
    weight = costs[0] - costs[1] - costs[2] + costs[3]
    if weight <= 0 or firsts[0] > lasts[0] or firsts[1] > lasts[1]:
        return count
    rectangles[count, 0], rectangles[count, 1] = firsts[0], lasts[0]
    rectangles[count, 2], rectangles[count, 3] = firsts[1], lasts[1]
    weights[count] = weight
    return count + 1
