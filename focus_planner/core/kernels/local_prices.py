# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Prices around some cameras of a node of the search, adapted to what these may be set to."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from focus_planner.core.arrays import IntArray, Offsets
from focus_planner.core.kernels.above import room_above, take_best_cell
from focus_planner.core.kernels.arrays import GainsByCamera
from focus_planner.core.kernels.compiling import kernel
from focus_planner.core.kernels.stabbing import best_cells, best_with_each, intervals_above

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


class Node(NamedTuple):
    """One row of :class:`Nodes`, without its bound."""

    low: IntArray
    high: IntArray
    price: Offsets
    score: Offsets
    split: IntArray
    cell: IntArray


class Local(NamedTuple):
    """What n cameras' bound depends on: their pairs with the F samples whose prices are free.

    ``gains`` and ``blurred`` are such pairs of the k-th camera, with those samples' numbers instead
    of samples, clipped to its cells, which are counted from the first that any shot of its view may
    be set to. The k-th itself may be set to ``low[k]`` to ``high[k]``.

    ``place`` (N,) of a sample is its number, -1 if none of the cameras sees it, -2 if its price is
    held. ``sample`` (F,) are the samples, and ``floor`` their least prices. ``fixed`` is what
    samples with held prices add, as differences from cell to cell; the k-th camera's part is
    ``cell_offsets[k]`` to ``cell_offsets[k + 1]``, one longer than its cells.
    """

    gains: GainsByCamera
    blurred: GainsByCamera
    low: IntArray
    high: IntArray
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
    return GainsByCamera(
        np.zeros(len(cameras) + 1, dtype=np.int64),
        np.empty(pairs, dtype=np.int32),
        np.empty(pairs, dtype=np.int64),
        np.empty(pairs, dtype=np.int32),
        np.empty(pairs, dtype=np.int32),
    )


@kernel
def _span(c, node, shots):
    """Return the first and the last cell that any shot of camera c's view may be set to."""
    first = c - c % shots
    return node.low[first : first + shots].min(), node.high[first : first + shots].max()


