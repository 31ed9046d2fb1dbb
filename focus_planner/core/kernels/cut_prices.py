# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Prices of samples and of cuts, adapted together (docs/algorithm.md).

With cuts Σ x ≤ limit + Σ Y of multipliers λ ≥ 0 no plan gains more than

    D(v, λ) = Σ_p v_p + Σ_k limit_k λ_k + Σ_c max_j [
                  Σ_{p held by cell j of c} (g − v_p − Σ_{k ∋ pc} λ_k)⁺ + Σ_{k: j ∈ U_kc} λ_k].

A local problem has some of the cameras, and those prices and multipliers that no other camera's
part depends on; with all cameras, it is the whole. All is in whole units, so D is exact.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from focus_planner.core.arrays import FloatArray, IntArray, Offsets
from focus_planner.core.kernels.arrays import GainsByCamera
from focus_planner.core.kernels.compiling import kernel

_MOMENTUM = 0.8
_PROGRESS = 0.25
_GROWTH = 1.5
_FALL = 0.7
# The averages of the last steps, one over so many, are a fractional solution.
_AVERAGED = 0.03


class CutPool(NamedTuple):
    """K cuts: Σ x of their pairs ≤ limit + Σ Y of their ranges, in every plan.

    x is 1 for a pair of a camera and a sample that is assigned to it in focus, and Y for a range
    of cells that has the camera's cell; else they are 0.

    Attributes
    ----------
    limit : (K,) array of int64
    pair_offsets : (K + 1,) array of int64
        Cut k's pairs are ``pair_offsets[k]`` to ``pair_offsets[k + 1]``.
    pair : (E,) array of int64
        Their places among all that gain, see :class:`GainsByCamera`. One may be there twice.
    range_offsets : (K + 1,) array of int64
        Cut k's ranges are ``range_offsets[k]`` to ``range_offsets[k + 1]``.
    camera, first, last : (R,) arrays of int32
        Of each range.
    """

    limit: Offsets
    pair_offsets: Offsets
    pair: Offsets
    range_offsets: Offsets
    camera: IntArray
    first: IntArray
    last: IntArray


class CutNode(NamedTuple):
    """What cameras may be set to, and what proves its bound.

    ``low``, ``high`` (C,) are each camera's first and last cell, low > high if it has none;
    ``price`` (N,) and ``multiplier`` (K,) are units.
    """

    low: IntArray
    high: IntArray
    price: Offsets
    multiplier: Offsets


class Whole(NamedTuple):
    """What all nodes share.

    ``gains`` are all pairs, ``camera`` (G,) those of each, ``by_sample`` (G,) their places sample
    by sample, sample p's from ``sample_offsets[p]`` on, and ``most`` (N,) the samples' largest.
    """

    gains: GainsByCamera
    camera: IntArray
    sample_offsets: Offsets
    by_sample: Offsets
    most: Offsets
    cell_offsets: Offsets


class LocalCuts(NamedTuple):
    """What n cameras' bound depends on: F free prices and L free multipliers.

    ``gains`` are pairs of the k-th camera with numbers of free prices instead of samples, their
    cells counted from ``low`` of the node; number F, of price 0, stands for samples whose prices
    are held, and their gains are less these. ``pair`` are their places among all. ``sample`` (F,)
    and ``floor`` (F + 1,) are the samples and the least prices, ``cut`` (L,) the free cuts;
    ``pairs`` of the l-th, places among those here, are ``pair_offsets[l]`` to
    ``pair_offsets[l + 1]``, and ``ranges`` of the k-th camera ``range_offsets[k]`` to
    ``range_offsets[k + 1]``: the cut's number, its first and its last cell. ``fixed`` is what all
    else adds, as differences from cell to cell; the k-th camera's part is ``cell_offsets[k]`` to
    ``cell_offsets[k + 1]``, one longer than its cells, of which the first is
    number ``origin[k]`` of all cells; ``low`` (n,) is 0.
    """

    gains: GainsByCamera
    pair: Offsets
    sample: IntArray
    floor: Offsets
    cut: IntArray
    limit: Offsets
    pair_offsets: Offsets
    pairs: IntArray
    range_offsets: Offsets
    ranges: IntArray
    fixed: Offsets
    cell_offsets: Offsets
    origin: Offsets
    low: IntArray


class FractionalPlan(NamedTuple):
    """A fractional solution: ``held`` (G,) of pairs, ``stands`` (M,) of cells, 0 to 1."""

    held: FloatArray
    stands: FloatArray


