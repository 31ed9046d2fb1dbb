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

While the cameras of a tuple move, all others stand still. A sample's cost then depends only on
which of the tuple's cameras hold it in focus: ``costs`` (L, 2^k) has it for every set of them, as
the bits of the index. With none it is costs[0]; camera a alone gains costs[0] − costs[a], and the
sum of the least costs of several views being submodular, a and b together gain no more than the sum
of what each gains. So with two cameras the gains add up to a function of a's cell, plus a function
of b's cell, less the difference on the rectangle of cells where both hold the sample: what
:func:`best_pair` maximises. A third camera is an outer loop over its cells: what it holds has the
costs with its bit.

A sample that only one camera of the tuple sees adds to that camera's function alone, the same
whichever the tuple. ``steps`` keeps these functions per camera, as differences from cell to
cell, and a tuple costs only what its cameras share.

With scope "all" (``ranking`` not empty) a sample may also be assigned to its cheapest views outside
the tuple, which stand still; with scope "assigned" the tuple's samples stay with it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import prange

from focus_planner.core.arrays import IntArray, Offsets
from focus_planner.core.kernels.arrays import JointStep, SharedSamples
from focus_planner.core.kernels.assigned import hand_over, serve, tick
from focus_planner.core.kernels.compiling import kernel, parallel_kernel
from focus_planner.core.kernels.joint_costs import costs_of_three, costs_of_two, held_outside
from focus_planner.core.kernels.pairs import best_pair
from focus_planner.core.kernels.ranking import (
    NO_CHOICE,
    VIEW,
    VIEW_BITS,
    held_by_another,
    least_beside,
    rerank,
    sums_beside,
)
from focus_planner.core.kernels.solution import is_assigned
from focus_planner.core.kernels.triples import best_triple, list_rectangles


class DescentState(NamedTuple):
    """Where a descent stands; the kernels change its arrays.

    Attributes
    ----------
    cell : (C,) array of int32
        Each camera's cell.
    ranking : (N, needed + k) array of int64
        The cheapest views of each sample, see ``ranking.py``; no rows with scope "assigned".
    best : (N, needed) array of int32
        The cameras that each sample is assigned to, each of another view; kept up to date with
        scope "assigned" only.
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


@kernel
def _alone(p, c, base, first, last, focus, views, state):
    """Return what camera c gains from holding sample p in focus, all other cameras fixed."""
    if len(state.ranking) == 0:
        return focus if is_assigned(p, c, state.best) else np.int64(0)
    view = views.number[c]
    if held_by_another(c, view, first, last, views, state.cell):
        return np.int64(0)
    other = least_beside(p, view, views, state.ranking)
    return max(min(other, base + focus) - base, np.int64(0))


@kernel
def _is_plain(views, state):
    """Return whether one view is enough, each camera is one, and samples may go to any."""
    return (
        views.needed == 1 and len(views.offsets) == len(views.number) + 1 and len(state.ranking) > 0
    )


@kernel
def _alone_in_one_view(p, c, base, focus, ranking):
    """Return what :func:`_alone` does where :func:`_is_plain`."""
    first = ranking[p, 0]
    other = ranking[p, 1] if first & VIEW == c else first
    return max(min(other >> VIEW_BITS, base + focus) - base, np.int64(0))


@kernel
def _sum_steps(c, by_camera, focus, views, cell_offsets, state):
    """Fill camera c's ``steps`` from its pairs."""
    offsets, seen, base, first, last = by_camera
    steps = state.steps[cell_offsets[c] + c : cell_offsets[c + 1] + c + 1]
    steps[:] = 0
    if _is_plain(views, state):
        for j in range(offsets[c], offsets[c + 1]):
            gain = _alone_in_one_view(seen[j], c, base[j], focus[seen[j]], state.ranking)
            if gain > 0 and first[j] <= last[j]:
                steps[first[j]] += gain
                steps[last[j] + 1] -= gain
        return
    for j in range(offsets[c], offsets[c + 1]):
        if first[j] <= last[j]:
            p = seen[j]
            gain = _alone(p, c, base[j], first[j], last[j], focus[p], views, state)
            steps[first[j]] += gain
            steps[last[j] + 1] -= gain


