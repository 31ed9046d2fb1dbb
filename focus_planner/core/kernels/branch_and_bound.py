# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Bounds on plans whose cameras are confined to a part of their cells (docs/algorithm.md)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import prange
from numpy.typing import NDArray

from focus_planner.core.arrays import IntArray, Offsets
from focus_planner.core.kernels.compiling import kernel, parallel_kernel

_MOMENTUM = 0.7
_PATIENCE = 12
_PROGRESS = 0.25
_FALL = 0.5
# At most some 20 ms of work on a node between two checks of the clock, but always a few steps.
_WORK = 5_000_000
_FEWEST_STEPS = 10
# Steps aim beyond the goal by this part of the bound: aimed at it, they would only approach it. And
# a node closed in fewer steps is worth more than one whose bound is exact.
_BEYOND = 2e-4


class Nodes(NamedTuple):
    """B nodes of the search, a row each; :func:`confine` changes them.

    Attributes
    ----------
    bound : (B,) array of int64
        What no plan of the node gains more than, units.
    low, high : (B, C) arrays of int32
        Each camera's first and last cell; low > high for a camera without cells.
    price : (B, N) array of int64
        Prices that prove the bound, units.
    score : (B, C) array of int64
        How promising it is to branch on a camera; 0 if nothing is known.
    split : (B, C) array of int32
        The last cell of the lower half, where the score is above 0.
    cell : (B, C) array of int32
        Each camera's best cell at these prices.
    """

    bound: Offsets
    low: IntArray
    high: IntArray
    price: Offsets
    score: Offsets
    split: IntArray
    cell: IntArray


class Cuts(NamedTuple):
    """How each of B nodes differs from its parent.

    Attributes
    ----------
    camera : (B,) array of int64
        The camera to confine; -1 for none.
    first, last : (B,) arrays of int64
        The cells to confine it to.
    wide : (B,) array of bool
        Whether all prices adapt, not only those around the camera.
    """

    camera: NDArray[np.int64]
    first: NDArray[np.int64]
    last: NDArray[np.int64]
    wide: NDArray[np.bool_]


class Neighbourhoods(NamedTuple):
    """The cameras around which prices adapt when one is confined, itself included.

    Attributes
    ----------
    offsets : (C + 1,) array of int64
        Camera c's are ``offsets[c]`` to ``offsets[c + 1]``.
    camera : (L,) array of int32
    """

    offsets: Offsets
    camera: IntArray


class _Node(NamedTuple):
    """One row of :class:`Nodes`, without its bound."""

    low: IntArray
    high: IntArray
    price: Offsets
    score: Offsets
    split: IntArray
    cell: IntArray


class _LocalPairs(NamedTuple):
    """Pairs of n cameras with the F samples whose prices are free.

    ``offsets`` (n + 1) of the k-th camera's pairs; their ``member``, one of the F samples, the
    ``first`` and ``last`` cell, counted from the camera's ``low``, and the ``gain``.
    """

    offsets: Offsets
    member: IntArray
    first: IntArray
    last: IntArray
    gain: Offsets


class _Local(NamedTuple):
    """What n cameras' bound depends on: their pairs with the F samples whose prices are free.

    ``gains`` are those in focus, ``blurred`` those that gain even out of focus. ``place`` (N,)
    of a sample is its member's index, -1 if none of the cameras sees it, -2 if its price is held.
    ``sample`` is each member's sample and ``floor`` its least price. ``fixed`` is what samples
    with held prices add, as differences from cell to cell; the k-th camera's part is
    ``cell_offsets[k]`` to ``cell_offsets[k + 1]``, one longer than its cells.
    """

    gains: _LocalPairs
    blurred: _LocalPairs
    place: IntArray
    sample: IntArray
    floor: Offsets
    fixed: Offsets
    cell_offsets: Offsets


@kernel
def _room(cameras, offsets):
    """Return room for all pairs of the cameras."""
    pairs = 0
    for c in cameras:
        pairs += offsets[c + 1] - offsets[c]
    return _LocalPairs(
        np.empty(len(cameras) + 1, dtype=np.int64),
        np.empty(pairs, dtype=np.int32),
        np.empty(pairs, dtype=np.int32),
        np.empty(pairs, dtype=np.int32),
        np.empty(pairs, dtype=np.int64),
    )