@kernel
def _sort_cuts(node, cuts, whole, slot, extra):
    """Return the free cuts; add the multipliers of all others to their pairs' ``extra`` (G,)."""
    pair_offsets, pair, camera = cuts.pair_offsets, cuts.pair, whole.camera
    range_offsets, ranged, multiplier = cuts.range_offsets, cuts.camera, node.multiplier
    free = np.empty(len(multiplier), dtype=np.int32)
    count = 0
    for k in range(len(multiplier)):
        inside = True
        for r in range(range_offsets[k], range_offsets[k + 1]):
            inside &= slot[ranged[r]] >= 0
        for e in range(pair_offsets[k], pair_offsets[k + 1]):
            inside &= slot[camera[pair[e]]] >= 0
        if inside:
            free[count] = k
            count += 1
        elif multiplier[k] > 0:
            for e in range(pair_offsets[k], pair_offsets[k + 1]):
                extra[pair[e]] += multiplier[k]
    return free[:count]


@kernel
def _add_range(first, last, low, high, weight, part):
    """Add what a range adds, as differences between the cells ``low`` to ``high``."""
    if first <= high and last >= low:
        part[max(first, low) - low] += weight
        part[min(last, high) - low + 1] -= weight


@kernel
def _fix_ranges(node, cuts, slot, free, cell_offsets, fixed):
    """Add the ranges of cuts that are not free to what is fixed."""
    is_free = np.zeros(len(cuts.limit), dtype=np.bool_)
    is_free[free] = True
    for k in range(len(cuts.limit)):
        if is_free[k] or node.multiplier[k] == 0:
            continue
        for r in range(cuts.range_offsets[k], cuts.range_offsets[k + 1]):
            c = cuts.camera[r]
            if slot[c] >= 0 and node.low[c] <= node.high[c]:
                part = fixed[cell_offsets[slot[c]] : cell_offsets[slot[c] + 1]]
                weight = node.multiplier[k]
                _add_range(cuts.first[r], cuts.last[r], node.low[c], node.high[c], weight, part)


@kernel
def _place(cameras, node, whole, slot, extra, place, sample, floor):
    """Find the samples that cameras gain from, and whose prices are free; return how many are.

    A sample's price is free if no other camera takes anything above it. ``place`` (N,) becomes its
    number, -2 if the price is held.
    """
    offsets, member, gain, _, _ = whole.gains
    sample_offsets, by_sample, camera, price = (
        whole.sample_offsets,
        whole.by_sample,
        whole.camera,
        node.price,
    )
    count = 0
    for c in cameras:
        for j in range(offsets[c], offsets[c + 1]):
            p = member[j]
            if place[p] != -1:
                continue
            least = np.int64(0)
            for q in range(sample_offsets[p], sample_offsets[p + 1]):
                other = by_sample[q]
                if slot[camera[other]] < 0:
                    least = max(least, gain[other] - extra[other])
            if least > price[p]:
                place[p] = -2
            else:
                place[p], sample[count], floor[count] = count, p, least
                count += 1
    return count


@kernel
def _clip(cameras, node, whole, extra, reach, place, is_cut, count, floor, cell_offsets, fixed):
    """Return the cameras' pairs that are active, and their places among all.

    Those with held prices that no free cut has are added to what is fixed.
    """
    offsets, sample, gain, first, last = whole.gains
    most, price = whole.most, node.price
    room = 0
    for c in cameras:
        room += offsets[c + 1] - offsets[c]
    own = np.zeros(len(cameras) + 1, dtype=np.int64)
    member, own_first, own_last = np.empty((3, room), dtype=np.int32)
    own_gain, pair = np.empty((2, room), dtype=np.int64)
    at = 0
    for k in range(len(cameras)):
        c = cameras[k]
        low, high = node.low[c], node.high[c]
        part = fixed[cell_offsets[k] : cell_offsets[k + 1]]
        for j in range(offsets[c], offsets[c + 1]):
            if first[j] > high or last[j] < low:
                continue
            p = sample[j]
            number, above = place[p], gain[j] - extra[j]
            if number == -2:
                above -= price[p]
                if above <= 0:
                    continue
                if not is_cut[j]:
                    _add_range(first[j], last[j], low, high, above, part)
                    continue
                number = count
            elif above <= price[p] - (most[p] >> reach):
                floor[number] = max(floor[number], above)
                continue
            member[at], own_gain[at], pair[at] = number, above, j
            own_first[at], own_last[at] = max(first[j], low) - low, min(last[j], high) - low
            at += 1
        own[k + 1] = at
    gains = GainsByCamera(own, member[:at], own_gain[:at], own_first[:at], own_last[:at])
    return gains, pair[:at]


