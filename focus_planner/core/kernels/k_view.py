# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Exact joint steps of two or three cameras (paper, Sec. 3.4; docs/algorithm.md).

While the cameras of a tuple move, all others stand still. A sample then costs m, its least cost
with every camera of the tuple out of focus, less the gain of the best camera that holds it in
focus: for camera a that is g_a = max(0, m − base cost of a). With two cameras the gains add
up to a function of a's cell, plus a function of b's cell, less min(g_a, g_b) on the rectangle of
cells where both hold the sample: what :func:`best_pair` maximises. A third camera is an outer
loop over its cells: where it holds a sample in focus, m is at most its base cost.

A sample that only one camera of the tuple sees adds to that camera's function alone, the same
whichever the tuple. ``steps`` keeps these functions per camera, as differences from cell to
cell, and a tuple costs only what its cameras share.

With scope "all" (``ranking`` not empty) a sample may also be assigned to its cheapest camera
outside the tuple, which stands still; with scope "assigned" the tuple's samples stay with it.

A sample's ``ranking`` (N, k + 1) holds its cheapest cameras as keys, the cost in units above the
camera's number: keys sort by cost, ties by number, and fit a cache line.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import prange

from focus_planner.core.arrays import IntArray, Offsets
from focus_planner.core.kernels.camera_tuples import NEVER
from focus_planner.core.kernels.compiling import kernel, parallel_kernel
from focus_planner.core.kernels.pairs import best_pair
from focus_planner.core.kernels.problem import UNSEEN

#: A ranking's keys hold the camera's number in so many bits.
CAMERA_BITS = 18
_CAMERA = 2**CAMERA_BITS - 1
_NOBODY = (NEVER << CAMERA_BITS) | _CAMERA


class DescentState(NamedTuple):
    """Where a descent stands; the kernels change its arrays.

    Attributes
    ----------
    cell : (C,) array of int32
        Each camera's cell.
    ranking : (N, k + 1) array of int64
        The cheapest cameras of each sample as keys, ascending; no rows with scope "assigned".
    best : (N,) array of int32
        The camera that each sample is assigned to; kept up to date with scope "assigned" only.
    steps : (M + C,) array of int64
        What each camera gains alone, as differences from cell to cell; a camera's part is one
        longer than its cells.
    touched, summed : (C,) arrays of int64
        When what surrounds a camera last changed, and when its ``steps`` were last summed.
    solved : (T,) array of int64
        When each tuple's best step was last taken.
    clock : (1,) array of int64
        Counts batches.
    """

    cell: IntArray
    ranking: Offsets
    best: IntArray
    steps: Offsets
    touched: Offsets
    summed: Offsets
    solved: Offsets
    clock: Offsets


class _Shared(NamedTuple):
    """One tuple's shared samples; see :class:`CameraTuples`."""

    samples: IntArray
    bases: Offsets
    firsts: IntArray
    lasts: IntArray


class _Step(NamedTuple):
    """The problem of one tuple's best step.

    Member m's ``steps`` begin at ``begin[m]``; ``out`` is what each shared sample costs with all
    members out of focus, -1 if it is not the tuple's to re-assign. ``rectangles`` and ``weights``
    are as :func:`best_pair` takes them; ``third`` are the shared samples that the third camera may
    gain.
    """

    steps: Offsets
    begin: Offsets
    out: Offsets
    rectangles: IntArray
    weights: Offsets
    third: IntArray


@kernel
def _gain(least, base):
    return max(least - base, np.int64(0))


@kernel
def _alone(ranking, best, p, c, base, focus):
    """Return what camera c gains from holding sample p in focus, all other cameras fixed."""
    if len(ranking) == 0:
        return focus if best[p] == c else np.int64(0)
    other = ranking[p, 0]
    if other & _CAMERA == c:
        other = ranking[p, 1]
    return _gain(min(other >> CAMERA_BITS, base + focus), base)


@kernel
def _outside(ranking, p, members):
    """Return the least cost of sample p over all cameras but the members; NEVER if no ranking."""
    for i in range(ranking.shape[1] if len(ranking) > 0 else 0):
        camera = ranking[p, i] & _CAMERA
        outside = True
        for c in members:
            if camera == c:
                outside = False
        if outside:
            return ranking[p, i] >> CAMERA_BITS
    return NEVER


