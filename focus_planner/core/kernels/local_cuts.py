# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Cuts, and the part of their bound that depends on some cameras (docs/algorithm.md).

With cuts Σ x ≤ limit + Σ Y of multipliers λ ≥ 0 no plan gains more than

    D(v, λ) = Σ_p v_p + Σ_k limit_k λ_k + Σ_c max_j [
                  Σ_{p held by cell j of c} (g − v_p − Σ_{k ∋ pc} λ_k)⁺ + Σ_{k: j ∈ U_kc} λ_k].

A local problem has some of the cameras, and those prices and multipliers that no other camera's
part depends on; with all cameras, it is the whole. All is in whole units, so D is exact.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from focus_planner.core.arrays import IntArray, Offsets
from focus_planner.core.kernels.arrays import GainsByCamera
from focus_planner.core.kernels.compiling import kernel


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