@kernel
def _pairs_of_cuts(free, cuts, position):
    """Return the free cuts' pairs, as places among those here."""
    begins, pair = cuts.pair_offsets, cuts.pair
    offsets = np.zeros(len(free) + 1, dtype=np.int64)
    room = 0
    for k in free:
        room += begins[k + 1] - begins[k]
    pairs = np.empty(room, dtype=np.int32)
    at = 0
    for i in range(len(free)):
        k = free[i]
        for e in range(begins[k], begins[k + 1]):
            if position[pair[e]] >= 0:
                pairs[at] = position[pair[e]]
                at += 1
        offsets[i + 1] = at
    return offsets, pairs[:at]


@kernel
def _ranges_of_cuts(free, cuts, node, slot, count):
    """Return the free cuts' ranges camera by camera: the cut's number, its first and last cell."""
    begins, camera, first, last = cuts.range_offsets, cuts.camera, cuts.first, cuts.last
    low, high = node.low, node.high
    offsets = np.zeros(count + 2, dtype=np.int64)
    for k in free:
        for r in range(begins[k], begins[k + 1]):
            c = camera[r]
            offsets[slot[c] + 2] += first[r] <= high[c] and last[r] >= low[c]
    for k in range(count):
        offsets[k + 2] += offsets[k + 1]
    ranges = np.empty((offsets[count + 1], 3), dtype=np.int32)
    for i in range(len(free)):
        for r in range(begins[free[i]], begins[free[i] + 1]):
            c = camera[r]
            if first[r] <= high[c] and last[r] >= low[c]:
                at = offsets[slot[c] + 1]
                offsets[slot[c] + 1] += 1
                ranges[at, 0] = i
                ranges[at, 1] = max(first[r], low[c]) - low[c]
                ranges[at, 2] = min(last[r], high[c]) - low[c]
    return offsets[: count + 1].copy(), ranges


@kernel
def gather_cuts(cameras, node, cuts, whole, reach):
    """Return the local problem of some cameras of a node.

    Pairs that gain less than the price by more than 2^-reach of the sample's most are left out.
    """
    count, pairs = len(cameras), len(whole.camera)
    slot = np.full(len(node.low), -1, dtype=np.int32)
    cell_offsets, origin = np.zeros(count + 1, dtype=np.int64), np.empty(count, dtype=np.int64)
    for k in range(count):
        c = cameras[k]
        slot[c], origin[k] = k, whole.cell_offsets[c] + node.low[c]
        cells = node.high[c] - node.low[c] + 1
        cell_offsets[k + 1] = cell_offsets[k] + (cells + 1 if cells > 0 else 0)
    fixed, extra = np.zeros(cell_offsets[count], dtype=np.int64), np.zeros(pairs, dtype=np.int64)
    free = _sort_cuts(node, cuts, whole, slot, extra)
    _fix_ranges(node, cuts, slot, free, cell_offsets, fixed)
    place = np.full(len(node.price), -1, dtype=np.int32)
    sample = np.empty(len(node.price), dtype=np.int32)
    floor = np.zeros(len(node.price) + 1, dtype=np.int64)
    prices = _place(cameras, node, whole, slot, extra, place, sample, floor)
    floor[prices] = 0
    is_cut = np.zeros(pairs, dtype=np.bool_)
    for k in free:
        is_cut[cuts.pair[cuts.pair_offsets[k] : cuts.pair_offsets[k + 1]]] = True
    gains, pair = _clip(
        cameras, node, whole, extra, reach, place, is_cut, prices, floor, cell_offsets, fixed
    )
    position = np.full(pairs, -1, dtype=np.int32)
    for i in range(len(pair)):
        position[pair[i]] = i
    pair_offsets, own_pairs = _pairs_of_cuts(free, cuts, position)
    range_offsets, ranges = _ranges_of_cuts(free, cuts, node, slot, count)
    return LocalCuts(
        gains,
        pair,
        sample[:prices],
        floor[: prices + 1],
        free,
        cuts.limit[free],
        pair_offsets,
        own_pairs,
        range_offsets,
        ranges,
        fixed,
        cell_offsets,
        origin,
        np.zeros(count, dtype=np.int32),
    )