@kernel
def _rank(p, by_sample, focus, cell, ranking):
    """Fill sample p's cheapest cameras, ascending."""
    offsets, camera, base, first, last = by_sample
    ranks = ranking.shape[1]
    for i in range(ranks):
        ranking[p, i] = _NOBODY
    for q in range(offsets[p], offsets[p + 1]):
        c = camera[q]
        cost = base[q]
        if cell[c] < first[q] or cell[c] > last[q]:
            cost += focus[p]
        key = (cost << CAMERA_BITS) | c
        if key < ranking[p, ranks - 1]:
            i = ranks - 1
            while i > 0 and key < ranking[p, i - 1]:
                ranking[p, i] = ranking[p, i - 1]
                i -= 1
            ranking[p, i] = key


@parallel_kernel
def rank_cameras(by_sample, focus, cell, ranking):
    """Fill every sample's ranking (N, k + 1) at these cells."""
    for p in prange(len(ranking)):
        _rank(p, by_sample, focus, cell, ranking)


@kernel
def _sum_steps(c, by_camera, focus, cell_offsets, state):
    """Fill camera c's ``steps`` from its pairs."""
    offsets, seen, base, first, last = by_camera
    ranking, best = state.ranking, state.best
    steps = state.steps[cell_offsets[c] + c : cell_offsets[c + 1] + c + 1]
    steps[:] = 0
    for j in range(offsets[c], offsets[c + 1]):
        if first[j] <= last[j]:
            p = seen[j]
            gain = _alone(ranking, best, p, c, base[j], focus[p])
            steps[first[j]] += gain
            steps[last[j] + 1] -= gain


@parallel_kernel
def improve_tuples(tuples, low, high, by_camera, by_sample, focus, cell_offsets, state):
    """Take every tuple's exact best step, batch by batch; return the gain in units.

    The tuples of one batch do not influence each other: none reads what another writes, so they
    run at once. A tuple around which nothing has changed since it was last solved is skipped.

    Parameters
    ----------
    tuples : CameraTuples
    low, high : int
        The first batch, and the one after the last.
    by_camera : PairsByCamera
    by_sample : PairsBySample
    focus : (N,) array of int64
        What each sample costs more out of focus, units.
    cell_offsets : (C + 1,) array of int64
    state : DescentState
    """
    total = np.int64(0)
    for batch in range(low, high):
        begin = tuples.batch_offsets[batch]
        count = tuples.batch_offsets[batch + 1] - begin
        now = _tick(state)
        gains = np.zeros(count, dtype=np.int64)
        for slot in prange(count):
            gains[slot] = _improve(
                begin + slot, now, tuples, by_camera, by_sample, focus, cell_offsets, state
            )
        total += gains.sum()
    return total


@kernel
def _tick(state):
    """Begin a batch; return its number."""
    state.clock[0] += 1
    return state.clock[0]


@kernel
def _improve(t, now, tuples, by_camera, by_sample, focus, cell_offsets, state):
    """Take tuple t's best step if anything around it has changed; return the gain."""
    members, touched, summed = tuples.cameras[t], state.touched, state.summed
    stale = False
    for c in members:
        if touched[c] > state.solved[t]:
            stale = True
    if not stale:
        return np.int64(0)
    state.solved[t] = now
    for c in members:
        if touched[c] > summed[c]:
            summed[c] = now
            _sum_steps(c, by_camera, focus, cell_offsets, state)
    move = np.empty(len(members), dtype=np.int32)
    gain = _solve(t, tuples, focus, cell_offsets, state, move)
    if gain > 0 and len(state.ranking) == 0:
        for m in range(len(members)):
            c = members[m]
            state.cell[c] = move[m]
            touched[c], summed[c] = now, 0
        for e in range(tuples.shared_offsets[t], tuples.shared_offsets[t + 1]):
            _hand_over(members, e, tuples, focus, state)
    elif gain > 0:
        for m in range(len(members)):
            _move(members[m], move[m], now, by_camera, by_sample, focus, state)
    return gain


@kernel
def _move(c, to, now, by_camera, by_sample, focus, state):
    """Move camera c to a cell; keep the rankings of the samples that it gains or loses."""
    offsets, seen, base, first, last = by_camera
    was, state.cell[c] = state.cell[c], to
    for j in range(offsets[c], offsets[c + 1]):
        held = first[j] <= was <= last[j]
        holds = first[j] <= to <= last[j]
        if held != holds:
            p = seen[j]
            cost = base[j] + (0 if holds else focus[p])
            _move_in_ranking(p, c, cost, now, by_sample, focus, state)