@kernel
def _empty_local(node, cameras, pairs):
    """Return room for a local problem."""
    n, samples = len(cameras), len(node.price)
    cell_offsets = np.zeros(n + 1, dtype=np.int64)
    for k in range(n):
        c = cameras[k]
        cells = node.high[c] - node.low[c] + 2 if node.high[c] >= node.low[c] else 0
        cell_offsets[k + 1] = cell_offsets[k] + cells
    return _Local(
        _room(cameras, pairs.gains.offsets),
        _room(cameras, pairs.blurred.offsets),
        np.full(samples, -1, dtype=np.int32),
        np.empty(samples, dtype=np.int32),
        np.empty(samples, dtype=np.int64),
        np.zeros(cell_offsets[n], dtype=np.int64),
        cell_offsets,
    )


@kernel
def _best_elsewhere(p, inside, by_sample):
    """Return the most that sample p gains from a camera that is not inside."""
    least = np.int64(0)
    for q in range(by_sample.offsets[p], by_sample.offsets[p + 1]):
        if not inside[by_sample.camera[q]] and by_sample.gain[q] > least:
            least = by_sample.gain[q]
    return least


@kernel
def _place(node, cameras, gains, by_sample, local):
    """Find the samples that cameras gain from, and whose prices are free; return how many are.

    A sample's price is free if no other camera takes anything above it. It may then fall to what
    the best of the others gains, and does where no range holds the sample any more.
    """
    inside = np.zeros(len(node.low), dtype=np.bool_)
    for c in cameras:
        inside[c] = True
    place, count = local.place, 0
    for c in cameras:
        for j in range(gains.offsets[c], gains.offsets[c + 1]):
            p = gains.sample[j]
            if place[p] == -1:
                least = _best_elsewhere(p, inside, by_sample)
                if least > node.price[p]:
                    place[p] = -2
                else:
                    place[p], local.sample[count], local.floor[count] = count, p, least
                    count += 1
    return count


@kernel
def _clip(k, c, node, gains, sign, most, reach, local, at, clipped):
    """Append the pairs of the k-th camera, c, to those clipped to its range; return their number.

    What samples with held prices take is added to what is fixed, or taken away from it.
    """
    offsets, sample, gain, first, last = gains
    a, b, price = node.low[c], node.high[c], node.price
    part = local.fixed[local.cell_offsets[k] : local.cell_offsets[k + 1]]
    for j in range(offsets[c], offsets[c + 1]):
        if first[j] > b or last[j] < a:
            continue
        p = sample[j]
        member = local.place[p]
        if member == -2:
            above = gain[j] - price[p]
            if above > 0:
                part[max(first[j], a) - a] += sign * above
                part[min(last[j], b) - a + 1] -= sign * above
        elif gain[j] > price[p] - (most[p] >> reach):
            clipped.member[at], clipped.gain[at] = member, gain[j]
            clipped.first[at], clipped.last[at] = max(first[j], a) - a, min(last[j], b) - a
            at += 1
        elif gain[j] > local.floor[member]:
            local.floor[member] = gain[j]
    return at


@kernel
def _gather(node, cameras, pairs, by_sample, reach, local):
    """Fill a local problem; return how many samples' prices are free."""
    count = _place(node, cameras, pairs.gains, by_sample, local)
    gained, blurred, most = 0, 0, by_sample.most
    for k in range(len(cameras)):
        c = cameras[k]
        local.gains.offsets[k], local.blurred.offsets[k] = gained, blurred
        gained = _clip(k, c, node, pairs.gains, 1, most, reach, local, gained, local.gains)
        # A pair that gains out of focus gains more in focus: its sample has its place.
        blurred = _clip(k, c, node, pairs.blurred, -1, most, reach, local, blurred, local.blurred)
    local.gains.offsets[len(cameras)], local.blurred.offsets[len(cameras)] = gained, blurred
    return count


@kernel
def _add_above(k, pairs, price, sign, takings):
    """Add, or take away, what the k-th camera's pairs take, as differences from cell to cell."""
    offsets, member, first, last, gain = pairs
    for j in range(offsets[k], offsets[k + 1]):
        above = sign * max(gain[j] - price[member[j]], 0)
        takings[first[j]] += above
        takings[last[j] + 1] -= above


@kernel
def _takings(k, local, price, takings):
    """Fill what each cell of the k-th camera takes; return the most and its cell."""
    takings[:] = local.fixed[local.cell_offsets[k] : local.cell_offsets[k + 1]]
    _add_above(k, local.gains, price, 1, takings)
    _add_above(k, local.blurred, price, -1, takings)
    best, where, total = np.int64(-1), 0, np.int64(0)
    for i in range(len(takings) - 1):
        total += takings[i]
        takings[i] = total
        if total > best:
            best, where = total, i
    return best, where


@kernel
def _serve(k, pairs, price, top, sign, slope):
    """Lower, or raise, the slopes of the samples that the k-th camera's cell takes."""
    offsets, member, first, last, gain = pairs
    for j in range(offsets[k], offsets[k + 1]):
        i = member[j]
        held = (first[j] <= top) & (top <= last[j]) & (gain[j] > price[i])
        slope[i] -= sign * held