@kernel
def spread(local, multiplier, extra):
    """Fill ``extra``, by how much free multipliers lower what each pair here gains."""
    offsets, pairs = local.pair_offsets, local.pairs
    extra[:] = 0
    for i in range(len(multiplier)):
        if multiplier[i] > 0:
            for e in range(offsets[i], offsets[i + 1]):
                extra[pairs[e]] += multiplier[i]


@kernel
def takings_with_cuts(k, local, price, multiplier, extra, takings):
    """Fill what each cell of the k-th camera takes; return the most and its cell."""
    offsets, member, gain, first, last = local.gains
    range_offsets, ranges = local.range_offsets, local.ranges
    takings[:] = local.fixed[local.cell_offsets[k] : local.cell_offsets[k + 1]]
    for j in range(offsets[k], offsets[k + 1]):
        above = max(gain[j] - price[member[j]] - extra[j], 0)
        takings[first[j]] += above
        takings[last[j] + 1] -= above
    for r in range(range_offsets[k], range_offsets[k + 1]):
        weight = multiplier[ranges[r, 0]]
        takings[ranges[r, 1]] += weight
        takings[ranges[r, 2] + 1] -= weight
    best, where, total = np.int64(-1), 0, np.int64(0)
    for i in range(len(takings) - 1):
        total += takings[i]
        takings[i] = total
        if total > best:
            best, where = total, i
    return best, where


@kernel
def _count_taken(k, cell, local, price, extra, taken, slope):
    """Mark the pairs that the k-th camera's cell takes, and lower their prices' slopes."""
    offsets, member, gain, first, last = local.gains
    for j in range(offsets[k], offsets[k + 1]):
        i = member[j]
        held = (first[j] <= cell) & (cell <= last[j]) & (gain[j] > price[i] + extra[j])
        taken[j] = held
        slope[i] -= held


@kernel
def _bound(local, price, multiplier, extra, takings, chosen, taken, slope, slack):
    """Return the local bound; fill its subgradient, ``slope`` and ``slack``, and the best cells."""
    cell_offsets, limit = local.cell_offsets, local.limit
    bound = price.sum()
    slope[:] = 1.0
    spread(local, multiplier, extra)
    for i in range(len(multiplier)):
        bound += limit[i] * multiplier[i]
        slack[i] = limit[i]
    for k in range(len(cell_offsets) - 1):
        chosen[k] = -1
        if cell_offsets[k + 1] == cell_offsets[k]:
            continue
        part = takings[cell_offsets[k] : cell_offsets[k + 1]]
        value, cell = takings_with_cuts(k, local, price, multiplier, extra, part)
        bound += value
        chosen[k] = cell
        _count_taken(k, cell, local, price, extra, taken, slope)
    _count_slack(local, chosen, taken, slack)
    return bound


@kernel
def _count_slack(local, chosen, taken, slack):
    """Add the ranges that have their camera's cell to the cuts' slacks; take pairs away."""
    range_offsets, ranges = local.range_offsets, local.ranges
    pair_offsets, pairs = local.pair_offsets, local.pairs
    for k in range(len(chosen)):
        for r in range(range_offsets[k], range_offsets[k + 1]):
            slack[ranges[r, 0]] += (ranges[r, 1] <= chosen[k]) & (chosen[k] <= ranges[r, 2])
    for i in range(len(slack)):
        for e in range(pair_offsets[i], pair_offsets[i + 1]):
            slack[i] -= taken[pairs[e]]


@kernel
def _turn(slope, slack, multiplier, direction, turned):
    """Turn the directions to the subgradient; return the sum of their squares."""
    square = 0.0
    for i in range(len(slope) - 1):
        direction[i] += (1.0 - _MOMENTUM) * (slope[i] - direction[i])
        square += direction[i] * direction[i]
    for i in range(len(slack)):
        turned[i] += (1.0 - _MOMENTUM) * (slack[i] - turned[i])
        if multiplier[i] > 0 or turned[i] < 0:
            square += turned[i] * turned[i]
    return square


@kernel
def _move(local, most, step, direction, turned, price, multiplier):
    """Move prices and multipliers by a step against their directions."""
    floor, sample = local.floor, local.sample
    for i in range(len(direction) - 1):
        moved = price[i] - np.int64(np.rint(step * direction[i]))
        price[i] = min(max(moved, floor[i]), most[sample[i]])
    for i in range(len(turned)):
        multiplier[i] = max(multiplier[i] - np.int64(np.rint(step * turned[i])), 0)


@kernel
def _count_chosen(cell_offsets, chosen, count):
    """Count the cells that were best."""
    for k in range(len(chosen)):
        if chosen[k] >= 0:
            count[cell_offsets[k] + chosen[k]] += 1


