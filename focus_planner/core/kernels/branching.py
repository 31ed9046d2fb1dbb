"""Bounds where cameras are confined to a part of their cells (core/proof/branching.py)."""

from __future__ import annotations

import numpy as np
from numba import prange

from focus_planner.core.kernels.compiling import kernel, parallel_kernel

_MOMENTUM = 0.7
_PATIENCE = 12
_PROGRESS = 0.25
_FALL = 0.5
# Of a node's work no more than some 20 ms between two looks at the clock, but some steps at least.
_WORK = 5_000_000
_FEWEST_STEPS = 10
# Steps aim beyond the goal by so much of the bound: they would near it for ever, and a node that
# is closed in fewer steps is worth more than one whose bound is exact.
_BEYOND = 2e-4


@kernel
def _local_problem(
    cameras,
    inside,
    offsets,
    sample,
    gain,
    first,
    last,
    by_sample_offsets,
    by_sample_camera,
    by_sample_gain,
    low,
    high,
    price,
    reach,
    most,
    place,
    members,
    floor,
    pair_offsets,
    pair_member,
    pair_first,
    pair_last,
    pair_gain,
    fixed,
    fixed_offsets,
):
    """Gather what the cameras' bound depends on; return how many samples' prices are free.

    A sample is free if no other camera takes anything above its price; then its price may fall to
    what the best of the others gains, and does where no range holds it any more. What held
    samples add stands in ``fixed``, per cell.
    """
    count = 0
    at = 0
    for k in range(len(cameras)):
        c = cameras[k]
        pair_offsets[k] = at
        a, b = low[c], high[c]
        part = fixed[fixed_offsets[k] : fixed_offsets[k + 1]]
        part[:] = 0
        for j in range(offsets[c], offsets[c + 1]):
            p = sample[j]
            if place[p] == -1:
                least = np.int64(0)
                for q in range(by_sample_offsets[p], by_sample_offsets[p + 1]):
                    if not inside[by_sample_camera[q]] and by_sample_gain[q] > least:
                        least = by_sample_gain[q]
                if least > price[p]:
                    place[p] = -2
                else:
                    place[p] = count
                    members[count] = p
                    floor[count] = least
                    count += 1
            if first[j] > b or last[j] < a:
                continue
            if place[p] == -2:
                above = gain[j] - price[p]
                if above > 0:
                    part[max(first[j], a) - a] += above
                    part[min(last[j], b) - a + 1] -= above
            elif gain[j] > price[p] - (most[p] >> reach):
                pair_member[at] = place[p]
                pair_first[at], pair_last[at] = max(first[j], a) - a, min(last[j], b) - a
                pair_gain[at] = gain[j]
                at += 1
            elif gain[j] > floor[place[p]]:
                floor[place[p]] = gain[j]
    pair_offsets[len(cameras)] = at
    return count


@kernel
def _takings(k, pair_offsets, pair_member, pair_first, pair_last, pair_gain, fixed, price, steps):
    """Fill what each cell of the k-th camera takes; return the most and its cell."""
    steps[:] = fixed
    for j in range(pair_offsets[k], pair_offsets[k + 1]):
        above = max(pair_gain[j] - price[pair_member[j]], 0)
        steps[pair_first[j]] += above
        steps[pair_last[j] + 1] -= above
    best, where, total = np.int64(-1), 0, np.int64(0)
    for i in range(len(steps) - 1):
        total += steps[i]
        steps[i] = total
        if total > best:
            best, where = total, i
    return best, where