@kernel
def _move_in_ranking(p, c, cost, now, by_sample, focus, state):
    """Give camera c its new cost in sample p's ranking; touch the cameras that see p.

    The sample's other cameras are looked at only where c leaves a gap that one of them may fill.
    """
    ranking = state.ranking
    ranks = ranking.shape[1]
    key = (cost << CAMERA_BITS) | c
    worst = ranking[p, ranks - 1]
    at = 0
    while at < ranks and ranking[p, at] & _CAMERA != c:
        at += 1
    if at == ranks:
        if key >= worst:
            return
        at = ranks - 1
    elif key > worst:
        _rank(p, by_sample, focus, state.cell, ranking)
        at = -1
    if at >= 0:
        while at > 0 and key < ranking[p, at - 1]:
            ranking[p, at] = ranking[p, at - 1]
            at -= 1
        while at < ranks - 1 and key > ranking[p, at + 1]:
            ranking[p, at] = ranking[p, at + 1]
            at += 1
        ranking[p, at] = key
    offsets, camera, touched, summed = (
        by_sample.offsets,
        by_sample.camera,
        state.touched,
        state.summed,
    )
    for q in range(offsets[p], offsets[p + 1]):
        touched[camera[q]], summed[camera[q]] = now, 0


@kernel
def _hand_over(members, e, tuples, focus, state):
    """Assign shared sample e, if it is one of the tuple's, to the cheapest of its cameras."""
    p, cell, best = tuples.samples[e], state.cell, state.best
    least, which, owner = NEVER, -1, -1
    for m in range(len(members)):
        c = members[m]
        if best[p] == c:
            owner = m
        base = tuples.bases[e, m]
        if base < NEVER:
            held = tuples.firsts[e, m] <= cell[c] <= tuples.lasts[e, m]
            cost = base + (0 if held else focus[p])
            # Of equal cameras the present one.
            if cost < least or (cost == least and best[p] == c):
                least, which = cost, m
    if owner >= 0:
        best[p] = members[which]


@kernel
def _solve(t, tuples, focus, cell_offsets, state, move):
    """Find tuple t's best cells; return their gain over the present ones, 0 if none.

    Fills ``move`` (k,) where there is a gain.
    """
    members = tuples.cameras[t]
    part = slice(tuples.shared_offsets[t], tuples.shared_offsets[t + 1])
    shared = _Shared(
        tuples.samples[part], tuples.bases[part], tuples.firsts[part], tuples.lasts[part]
    )
    step, now = _copy_steps(members, len(shared.samples), cell_offsets, state)
    now += _correct_steps(members, shared, focus, state, step)
    count, thirds = _list_rectangles(shared, step)
    start_a, start_b = np.int64(state.cell[members[0]]), np.int64(state.cell[members[1]])
    if len(members) == 3:
        return _best_triple(shared, step, count, thirds, start_a, start_b, now, move) - now
    begin, steps = step.begin, step.steps
    gain, i, j = best_pair(
        np.cumsum(steps[begin[0] : begin[1] - 1]),
        np.cumsum(steps[begin[1] : begin[2] - 1]),
        step.rectangles,
        step.weights,
        count,
        start_a,
        start_b,
        now,
    )
    if i >= 0:
        move[0], move[1] = i, j
    return gain - now


@kernel
def _copy_steps(members, count, cell_offsets, state):
    """Return room for a step with the members' own sums, and what they gain alone now."""
    k, now = len(members), np.int64(0)
    begin = np.zeros(k + 1, dtype=np.int64)
    for m in range(k):
        c = members[m]
        begin[m + 1] = begin[m] + cell_offsets[c + 1] - cell_offsets[c] + 1
    steps = np.empty(begin[k], dtype=np.int64)
    for m in range(k):
        c = members[m]
        own = steps[begin[m] : begin[m + 1]]
        own[:] = state.steps[cell_offsets[c] + c : cell_offsets[c + 1] + c + 1]
        now += own[: state.cell[c] + 1].sum()
    step = _Step(
        steps,
        begin,
        np.empty(count, dtype=np.int64),
        np.empty((count, 4), dtype=np.int32),
        np.empty(count, dtype=np.int64),
        np.empty(count if k == 3 else 0, dtype=np.int32),
    )
    return step, now