@kernel
def _average(pair, taken, origin, chosen, weight, averages):
    """Add what a step chose to the averages, with a weight."""
    held, stands = averages
    for j in range(len(pair)):
        held[pair[j]] += weight * taken[j]
    for k in range(len(chosen)):
        if chosen[k] >= 0:
            stands[origin[k] + chosen[k]] += weight


class Steps(NamedTuple):
    """How subgradient steps adapt.

    ``most`` is how many there are at most. A step aims ``hope`` units below the best so far, at
    first, and this part, ``beyond``, of the bound below the goal at most; after ``patience`` steps
    without progress hope falls, and steps go on from the best. So much per price, ``damped``, is
    added to the squares of the direction: as directions become short, steps would become long, and
    what they choose would no longer average to a solution.
    """

    most: int
    hope: float
    beyond: float
    patience: int
    damped: float


@kernel
def adapt_cuts(local, most, base, goal, steps, price, multiplier, count, averages):
    """Adapt prices and multipliers by subgradient steps; return the bound, ``base`` at first.

    Parameters
    ----------
    local : LocalCuts
    most : (N,) array of int64
    base, goal : int
        Units; steps end when the bound is at the goal.
    steps : Steps
    price : (F + 1,) array of int64
        Becomes the best found; the last is 0.
    multiplier : (L,) array of int64
        Becomes the best found.
    count : array of int64
        As long as ``local.fixed``: counts how often each cell was best.
    averages : FractionalPlan
        Moves towards what the steps choose; without any pairs, none are kept.
    """
    now, now_of_cuts = price.copy(), multiplier.copy()
    pairs, cameras = len(local.pair), len(local.cell_offsets) - 1
    extra, takings = np.zeros(pairs, dtype=np.int64), np.empty(len(local.fixed), dtype=np.int64)
    chosen, taken = np.empty(cameras, dtype=np.int64), np.zeros(pairs, dtype=np.int8)
    slope, slack = np.empty(len(price)), np.empty(len(multiplier))
    direction, turned = np.zeros(len(price)), np.zeros(len(multiplier))
    best = reference = start = np.int64(2**62)
    hope, since, total = steps.hope, 0, 1.0
    for step in range(steps.most):
        bound = _bound(local, now, now_of_cuts, extra, takings, chosen, taken, slope, slack)
        _count_chosen(local.cell_offsets, chosen, count)
        if len(averages.held) > 0:
            total /= 1.0 - _AVERAGED
            _average(local.pair, taken, local.origin, chosen, total * _AVERAGED, averages)
        if step == 0:
            start = bound
        if bound < best:
            best = bound
            price[:] = now
            multiplier[:] = now_of_cuts
        left = base + best - start - goal
        if left <= 0:
            break
        aim = min(hope, left + steps.beyond * base)
        if best <= reference - _PROGRESS * aim:
            reference, since, hope = best, 0, _GROWTH * aim
        else:
            since += 1
        if since < steps.patience:
            square = _turn(slope, slack, now_of_cuts, direction, turned)
            length = (bound - best + hope) / (square + steps.damped * len(price) + 1e-9)
            _move(local, most, length, direction, turned, now, now_of_cuts)
        else:
            hope, reference, since = _FALL * aim, best, 0
            now[:] = price
            now_of_cuts[:] = multiplier
            direction[:] = 0
            turned[:] = 0
    if len(averages.held) > 0:
        averages.held[:] = averages.held / total
        averages.stands[:] = averages.stands / total
    return base + best - start


@kernel
def adapt_all(node, cuts, whole, base, goal, reach, steps, averages):
    """Adapt all prices and multipliers of a node; return its bound, ``base`` at first.

    Parameters
    ----------
    node : CutNode
        Its prices and multipliers become the best found.
    cuts : CutPool
    whole : Whole
    base, goal : int
        Units.
    reach : int
        Pairs that gain less than the price by 2^-reach of the sample's most are left out.
    steps : Steps
    averages : FractionalPlan
    """
    local = gather_cuts(np.arange(len(node.low)).astype(np.int32), node, cuts, whole, reach)
    price, multiplier = np.zeros(len(local.sample) + 1, dtype=np.int64), node.multiplier[local.cut]
    price[:-1] = node.price[local.sample]
    count = np.zeros_like(local.fixed)
    bound = adapt_cuts(local, whole.most, base, goal, steps, price, multiplier, count, averages)
    node.price[local.sample] = price[:-1]
    node.multiplier[local.cut] = multiplier
    return bound
