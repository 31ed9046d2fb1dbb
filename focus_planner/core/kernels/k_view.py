"""Exact joint steps of two or three cameras (paper, Sec. 3.4; README, "How it works").

For the cameras of a tuple all the rest stands still. A sample then costs m, the least it can
have with every camera of the tuple out of focus, less the gain of the best camera that holds it
in focus: for camera a that is g_a = max(0, m − base cost of a). With two cameras the gains add
up to a function of a's cell, plus a function of b's cell, less min(g_a, g_b) on the rectangle of
cells where both hold the sample: what :func:`best_pair` maximises. A third camera is an outer
loop over its cells: where it holds a sample in focus, m is at most its base cost.

A sample that only one camera of the tuple sees adds to that camera's function alone, the same
whichever the tuple. ``steps`` keeps these functions per camera, as differences from cell to
cell, and a tuple costs only what its cameras share.

Scope "all" (``ranking`` not empty): "the rest" of a sample is its cheapest camera outside the
tuple, as it now stands. Scope "assigned": the samples assigned to the tuple stay in it.

A sample's ``ranking`` (N, k + 1) holds its cheapest cameras as keys, the cost in units above the
camera's number: keys sort by cost, ties by number, and fit a cache line.
"""

from __future__ import annotations

import numpy as np
from numba import prange

from focus_planner.core.kernels.compiling import kernel, parallel_kernel
from focus_planner.core.kernels.cost import UNSEEN
from focus_planner.core.kernels.pairs import best_pair

CAMERA_BITS = 18
_CAMERA = 2**CAMERA_BITS - 1
NEVER = np.int64(2**44)  # more than any sample's cost: that of no camera at all
_NOBODY = (NEVER << CAMERA_BITS) | _CAMERA


@kernel
def _gain(least, base):
    return max(least - base, np.int64(0))


@kernel
def _alone(ranking, best, p, c, base, focus):
    """Return what camera c gains from holding p in focus, all other cameras standing still."""
    if len(ranking) == 0:
        return focus if best[p] == c else np.int64(0)
    other = ranking[p, 0]
    if other & _CAMERA == c:
        other = ranking[p, 1]
    return _gain(min(other >> CAMERA_BITS, base + focus), base)


@kernel
def _outside(ranking, p, members):
    """Return the least cost of sample p over the cameras that are not members, if it counts."""
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
def _rank(sample_offsets, camera_index, base, focus, first, last, cell, ranking, p):
    """Fill sample p's cheapest cameras, ascending."""
    ranks = ranking.shape[1]
    for i in range(ranks):
        ranking[p, i] = _NOBODY
    for q in range(sample_offsets[p], sample_offsets[p + 1]):
        c = camera_index[q]
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
def rank_cameras(sample_offsets, camera_index, base, focus, first, last, cell, ranking):
    """Fill every sample's ranking."""
    for p in prange(len(ranking)):
        _rank(sample_offsets, camera_index, base, focus, first, last, cell, ranking, p)


@kernel
def _sum_steps(c, low, high, seen, pair_base, pair_first, pair_last, focus, ranking, best, steps):
    """Fill camera c's ``steps`` from its pairs ``low`` to ``high``, one more than its cells."""
    steps[:] = 0
    for j in range(low, high):
        if pair_first[j] <= pair_last[j]:
            p = seen[j]
            gain = _alone(ranking, best, p, c, pair_base[j], focus[p])
            steps[pair_first[j]] += gain
            steps[pair_last[j] + 1] -= gain