@kernel
def _correct_steps(members, shared, focus, state, step):
    """Correct the members' sums where they share samples, and fill what those cost without them.

    Returns the change of what the tuple gains now.
    """
    ranking, best, cell = state.ranking, state.best, state.cell
    samples, bases, firsts, lasts = shared
    steps, begin, outs = step.steps, step.begin, step.out
    change = np.int64(0)
    for e in range(len(samples)):
        p = samples[e]
        cheapest = ranking[p, 0] & _CAMERA if len(ranking) > 0 else best[p]
        ours = False
        for c in members:
            if c == cheapest:
                ours = True
        if not ours:
            # With scope "all" a camera outside the tuple is cheapest, in or out of focus: it sets
            # the cost without the tuple, for each camera alone as for all together, and none of
            # them gains now.
            outs[e] = ranking[p, 0] >> CAMERA_BITS if len(ranking) > 0 else -1
            continue
        out = _outside(ranking, p, members)
        for m in range(len(members)):
            out = min(out, bases[e, m] + focus[p])
        outs[e], least = out, out
        for m in range(len(members)):
            base, first, last = bases[e, m], firsts[e, m], lasts[e, m]
            if first > last:
                continue
            alone = _alone(ranking, best, p, members[m], base, focus[p])
            if first <= cell[members[m]] <= last:
                change -= alone
                least = min(least, base)
            more = _gain(out, base) - alone
            if more != 0:
                steps[begin[m] + first] += more
                steps[begin[m] + last + 1] -= more
        change += out - least
    return change


@kernel
def _list_rectangles(shared, step):
    """List the rectangles, and the samples that the third camera may gain; return their numbers."""
    bases, firsts, lasts = shared.bases, shared.firsts, shared.lasts
    out, rectangles, weights, third = step.out, step.rectangles, step.weights, step.third
    triple, count, thirds = bases.shape[1] == 3, 0, 0
    for e in range(len(out)):
        if out[e] < 0:
            continue
        if triple and firsts[e, 2] <= lasts[e, 2] and bases[e, 2] < out[e]:
            third[thirds] = e
            thirds += 1
        else:
            count = _add_rectangle(
                bases[e], firsts[e], lasts[e], out[e], rectangles, weights, count
            )
    return count, thirds


@kernel
def _best_triple(shared, step, count, thirds, start_a, start_b, now, move):
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

    What that cell holds costs no more than with the third camera; the two others gain as much
    less, and their ``steps`` are corrected. Returns the number of rectangles.
    """
    bases, firsts, lasts = shared.bases, shared.firsts, shared.lasts
    third, outs, begin = step.third, step.out, step.begin
    for n in range(thirds):
        e = third[n]
        out = outs[e]
        if firsts[e, 2] <= i_c <= lasts[e, 2]:
            out = bases[e, 2]
            for m in range(2):
                base, first, last = bases[e, m], firsts[e, m], lasts[e, m]
                if first <= last:
                    change = _gain(out, base) - _gain(outs[e], base)
                    steps[begin[m] + first] += change
                    steps[begin[m] + last + 1] -= change
        count = _add_rectangle(bases[e], firsts[e], lasts[e], out, rectangles, weights, count)
    return count


@kernel
def _add_rectangle(bases, firsts, lasts, out, rectangles, weights, count):
    """Add the cells of the first two cameras that both hold a sample, if both gain by it.

    Returns the number of rectangles.
    """
    weight = out - max(bases[0], bases[1])
    if weight <= 0 or firsts[0] > lasts[0] or firsts[1] > lasts[1]:
        return count
    rectangles[count, 0], rectangles[count, 1] = firsts[0], lasts[0]
    rectangles[count, 2], rectangles[count, 3] = firsts[1], lasts[1]
    weights[count] = weight
    return count + 1


@kernel
def reassign(by_sample, focus, state):
    """Assign every sample to its cheapest camera (Eq. 5); return the gain in units."""
    offsets, camera, base, first, last = by_sample
    now, cell, best = _tick(state), state.cell, state.best
    gain = np.int64(0)
    for p in range(len(best)):
        if best[p] == UNSEEN:
            continue
        least, which, present = NEVER, UNSEEN, NEVER
        for q in range(offsets[p], offsets[p + 1]):
            c = camera[q]
            cost = base[q] + (0 if first[q] <= cell[c] <= last[q] else focus[p])
            if c == best[p]:
                present = cost
            if cost < least:
                least, which = cost, c
        if least < present:
            gain += present - least
            state.touched[best[p]], state.touched[which] = now, now
            state.summed[best[p]], state.summed[which] = 0, 0
            best[p] = which
    return gain
