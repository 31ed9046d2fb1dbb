# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Samples that stay with the cameras that they are assigned to, until all are assigned anew.

With scope "assigned", the paper's, a tuple's step hands its samples over among its own cameras
only. ``best`` (N, needed) are the cameras of each sample, each of another view.
"""

from __future__ import annotations

import numpy as np

from focus_planner.core.kernels.camera_tuples import NEVER
from focus_planner.core.kernels.compiling import kernel
from focus_planner.core.kernels.problem import UNSEEN
from focus_planner.core.kernels.solution import is_assigned


@kernel
def tick(state):
    """Begin a batch; return its number."""
    state.clock[0] += 1
    return state.clock[0]


@kernel
def serve(p, members, views, best, serves):
    """Fill which members may take sample p, and return how many of its views are theirs.

    A view that the sample is assigned to in a shot outside the tuple stays with that shot.
    """
    theirs = 0
    serves[:] = True
    for i in range(best.shape[1]):
        inside = False
        for c in members:
            if best[p, i] == c:
                inside = True
        if inside:
            theirs += 1
        elif best[p, i] != UNSEEN:
            for m in range(len(members)):
                if views.number[members[m]] == views.number[best[p, i]]:
                    serves[m] = False
    return theirs


@kernel
def hand_over(members, e, tuples, focus, views, state):
    """Assign those views of shared sample e that are the tuple's to the cheapest of its cameras."""
    p, cell, best = tuples.samples[e], state.cell, state.best
    serves = np.empty(len(members), dtype=np.bool_)
    if not serve(p, members, views, best, serves):
        return
    present = np.zeros(len(members), dtype=np.bool_)
    for m in range(len(members)):
        present[m] = is_assigned(p, members[m], best)
    for i in range(best.shape[1]):
        inside = False
        for c in members:
            if best[p, i] == c:
                inside = True
        if not inside:
            continue
        # Of equal cameras those that have it.
        least, which = 2 * NEVER, -1
        for m in range(len(members)):
            base = tuples.bases[e, m]
            if serves[m] and base < NEVER:
                held = tuples.firsts[e, m] <= cell[members[m]] <= tuples.lasts[e, m]
                cost = 2 * (base + (0 if held else focus[p])) + (0 if present[m] else 1)
                if cost < least:
                    least, which = cost, m
        best[p, i] = members[which]
        for m in range(len(members)):
            if views.number[members[m]] == views.number[members[which]]:
                serves[m] = False


@kernel
def reassign(by_sample, focus, views, state):
    """Assign every sample to its cheapest cameras (Eq. 5); return the gain in units.

    Of equal ones those that have it.
    """
    now, best = tick(state), state.best
    gain = np.int64(0)
    chosen, keys = np.empty(best.shape[1], np.int32), np.empty(best.shape[1], np.int64)
    for p in range(len(best)):
        before = _cost_as_assigned(p, by_sample, focus, views, state)
        after = _choose(p, by_sample, focus, views, state, chosen, keys)
        if after == before:
            continue
        gain += before - after
        for i in range(len(chosen)):
            for c in (best[p, i], chosen[i]):
                if c != UNSEEN:
                    state.touched[c], state.summed[c] = now, 0
        best[p] = chosen
    return gain


@kernel
def _cost_as_assigned(p, by_sample, focus, views, state):
    """Return what sample p costs in the cameras that it is assigned to."""
    offsets, camera, base, first, last = by_sample
    total = views.needed * views.missing[p]
    for q in range(offsets[p], offsets[p + 1]):
        if is_assigned(p, camera[q], state.best):
            held = first[q] <= state.cell[camera[q]] <= last[q]
            total += base[q] + (0 if held else focus[p]) - views.missing[p]
    return total


@kernel
def _choose(p, by_sample, focus, views, state, chosen, keys):
    """Fill sample p's cheapest cameras, each of another view; return what it costs in them."""
    offsets, camera, base, first, last = by_sample
    chosen[:] = UNSEEN
    keys[:] = 2 * views.missing[p] + 2
    q, high = offsets[p], offsets[p + 1]
    while q < high:
        view, least, which = views.number[camera[q]], 4 * NEVER, UNSEEN
        while q < high and views.number[camera[q]] == view:
            c = camera[q]
            held = first[q] <= state.cell[c] <= last[q]
            key = 2 * (base[q] + (0 if held else focus[p]))
            key += 0 if is_assigned(p, c, state.best) else 1
            if key < least:
                least, which = key, c
            q += 1
        at = len(keys)
        while at > 0 and least < keys[at - 1]:
            at -= 1
            if at + 1 < len(keys):
                keys[at + 1], chosen[at + 1] = keys[at], chosen[at]
        if at < len(keys):
            keys[at], chosen[at] = least, which
    total = np.int64(0)
    for i in range(len(keys)):
        total += views.missing[p] if chosen[i] == UNSEEN else keys[i] >> 1
    return total