@parallel_kernel
def improve_tuples(
    tuples,
    batch_offsets,
    shared_offsets,
    shared_samples,
    shared_base,
    shared_first,
    shared_last,
    camera_offsets,
    seen,
    seen_base,
    seen_first,
    seen_last,
    sample_offsets,
    camera_index,
    base,
    first,
    last,
    focus,
    cell_offsets,
    cell,
    ranking,
    best,
    steps,
    summed,
    touched,
    solved,
    clock,
):
    """Take every tuple's exact best step, batch by batch; return the gain in units.

    The tuples of one batch do not influence each other: none reads what another writes, so they
    run at once. ``clock`` (1,) counts batches; ``touched`` (C,), ``summed`` (C,) and ``solved``
    (T,) hold when a camera's surroundings last changed, its ``steps`` were last summed, and a
    tuple was last solved. What nothing has touched since is passed over.
    """
    total = np.int64(0)
    k = tuples.shape[1]
    for batch in range(len(batch_offsets) - 1):
        low = batch_offsets[batch]
        count = batch_offsets[batch + 1] - low
        clock[0] += 1
        now = clock[0]
        gains = np.zeros(count, dtype=np.int64)
        for slot in prange(count):
            t = low + slot
            stale = False
            for c in tuples[t]:
                if touched[c] > solved[t]:
                    stale = True
            if stale:
                solved[t] = now
                for c in tuples[t]:
                    if touched[c] > summed[c]:
                        summed[c] = now
                        _sum_steps(
                            c,
                            camera_offsets[c],
                            camera_offsets[c + 1],
                            seen,
                            seen_base,
                            seen_first,
                            seen_last,
                            focus,
                            ranking,
                            best,
                            steps[cell_offsets[c] + c : cell_offsets[c + 1] + c + 1],
                        )
                part = slice(shared_offsets[t], shared_offsets[t + 1])
                move = np.empty(k, dtype=np.int32)
                gains[slot] = _solve(
                    tuples[t],
                    shared_samples[part],
                    shared_base[part],
                    shared_first[part],
                    shared_last[part],
                    focus,
                    cell_offsets,
                    cell,
                    ranking,
                    best,
                    steps,
                    move,
                )
                if gains[slot] > 0 and len(ranking) == 0:
                    for m in range(k):
                        c = tuples[t, m]
                        cell[c] = move[m]
                        touched[c], summed[c] = now, 0
                    for e in range(shared_offsets[t], shared_offsets[t + 1]):
                        _hand_over(
                            tuples[t],
                            shared_samples[e],
                            shared_base[e],
                            shared_first[e],
                            shared_last[e],
                            focus,
                            cell,
                            best,
                        )
                elif gains[slot] > 0:
                    for m in range(k):
                        c = tuples[t, m]
                        was, cell[c] = cell[c], move[m]
                        for j in range(camera_offsets[c], camera_offsets[c + 1]):
                            held = seen_first[j] <= was <= seen_last[j]
                            holds = seen_first[j] <= move[m] <= seen_last[j]
                            if held != holds:
                                _move_in_ranking(
                                    sample_offsets,
                                    camera_index,
                                    base,
                                    focus,
                                    first,
                                    last,
                                    cell,
                                    ranking,
                                    touched,
                                    summed,
                                    now,
                                    seen[j],
                                    c,
                                    seen_base[j] + (0 if holds else focus[seen[j]]),
                                )
        total += gains.sum()
    return total


@kernel
def _move_in_ranking(
    sample_offsets,
    camera_index,
    base,
    focus,
    first,
    last,
    cell,
    ranking,
    touched,
    summed,
    now,
    p,
    c,
    cost,
):
    """Give camera c its new cost in sample p's ranking; touch the cameras that see p.

    The sample's other cameras are looked at only where c leaves a gap that one of them may fill.
    """
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
        _rank(sample_offsets, camera_index, base, focus, first, last, cell, ranking, p)
        at = -1
    if at >= 0:
        while at > 0 and key < ranking[p, at - 1]:
            ranking[p, at] = ranking[p, at - 1]
            at -= 1
        while at < ranks - 1 and key > ranking[p, at + 1]:
            ranking[p, at] = ranking[p, at + 1]
            at += 1
        ranking[p, at] = key
    for q in range(sample_offsets[p], sample_offsets[p + 1]):
        touched[camera_index[q]], summed[camera_index[q]] = now, 0


@kernel
def _hand_over(members, p, bases, firsts, lasts, focus, cell, best):
    """Assign sample p, if it is one of the tuple's, to the cheapest of the tuple's cameras."""
    least, which, owner = NEVER, -1, -1
    for m in range(len(members)):
        c = members[m]
        if best[p] == c:
            owner = m
        if bases[m] < NEVER:
            cost = bases[m] + (0 if firsts[m] <= cell[c] <= lasts[m] else focus[p])
            # Of equal cameras the present one.
            if cost < least or (cost == least and best[p] == c):
                least, which = cost, m
    if owner >= 0:
        best[p] = members[which]