@kernel
def empty_local(node, cameras, pairs):
    """Return room for a local problem, with what the cameras may be set to."""
    n, samples = len(cameras), len(node.price)
    cell_offsets = np.zeros(n + 1, dtype=np.int64)
    low, high = np.empty(n, dtype=np.int32), np.empty(n, dtype=np.int32)
    for k in range(n):
        c = cameras[k]
        a, b = _span(c, node, pairs.shots)
        low[k], high[k] = node.low[c] - a, node.high[c] - a
        cell_offsets[k + 1] = cell_offsets[k] + (b - a + 2 if b >= a else 0)
    return Local(
        _room(cameras, pairs.gains.offsets),
        _room(cameras, pairs.blurred.offsets),
        low,
        high,
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
def _clip(k, c, span, node, gains, sign, most, reach, local, clipped):
    """Append the pairs of the k-th camera, c, to those clipped to its span of cells.

    What samples with held prices take is added to what is fixed, or taken away from it.
    """
    offsets, sample, gain, first, last = gains
    part = local.fixed[local.cell_offsets[k] : local.cell_offsets[k + 1]]
    (a, b), price, at = span, node.price, clipped.offsets[k]
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
            clipped.sample[at], clipped.gain[at] = member, gain[j]
            clipped.first[at], clipped.last[at] = max(first[j], a) - a, min(last[j], b) - a
            at += 1
        elif gain[j] > local.floor[member]:
            local.floor[member] = gain[j]
    clipped.offsets[k + 1] = at


@kernel
def gather(node, cameras, pairs, by_sample, reach, local):
    """Fill a local problem; return how many samples' prices are free."""
    count = _place(node, cameras, pairs.gains, by_sample, local)
    for k in range(len(cameras)):
        c = cameras[k]
        if c % pairs.shots == 0:
            span = _span(c, node, pairs.shots)
            _clip(k, c, span, node, pairs.gains, 1, by_sample.most, reach, local, local.gains)
            # A pair that gains out of focus gains more in focus: its sample has its place.
            _clip(k, c, span, node, pairs.blurred, -1, by_sample.most, reach, local, local.blurred)
        else:  # the same as of the view's first shot
            local.gains.offsets[k + 1] = local.gains.offsets[k]
            local.blurred.offsets[k + 1] = local.blurred.offsets[k]
    return count


@kernel
def _add_above(k, pairs, price, sign, takings):
    """Add, or take away, what the k-th camera's pairs take, as differences from cell to cell."""
    offsets, member, gain, first, last = pairs
    for j in range(offsets[k], offsets[k + 1]):
        above = sign * max(gain[j] - price[member[j]], 0)
        takings[first[j]] += above
        takings[last[j] + 1] -= above


@kernel
def takings_of(k, local, price, takings):
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
def _best_of_view(k, local, price, cells):
    """Fill the cells of the k-th and the following shots that take most; return how much."""
    count, shots = local.cell_offsets[k + 1] - local.cell_offsets[k] - 1, len(cells)
    return best_cells(
        intervals_above(k, local.gains, local.blurred, price),
        local.low[k : k + shots],
        local.high[k : k + shots],
        count,
        cells,
    )


@kernel
def takings_of_view(k, local, price, takings, cells):
    """Fill what a view takes with each cell of each shot; return the most, and fill its cells."""
    begin, shots = local.cell_offsets[k], len(cells)
    count = local.cell_offsets[k + 1] - begin - 1
    each = np.empty((shots, count), dtype=np.int64)
    best_with_each(
        intervals_above(k, local.gains, local.blurred, price),
        local.low[k : k + shots],
        local.high[k : k + shots],
        each,
    )
    for shot in range(shots):
        at = begin + shot * (count + 1)
        takings[at : at + count] = each[shot]
    return _best_of_view(k, local, price, cells)


@kernel
def _serve(k, pairs, price, cell, before, sign, served):
    """Count the samples that the k-th camera's cell takes, with a sign.

    But not those that the cell ``before``, which lies below it, takes as well; -1 for none.
    """
    offsets, member, gain, first, last = pairs
    for j in range(offsets[k], offsets[k + 1]):
        i = member[j]
        held = (before < first[j]) & (first[j] <= cell) & (cell <= last[j]) & (gain[j] > price[i])
        served[i] += sign * held


@kernel
def _price(local, pairs, price, served):
    """Return what the prices themselves add to the bound, with the views out of focus it counts."""
    offsets, gain = pairs.blurred_views
    total = pairs.views * price.sum()
    served[:] = 0
    if len(gain) == 0:
        return total
    for i in range(len(price)):
        p = local.sample[i]
        for b in range(offsets[p], offsets[p + 1]):
            if gain[b] > price[i]:
                total += gain[b] - price[i]
                served[i] += 1
    return total


@kernel
def _bound(local, pairs, price, takings, above, chosen, served):
    """Return the local bound at these prices; count who takes each sample, and the best cells."""
    cell_offsets, shots = local.cell_offsets, pairs.shots
    bound = _price(local, pairs, price, served)
    cells = np.empty(shots, dtype=np.int32)
    for k in range(0, len(cell_offsets) - 1, shots):
        begin, end = cell_offsets[k], cell_offsets[k + 1]
        if end == begin:
            continue
        if shots == 1:
            part = takings[begin:end]
            part[:] = local.fixed[begin:end]
            bound += take_best_cell(
                k, local.gains, local.blurred, price, part, above, chosen[begin:end], served
            )
            continue
        bound += _best_of_view(k, local, price, cells)
        before = -1
        for shot in range(shots):
            cell = cells[shot]
            chosen[cell_offsets[k + shot] + cell] += 1
            _serve(k, local.gains, price, cell, before, 1, served)
            _serve(k, local.blurred, price, cell, before, -1, served)
            before = cell
    return bound


@kernel
def _step(floor, most, views, served, direction, aim, price):
    """Move prices against the direction, turned to the subgradient, to lower the bound by aim."""
    square = 0.0
    for i in range(len(price)):
        direction[i] += (1.0 - _MOMENTUM) * (views - served[i] - direction[i])
        square += direction[i] * direction[i]
    step = aim / max(square, 1e-9)
    for i in range(len(price)):
        moved = price[i] - np.int64(np.rint(step * direction[i]))
        price[i] = min(max(moved, floor[i]), most[i])


@kernel
def adapt(local, pairs, most, base, goal, iterations, price, chosen):
    """Adapt the free prices by subgradient steps; return the node's bound, ``base`` at first.

    ``price`` (F,) becomes the best found; ``chosen`` counts how often each cell was the best.
    """
    now, takings = price.copy(), np.empty(len(chosen), dtype=np.int64)
    direction, served = np.zeros(len(price)), np.empty(len(price))
    above = room_above(local.gains.offsets[-1] + local.blurred.offsets[-1])
    floor, own_most = local.floor[: len(price)], most[local.sample[: len(price)]]
    best, reference, start = np.int64(2**62), np.int64(2**62), np.int64(0)
    hope, since = 0.0, 0
    work = local.gains.offsets[-1] + len(chosen) + len(price) + 1
    for iteration in range(min(iterations, max(_FEWEST_STEPS, _WORK // work))):
        bound = _bound(local, pairs, now, takings, above, chosen, served)
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
            _step(floor, own_most, pairs.views, served, direction, bound - best + hope, now)
        else:
            hope *= _FALL
            reference, since = best, 0
            now[:] = price
            direction[:] = 0
    return base + best - start