@parallel_kernel
def improve_tuples(tuples, low, high, by_camera, by_sample, focus, views, cell_offsets, state):
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
    views : CameraViews
    cell_offsets : (C + 1,) array of int64
    state : DescentState
    """
    total = np.int64(0)
    for batch in range(low, high):
        begin = tuples.batch_offsets[batch]
        count = tuples.batch_offsets[batch + 1] - begin
        now = tick(state)
        gains = np.zeros(count, dtype=np.int64)
        for slot in prange(count):
            gains[slot] = _improve(
                begin + slot, now, tuples, by_camera, by_sample, focus, views, cell_offsets, state
            )
        total += gains.sum()
    return total


@kernel
def improve_in_turn(tuples, low, high, by_camera, by_sample, focus, views, cell_offsets, state):
    """Do what :func:`improve_tuples` does in one thread, without the time to start any."""
    total = np.int64(0)
    for t in range(tuples.batch_offsets[low], tuples.batch_offsets[high]):
        now = tick(state)
        total += _improve(t, now, tuples, by_camera, by_sample, focus, views, cell_offsets, state)
    return total


@kernel
def _improve(t, now, tuples, by_camera, by_sample, focus, views, cell_offsets, state):
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
            _sum_steps(c, by_camera, focus, views, cell_offsets, state)
    move = np.empty(len(members), dtype=np.int32)
    gain = _solve(t, tuples, focus, views, cell_offsets, state, move)
    if gain > 0 and len(state.ranking) == 0:
        for m in range(len(members)):
            c = members[m]
            state.cell[c] = move[m]
            touched[c], summed[c] = now, 0
        for e in range(tuples.shared_offsets[t], tuples.shared_offsets[t + 1]):
            hand_over(members, e, tuples, focus, views, state)
    elif gain > 0:
        for m in range(len(members)):
            _move(members[m], move[m], now, by_camera, by_sample, focus, views, state)
    return gain


@kernel
def _move(c, to, now, by_camera, by_sample, focus, views, state):
    """Move camera c to a cell; keep the rankings of the samples that it gains or loses.

    Touches the cameras that see those samples, or only the view's own shots if another one of them
    holds the sample as well.
    """
    offsets, seen, base, first, last = by_camera
    cell, touched, summed = state.cell, state.touched, state.summed
    was, cell[c] = cell[c], to
    if was == to:
        return
    view = views.number[c]
    for j in range(offsets[c], offsets[c + 1]):
        # Without branches to guess: most samples stay as they are.
        held = (first[j] <= was) & (was <= last[j])
        holds = (first[j] <= to) & (to <= last[j])
        if held == holds:
            continue
        p = seen[j]
        if held_by_another(c, view, first[j], last[j], views, cell):
            for shot in range(views.offsets[view], views.offsets[view + 1]):
                touched[shot], summed[shot] = now, 0
            continue
        cost = base[j] + (0 if holds else focus[p])
        if rerank(p, view, cost, by_sample, focus, views, cell, state.ranking):
            for q in range(by_sample.offsets[p], by_sample.offsets[p + 1]):
                touched[by_sample.camera[q]], summed[by_sample.camera[q]] = now, 0


@kernel
def move_cameras(cameras, to, by_camera, by_sample, focus, views, state):
    """Move some cameras to cells, ``to``, whatever that costs; with scope "all" only."""
    now = tick(state)
    for m in range(len(cameras)):
        _move(cameras[m], to[m], now, by_camera, by_sample, focus, views, state)


@kernel
def _solve(t, tuples, focus, views, cell_offsets, state, move):
    """Find tuple t's best cells; return their gain over the present ones, 0 if none.

    Fills ``move`` (k,) where there is a gain.
    """
    members = tuples.cameras[t]
    part = slice(tuples.shared_offsets[t], tuples.shared_offsets[t + 1])
    shared = SharedSamples(
        tuples.samples[part], tuples.bases[part], tuples.firsts[part], tuples.lasts[part]
    )
    step, now = _copy_steps(members, len(shared.samples), cell_offsets, state)
    thirds = 0
    if len(members) == 2 and _is_plain(views, state):
        change, count = _correct_pair(members, shared, focus, state, step)
        now += change
    else:
        now += _correct_steps(members, shared, focus, views, state, step)
        count, thirds = list_rectangles(shared, step)
    start_a, start_b = np.int64(state.cell[members[0]]), np.int64(state.cell[members[1]])
    if len(members) == 3:
        return best_triple(shared, step, count, thirds, start_a, start_b, now, move) - now
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
    step = JointStep(
        steps,
        begin,
        np.empty((count, 2**k), dtype=np.int64),
        np.empty((count, 4), dtype=np.int32),
        np.empty(count, dtype=np.int64),
        np.empty(count if k == 3 else 0, dtype=np.int32),
    )
    return step, now


@kernel
def _correct_steps(members, shared, focus, views, state, step):
    """Fill what shared samples cost, and correct the members' sums where they share these.

    Returns the change of what the tuple gains now.
    """
    ranking, cell = state.ranking, state.cell
    samples, bases, firsts, lasts = shared
    steps, begin, costs = step.steps, step.begin, step.costs
    k, own = len(members), views.number[members]
    sums, serves = np.empty(k + 1, dtype=np.int64), np.ones(k, dtype=np.bool_)
    values = np.empty((k, 2), dtype=np.int64)
    change = np.int64(0)
    for e in range(len(samples)):
        p = samples[e]
        if len(ranking) > 0:
            needed = sums_beside(p, own, views, ranking, sums)
        else:
            theirs = serve(p, members, views, state.best, serves)
            sums[:] = NO_CHOICE
            sums[theirs] = 0
            needed = theirs > 0
            if not needed:
                costs[e, 0] = -1
                continue
        for m in range(k):
            base = bases[e, m] if serves[m] else NO_CHOICE
            values[m, 0], values[m, 1] = base + focus[p], base
            if len(ranking) > 0 and held_outside(
                m, firsts[e, m], lasts[e, m], members, views, cell
            ):
                values[m, 0] = base
        if k == 2:
            costs_of_two(own, sums, values, costs[e])
        else:
            costs_of_three(own, sums, values, costs[e])
        if not needed:
            # Cameras outside the tuple are cheaper, in or out of focus: what one of the tuple's
            # gains does not depend on the others, and none of them gains now.
            continue
        held = 0
        for m in range(k):
            base, first, last = bases[e, m], firsts[e, m], lasts[e, m]
            if first > last:
                continue
            alone = _alone(p, members[m], base, first, last, focus[p], views, state)
            if first <= cell[members[m]] <= last:
                change -= alone
                held |= 1 << m
            more = costs[e, 0] - costs[e, 1 << m] - alone
            if more != 0:
                steps[begin[m] + first] += more
                steps[begin[m] + last + 1] -= more
        change += costs[e, 0] - costs[e, held]
    return change


@kernel
def _correct_pair(members, shared, focus, state, step):
    """Do what :func:`_correct_steps` and :func:`list_rectangles` do for two where it is plain.

    Then a sample costs the least of one camera outside the pair and the two in it. Returns the
    change of what the pair gains now, and the number of rectangles.
    """
    ranking, cell = state.ranking, state.cell
    samples, bases, firsts, lasts = shared
    steps, begin = step.steps, step.begin
    rectangles, weights = step.rectangles, step.weights
    a, b = members[0], members[1]
    cell_a, cell_b, begin_a, begin_b = cell[a], cell[b], begin[0], begin[1]
    change, count = np.int64(0), 0
    for e in range(len(samples)):
        p = samples[e]
        sharp_a, sharp_b = bases[e, 0], bases[e, 1]
        first_a, last_a, first_b, last_b = firsts[e, 0], lasts[e, 0], firsts[e, 1], lasts[e, 1]
        blurred_a, blurred_b = sharp_a + focus[p], sharp_b + focus[p]
        best = ranking[p, 0] & VIEW
        outside, needed = ranking[p, 0], best in (a, b)
        if needed:
            second = ranking[p, 1] & VIEW
            outside = ranking[p, 2] if second in (a, b) else ranking[p, 1]
        other = outside >> VIEW_BITS
        none = min(other, blurred_a, blurred_b)
        only_a = min(other, sharp_a, blurred_b)
        only_b = min(other, blurred_a, sharp_b)
        both = min(other, sharp_a, sharp_b)
        can_a, can_b = first_a <= last_a, first_b <= last_b
        if needed:
            now = none
            if can_a:
                alone = _alone_in_one_view(p, a, sharp_a, focus[p], ranking)
                more = none - only_a - alone
                steps[begin_a + first_a] += more
                steps[begin_a + last_a + 1] -= more
                if first_a <= cell_a <= last_a:
                    change -= alone
                    now = only_a
            if can_b:
                alone = _alone_in_one_view(p, b, sharp_b, focus[p], ranking)
                more = none - only_b - alone
                steps[begin_b + first_b] += more
                steps[begin_b + last_b + 1] -= more
                if first_b <= cell_b <= last_b:
                    change -= alone
                    now = both if can_a and first_a <= cell_a <= last_a else only_b
            change += none - now
        weight = none - only_a - only_b + both
        if weight > 0 and can_a and can_b:
            rectangles[count, 0], rectangles[count, 1] = first_a, last_a
            rectangles[count, 2], rectangles[count, 3] = first_b, last_b
            weights[count] = weight
            count += 1
    return change, count