@kernel
def _tighten(
    cameras,
    offsets,
    sample,
    gain,
    first,
    last,
    by_sample_offsets,
    by_sample_camera,
    by_sample_gain,
    most,
    reach,
    base,
    low,
    high,
    price,
    score,
    split,
    cell,
    goal,
    iterations,
):
    """Lower a node's bound, ``base`` at its prices, by the prices around these cameras; return it.

    The cameras' ``low``, ``high`` lose ends that no plan above ``goal`` can use; their ``score``
    and ``split`` say where to branch next, and ``cell`` is their best at the best prices.
    """
    n, samples = len(cameras), len(price)
    inside = np.zeros(len(low), dtype=np.bool_)
    pairs = 0
    fixed_offsets = np.zeros(n + 1, dtype=np.int64)
    for k in range(n):
        c = cameras[k]
        inside[c] = True
        pairs += offsets[c + 1] - offsets[c]
        fixed_offsets[k + 1] = fixed_offsets[k] + (high[c] - low[c] + 2 if high[c] >= low[c] else 0)
    place = np.full(samples, -1, dtype=np.int32)
    members, floor = np.empty(samples, dtype=np.int32), np.empty(samples, dtype=np.int64)
    pair_offsets = np.empty(n + 1, dtype=np.int64)
    pair_member = np.empty(pairs, dtype=np.int32)
    pair_first = np.empty(pairs, dtype=np.int32)
    pair_last = np.empty(pairs, dtype=np.int32)
    pair_gain = np.empty(pairs, dtype=np.int64)
    fixed = np.zeros(fixed_offsets[n], dtype=np.int64)
    count = _local_problem(
        cameras,
        inside,
        offsets,
        sample,
        gain,
        first,
        last,
        by_sample_offsets,
        by_sample_camera,
        by_sample_gain,
        low,
        high,
        price,
        reach,
        most,
        place,
        members,
        floor,
        pair_offsets,
        pair_member,
        pair_first,
        pair_last,
        pair_gain,
        fixed,
        fixed_offsets,
    )
    now = np.empty(count, dtype=np.int64)
    for i in range(count):
        now[i] = price[members[i]]
    best_price = now.copy()
    direction, slope = np.zeros(count), np.empty(count)
    steps = np.zeros(fixed_offsets[n], dtype=np.int64)
    chosen = np.zeros(fixed_offsets[n], dtype=np.int64)
    best, hope, reference, since = np.int64(2**62), 0.0, np.int64(2**62), 0
    start = np.int64(0)
    work = pair_offsets[n] + fixed_offsets[n] + count + 1
    for iteration in range(min(iterations, max(_FEWEST_STEPS, _WORK // work))):
        bound = np.int64(0)
        for i in range(count):
            bound += now[i]
            slope[i] = 1.0
        for k in range(n):
            part = slice(fixed_offsets[k], fixed_offsets[k + 1])
            if fixed_offsets[k + 1] == fixed_offsets[k]:
                continue
            value, top = _takings(
                k,
                pair_offsets,
                pair_member,
                pair_first,
                pair_last,
                pair_gain,
                fixed[part],
                now,
                steps[part],
            )
            bound += value
            chosen[fixed_offsets[k] + top] += 1
            for j in range(pair_offsets[k], pair_offsets[k + 1]):
                i = pair_member[j]
                held = (pair_first[j] <= top) & (top <= pair_last[j]) & (pair_gain[j] > now[i])
                slope[i] -= held
        if iteration == 0:
            start = bound
            hope = max(0.3 * (base - goal), _BEYOND * base)
            reference = bound
        if bound < best:
            best = bound
            best_price[:] = now
        if base + best - start <= goal:
            break
        if best <= reference - _PROGRESS * hope:
            reference, since = best, 0
        else:
            since += 1
        if since >= _PATIENCE:
            hope *= _FALL
            reference, since = best, 0
            now[:] = best_price
            direction[:] = 0
            continue
        square = 0.0
        for i in range(count):
            direction[i] += (1.0 - _MOMENTUM) * (slope[i] - direction[i])
            square += direction[i] * direction[i]
        step = (bound - best + hope) / max(square, 1e-9)
        for i in range(count):
            moved = now[i] - np.int64(np.rint(step * direction[i]))
            now[i] = min(max(moved, floor[i]), most[members[i]])
    for i in range(count):
        price[members[i]] = best_price[i]
    bound = base + best - start
    slack = bound - goal
    if slack <= 0:
        return bound
    for k in range(n):
        c = cameras[k]
        part = slice(fixed_offsets[k], fixed_offsets[k + 1])
        score[c] = 0
        if high[c] < low[c]:
            continue
        value, top = _takings(
            k,
            pair_offsets,
            pair_member,
            pair_first,
            pair_last,
            pair_gain,
            fixed[part],
            best_price,
            steps[part],
        )
        # Where the best prices serve each sample once, these cells are a plan that gains as much.
        cell[c] = low[c] + top
        if high[c] == low[c]:
            continue
        a, b = 0, high[c] - low[c]
        takings, often = steps[part], chosen[part]
        while takings[a] < value - slack:
            a += 1
        while takings[b] < value - slack:
            b -= 1
        total = 0
        for i in range(a, b + 1):
            total += often[i]
        # Between two cells that are each best at times, at the least that lies between them.
        past, previous, least, where = 0, -1, value, 0
        for i in range(a, b + 1):
            if previous >= 0 and takings[i] <= least:
                least, where = takings[i], i
            if often[i] > 0:
                if previous >= 0:
                    worth = min(past, total - past) * (value - least + slack // 1024)
                    if worth > score[c]:
                        score[c] = worth
                        split[c] = low[c] + min(max(where, previous), i - 1)
                past += often[i]
                previous, least, where = i, value, i
        high[c] = low[c] + b
        low[c] = low[c] + a
    return bound


@kernel
def _most_taken(c, offsets, sample, gain, first, last, low, high, price):
    """Return the most that one of the cells ``low`` to ``high`` of camera c takes."""
    steps = np.zeros(high - low + 2, dtype=np.int64)
    for j in range(offsets[c], offsets[c + 1]):
        above = gain[j] - price[sample[j]]
        if above > 0 and first[j] <= high and last[j] >= low:
            steps[max(first[j], low) - low] += above
            steps[min(last[j], high) - low + 1] -= above
    best, total = np.int64(-1), np.int64(0)
    for i in range(high - low + 1):
        total += steps[i]
        best = max(best, total)
    return best


@parallel_kernel
def confine(
    branched,
    branched_low,
    branched_high,
    wide,
    near_offsets,
    near,
    offsets,
    sample,
    gain,
    first,
    last,
    by_sample_offsets,
    by_sample_camera,
    by_sample_gain,
    most,
    reach,
    bounds,
    low,
    high,
    price,
    score,
    split,
    cell,
    goal,
    iterations,
):
    """Confine one camera of each node to a part of its cells, and bound what is left.

    Of B nodes, at first copies of their parents: ``low``, ``high`` (B, C), ``price`` (B, N),
    ``score``, ``split``, ``cell`` (B, C), ``bounds`` (B,) exact at these prices. Node b's camera
    ``branched[b]`` (-1: none) is confined to ``branched_low[b]`` to ``branched_high[b]``. Prices
    adapt around ``near[near_offsets[c] : near_offsets[c + 1]]``, or, where ``wide``, everywhere.
    """
    for b in prange(len(branched)):
        c = branched[b]
        if c >= 0:
            bounds[b] -= _most_taken(
                c, offsets, sample, gain, first, last, low[b, c], high[b, c], price[b]
            )
            low[b, c], high[b, c] = branched_low[b], branched_high[b]
            bounds[b] += _most_taken(
                c, offsets, sample, gain, first, last, low[b, c], high[b, c], price[b]
            )
        if bounds[b] > goal:
            if wide[b]:
                cameras = np.arange(low.shape[1]).astype(np.int32)
            else:
                cameras = near[near_offsets[c] : near_offsets[c + 1]].copy()
            bounds[b] = _tighten(
                cameras,
                offsets,
                sample,
                gain,
                first,
                last,
                by_sample_offsets,
                by_sample_camera,
                by_sample_gain,
                most,
                reach,
                bounds[b],
                low[b],
                high[b],
                price[b],
                score[b],
                split[b],
                cell[b],
                goal,
                iterations,
            )