@kernel
def _price(local, pairs, price, slope):
    """Return what the prices themselves add to the bound; fill its subgradient."""
    offsets, gain = pairs.blurred_views
    total = np.int64(0)
    for i in range(len(price)):
        p = local.sample[i]
        total += pairs.views * price[i]
        slope[i] = pairs.views
        for b in range(offsets[p], offsets[p + 1]):
            if gain[b] > price[i]:
                total += gain[b] - price[i]
                slope[i] -= 1.0
    return total


@kernel
def _bound(local, pairs, price, takings, chosen, slope):
    """Return the local bound at these prices; fill its subgradient, and count the best cells."""
    cell_offsets = local.cell_offsets
    bound = _price(local, pairs, price, slope)
    for k in range(len(cell_offsets) - 1):
        if cell_offsets[k + 1] == cell_offsets[k]:
            continue
        value, top = _takings(k, local, price, takings[cell_offsets[k] : cell_offsets[k + 1]])
        bound += value
        chosen[cell_offsets[k] + top] += 1
        _serve(k, local.gains, price, top, 1, slope)
        _serve(k, local.blurred, price, top, -1, slope)
    return bound


@kernel
def _step(local, most, slope, direction, aim, price):
    """Move prices against the direction, turned to the subgradient, to lower the bound by aim."""
    square = 0.0
    for i in range(len(price)):
        direction[i] += (1.0 - _MOMENTUM) * (slope[i] - direction[i])
        square += direction[i] * direction[i]
    step = aim / max(square, 1e-9)
    for i in range(len(price)):
        moved = price[i] - np.int64(np.rint(step * direction[i]))
        price[i] = min(max(moved, local.floor[i]), most[local.sample[i]])