@kernel
def _solve(
    members,
    samples,
    bases,
    firsts,
    lasts,
    focus,
    cell_offsets,
    cell,
    ranking,
    best,
    steps,
    move,
):
    """Find the tuple's best cells; return what they gain on the present ones, 0 if nothing.

    ``samples`` (n,) are those that at least two members see; ``bases``, ``firsts``, ``lasts``
    (n, k) their base cost with each member, NEVER where it does not see them, and the cells that
    hold them. Fills ``move`` (k,) where there is a gain.
    """
    k = len(members)
    a, b = members[0], members[1]
    steps_a = steps[cell_offsets[a] + a : cell_offsets[a + 1] + a + 1].copy()
    steps_b = steps[cell_offsets[b] + b : cell_offsets[b + 1] + b + 1].copy()
    now = steps_a[: cell[a] + 1].sum() + steps_b[: cell[b] + 1].sum()
    steps_c = np.zeros(2, dtype=np.int64)
    if k == 3:
        c = members[2]
        steps_c = steps[cell_offsets[c] + c : cell_offsets[c + 1] + c + 1].copy()
        now += steps_c[: cell[c] + 1].sum()
    rectangles = np.empty((len(samples), 4), dtype=np.int32)
    weights = np.empty(len(samples), dtype=np.int64)
    count = 0
    # Samples that the third camera may gain, and their cost with all three out of focus.
    third = np.empty(len(samples) if k == 3 else 0, dtype=np.int32)
    third_out = np.empty(len(third), dtype=np.int64)
    thirds = 0
    for e in range(len(samples)):
        p = samples[e]
        cheapest = ranking[p, 0] & _CAMERA if len(ranking) > 0 else best[p]
        ours = False
        for c in members:
            if c == cheapest:
                ours = True
        if ours:
            out = _outside(ranking, p, members)
            for m in range(k):
                out = min(out, bases[e, m] + focus[p])
            least = out
            for m in range(k):
                if firsts[e, m] > lasts[e, m]:
                    continue
                c = members[m]
                alone = _alone(ranking, best, p, c, bases[e, m], focus[p])
                if firsts[e, m] <= cell[c] <= lasts[e, m]:
                    now -= alone
                    least = min(least, bases[e, m])
                change = _gain(out, bases[e, m]) - alone
                if change != 0:
                    if m == 0:
                        steps_a[firsts[e, m]] += change
                        steps_a[lasts[e, m] + 1] -= change
                    elif m == 1:
                        steps_b[firsts[e, m]] += change
                        steps_b[lasts[e, m] + 1] -= change
                    else:
                        steps_c[firsts[e, m]] += change
                        steps_c[lasts[e, m] + 1] -= change
            now += out - least
        elif len(ranking) > 0:
            # A camera outside the tuple is cheapest, in or out of focus: it sets the cost without
            # the tuple, for each camera alone as for all together, and none of them gains now.
            out = ranking[p, 0] >> CAMERA_BITS
        else:
            continue
        if k == 3 and firsts[e, 2] <= lasts[e, 2] and bases[e, 2] < out:
            third[thirds] = e
            third_out[thirds] = out
            thirds += 1
        else:
            count = _add_rectangle(bases[e], firsts[e], lasts[e], out, rectangles, weights, count)
    gain_a, gain_b = np.cumsum(steps_a[:-1]), np.cumsum(steps_b[:-1])
    if k == 2:
        gain, i, j = best_pair(
            gain_a, gain_b, rectangles, weights, count, np.int64(cell[a]), np.int64(cell[b]), now
        )
        if i >= 0:
            move[0], move[1] = i, j
        return gain - now
    gain_c = np.cumsum(steps_c[:-1])
    bound = gain_a.max() + gain_b.max()
    found = now
    for i_c in range(len(gain_c)):
        # Cameras gain together at most the sum of what each gains.
        if gain_c[i_c] + bound <= found:
            continue
        inner_a, inner_b = steps_a.copy(), steps_b.copy()
        inner_rectangles = np.empty((count + thirds, 4), dtype=np.int32)
        inner_rectangles[:count] = rectangles[:count]
        inner_weights = np.empty(count + thirds, dtype=np.int64)
        inner_weights[:count] = weights[:count]
        inner_count = count
        for n in range(thirds):
            e, out = third[n], third_out[n]
            if firsts[e, 2] <= i_c <= lasts[e, 2]:
                out = bases[e, 2]
                for m in range(2):
                    if firsts[e, m] <= lasts[e, m]:
                        change = _gain(out, bases[e, m]) - _gain(third_out[n], bases[e, m])
                        inner = inner_a if m == 0 else inner_b
                        inner[firsts[e, m]] += change
                        inner[lasts[e, m] + 1] -= change
            inner_count = _add_rectangle(
                bases[e], firsts[e], lasts[e], out, inner_rectangles, inner_weights, inner_count
            )
        gain, i, j = best_pair(
            np.cumsum(inner_a[:-1]),
            np.cumsum(inner_b[:-1]),
            inner_rectangles,
            inner_weights,
            inner_count,
            np.int64(cell[a]),
            np.int64(cell[b]),
            found - gain_c[i_c],
        )
        if i >= 0:
            found = gain + gain_c[i_c]
            move[0], move[1], move[2] = i, j, i_c
    return found - now


@kernel
def _add_rectangle(bases, firsts, lasts, out, rectangles, weights, count):
    """Add the cells of the first two cameras that both hold a sample, if both gain by it."""
    weight = out - max(bases[0], bases[1])
    if weight <= 0 or firsts[0] > lasts[0] or firsts[1] > lasts[1]:
        return count
    rectangles[count, 0], rectangles[count, 1] = firsts[0], lasts[0]
    rectangles[count, 2], rectangles[count, 3] = firsts[1], lasts[1]
    weights[count] = weight
    return count + 1


@kernel
def reassign(
    sample_offsets, camera_index, base, focus, first, last, cell, best, summed, touched, clock
):
    """Assign every sample to its cheapest camera (Eq. 5); return the gain in units."""
    clock[0] += 1
    gain = np.int64(0)
    for p in range(len(best)):
        if best[p] == UNSEEN:
            continue
        least, which, now = NEVER, UNSEEN, NEVER
        for q in range(sample_offsets[p], sample_offsets[p + 1]):
            c = camera_index[q]
            cost = base[q] + (0 if first[q] <= cell[c] <= last[q] else focus[p])
            if c == best[p]:
                now = cost
            if cost < least:
                least, which = cost, c
        if least < now:
            gain += now - least
            touched[best[p]], touched[which] = clock[0], clock[0]
            summed[best[p]], summed[which] = 0, 0
            best[p] = which
    return gain