@kernel
def _adapt(local, pairs, most, base, goal, iterations, price, chosen):
    """Adapt the free prices by subgradient steps; return the node's bound, ``base`` at first.

    ``price`` (F,) becomes the best found; ``chosen`` counts how often each cell was the best.
    """
    now, takings = price.copy(), np.empty(len(chosen), dtype=np.int64)
    direction, slope = np.zeros(len(price)), np.empty(len(price))
    best, reference, start = np.int64(2**62), np.int64(2**62), np.int64(0)
    hope, since = 0.0, 0
    work = local.gains.offsets[-1] + len(chosen) + len(price) + 1
    for iteration in range(min(iterations, max(_FEWEST_STEPS, _WORK // work))):
        bound = _bound(local, pairs, now, takings, chosen, slope)
        if iteration == 0:
            start = reference = bound
            hope = max(0.3 * (base - goal), _BEYOND * base)
        if bound < best:
            best = bound
            price[:] = now
        if base + best - start <= goal:
            break
        if best <= reference - _PROGRESS * hope:
            reference, since = best, 0
        else:
            since += 1
        if since < _PATIENCE:
            _step(local, most, slope, direction, bound - best + hope, now)
        else:
            hope *= _FALL
            reference, since = best, 0
            now[:] = price
            direction[:] = 0
    return base + best - start


@kernel
def _split(c, a, b, value, slack, takings, chosen, node):
    """Choose where to split camera c's cells a to b, and score that.

    Between two cells that were each best at times, at the least that lies between them.
    """
    total, past, previous, least, where = 0, 0, -1, value, 0
    for i in range(a, b + 1):
        total += chosen[i]
    for i in range(a, b + 1):
        if previous >= 0 and takings[i] <= least:
            least, where = takings[i], i
        if chosen[i] > 0:
            if previous >= 0:
                worth = min(past, total - past) * (value - least + slack // 1024)
                if worth > node.score[c]:
                    node.score[c] = worth
                    node.split[c] = node.low[c] + min(max(where, previous), i - 1)
            past += chosen[i]
            previous, least, where = i, value, i


@kernel
def _report(cameras, local, price, chosen, slack, node):
    """Report each camera's best cell and where to split it; cut off ends that no plan can use."""
    takings, cell_offsets = np.empty(len(chosen), dtype=np.int64), local.cell_offsets
    low, high = node.low, node.high
    for k in range(len(cameras)):
        c = cameras[k]
        node.score[c] = 0
        if high[c] < low[c]:
            continue
        part = slice(cell_offsets[k], cell_offsets[k + 1])
        value, top = _takings(k, local, price, takings[part])
        # Where the best prices serve each sample once, these cells are a plan that gains as much.
        node.cell[c] = low[c] + top
        if high[c] == low[c]:
            continue
        a, b = cell_offsets[k], cell_offsets[k] + high[c] - low[c]
        while takings[a] < value - slack:
            a += 1
        while takings[b] < value - slack:
            b -= 1
        a, b = a - cell_offsets[k], b - cell_offsets[k]
        _split(c, a, b, value, slack, takings[part], chosen[part], node)
        high[c] = low[c] + b
        low[c] = low[c] + a


@kernel
def _tighten(node, base, cameras, pairs, by_sample, goal, reach, iterations):
    """Lower a node's bound, ``base`` at its prices, by the prices around cameras; return it.

    The cameras lose the ends of their ranges that no plan above ``goal`` can use.
    """
    local = _empty_local(node, cameras, pairs)
    count = _gather(node, cameras, pairs, by_sample, reach, local)
    sample, chosen = local.sample[:count], np.zeros(len(local.fixed), dtype=np.int64)
    price = node.price[sample]
    bound = _adapt(local, pairs, by_sample.most, base, goal, iterations, price, chosen)
    node.price[sample] = price
    if bound > goal:
        _report(cameras, local, price, chosen, bound - goal, node)
    return bound


@kernel
def _add_clipped(c, gains, low, high, price, sign, steps):
    """Add, or take away, what camera c takes, as differences from cell ``low`` to ``high``."""
    offsets, sample, gain, first, last = gains
    for j in range(offsets[c], offsets[c + 1]):
        above = gain[j] - price[sample[j]]
        if above > 0 and first[j] <= high and last[j] >= low:
            steps[max(first[j], low) - low] += sign * above
            steps[min(last[j], high) - low + 1] -= sign * above


@kernel
def _most_taken(c, pairs, low, high, price):
    """Return the most that one of the cells ``low`` to ``high`` of camera c takes."""
    steps = np.zeros(high - low + 2, dtype=np.int64)
    _add_clipped(c, pairs.gains, low, high, price, 1, steps)
    _add_clipped(c, pairs.blurred, low, high, price, -1, steps)
    best, total = np.int64(-1), np.int64(0)
    for i in range(high - low + 1):
        total += steps[i]
        best = max(best, total)
    return best


@kernel
def _confine(b, cuts, near, pairs, by_sample, nodes, goal, reach, iterations):
    """Confine one camera of node b, and bound what is left; return the bound."""
    low, high, price = nodes.low[b], nodes.high[b], nodes.price[b]
    c, bound = cuts.camera[b], nodes.bound[b]
    if c >= 0:
        bound -= _most_taken(c, pairs, low[c], high[c], price)
        low[c], high[c] = cuts.first[b], cuts.last[b]
        bound += _most_taken(c, pairs, low[c], high[c], price)
    if bound <= goal:
        return bound
    if cuts.wide[b]:
        cameras = np.arange(len(low)).astype(np.int32)
    else:
        cameras = near.camera[near.offsets[c] : near.offsets[c + 1]].copy()
    node = _Node(low, high, price, nodes.score[b], nodes.split[b], nodes.cell[b])
    return _tighten(node, bound, cameras, pairs, by_sample, goal, reach, iterations)


@parallel_kernel
def confine(cuts, near, pairs, by_sample, nodes, goal, reach, iterations):
    """Confine one camera of each node to some of its cells, and bound what is left.

    Parameters
    ----------
    cuts : Cuts
    near : Neighbourhoods
    pairs : PricedPairs
    by_sample : GainsBySample
    nodes : Nodes
        At first copies of the parents, with bounds that are exact at their prices.
    goal : int
        Units; nodes that cannot gain more need no better bound.
    reach : int
        Pairs that gain less than the price by 2^-reach of the sample's most are left out.
    iterations : int
        The most price steps per node.
    """
    bound = nodes.bound
    for b in prange(len(bound)):
        bound[b] = _confine(b, cuts, near, pairs, by_sample, nodes, goal, reach, iterations)


@kernel
def gains_by_sample(by_camera, by_sample):
    """Fill ``by_sample`` with the gains of ``by_camera``, but for ``most``: a counting sort."""
    offsets, sample, gain, _, _ = by_camera
    sample_offsets, camera, sorted_gain, _ = by_sample
    sample_offsets[:] = 0
    for p in sample:
        sample_offsets[p + 1] += 1
    for p in range(len(sample_offsets) - 1):
        sample_offsets[p + 1] += sample_offsets[p]
    at = sample_offsets[:-1].copy()
    for c in range(len(offsets) - 1):
        for j in range(offsets[c], offsets[c + 1]):
            p = sample[j]
            camera[at[p]], sorted_gain[at[p]] = c, gain[j]
            at[p] += 1
