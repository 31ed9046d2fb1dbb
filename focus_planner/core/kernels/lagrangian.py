# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Prices of samples, and the bound that they prove (docs/algorithm.md).

At prices v no plan gains more than D(v) = Σ v_p + Σ_c max_j Σ_{p held by cell j of c} (g − v_p)⁺.
With q views per sample that is

    Σ_p [q v_p + Σ_c (e − v_p)⁺] + Σ_c max_j Σ_{p held by cell j of c} [(g − v_p)⁺ − (e − v_p)⁺],

where e is what a view gains out of focus, and j stands for as many cells as c takes shots.

With at most B pictures in all, what c adds depends on how many it takes: the first adds
Σ_p (e − v)⁺ as well, and each further one no more than the one before. So the most that B pictures
add is the sum of the B largest of these differences, and that takes the place of the sum over c.
Everything is in whole units, so D is exact and does not depend on the order of its sums.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import prange

from focus_planner.core.arrays import FloatArray, IntArray, Offsets
from focus_planner.core.kernels.above import room_above, take_best_cell
from focus_planner.core.kernels.compiling import kernel, parallel_kernel
from focus_planner.core.kernels.stabbing import best_cells, best_cells_of_each, intervals_above

# Sums of floats are taken over this many parts, each in order, whatever the number of threads.
_PARTS = 32
# How steps adapt. Measured on bodies: among momenta of 0.3 to 0.9, patience of 10 to 40 steps,
# falls of 0.5 to 0.8 and growths of 1 to 2 these came nearest to the relaxation's optimum.
_MOMENTUM = 0.8
_PATIENCE = 30
_PROGRESS = 0.25
_GROWTH = 1.5
_BEYOND = 1e-6
_FALL = 0.7


class PriceDescent(NamedTuple):
    """The state of a subgradient descent on the prices; :func:`descend` changes its arrays.

    Attributes
    ----------
    price : (N,) array of int64
        The prices that the next step starts from, units.
    floor : (N,) array of int64
        Prices stay above what the inactive pairs gain, see :func:`activate`.
    most : (N,) array of int64
        Prices stay below each sample's largest gain.
    best_price : (N,) array of int64
        The prices of the least bound so far.
    direction : (N,) array of float64
        The mean of the subgradients so far, the recent ones weighted more.
    served : (W, N) array of int32
        Scratch: how many cameras of each of W parts take a sample above its price, less those that
        would take it out of focus.
    steps : (M + C,) array of int64
        Scratch: a camera's part is one longer than its cells.
    chosen : (M,) array of int64
        How often each cell was its camera's best.
    progress : (4,) array of float64
        Least bound; hope, see :func:`descend`; least bound when the hope last changed; steps since.
    """

    price: Offsets
    floor: Offsets
    most: Offsets
    best_price: Offsets
    direction: FloatArray
    served: IntArray
    steps: Offsets
    chosen: Offsets
    progress: FloatArray


@kernel
def _even_parts(offsets, others, parts):
    """Return (W + 1,) where W parts of neighbouring cameras begin that are about as much work.

    ``offsets`` and ``others`` are (C + 1,): what there is to do for each camera.
    """
    cameras = len(offsets) - 1
    begins = np.full(parts + 1, cameras, dtype=np.int64)
    total = offsets[cameras] + others[cameras]
    part = 0
    for c in range(cameras):
        while part < parts and (offsets[c] + others[c]) * parts >= part * total:
            begins[part] = c
            part += 1
    return begins


@kernel
def _count_active(low, high, gains, level, counts):
    """Fill how many pairs of cameras ``low`` to ``high`` gain more than ``level``."""
    offsets, sample, gain, _, _ = gains
    for c in range(low, high):
        count = 0
        for j in range(offsets[c], offsets[c + 1]):
            count += gain[j] > level[sample[j]]
        counts[c] = count


@kernel
def _list_active(low, high, gains, level, active, floor):
    """List those pairs; raise floors to what the others gain."""
    offsets, sample, gain, first, last = gains
    active_offsets, active_sample, active_gain, active_first, active_last = active
    for c in range(low, high):
        at, end, j = active_offsets[c], active_offsets[c + 1], offsets[c]
        # Without branches to guess, as long as there is room for what may not belong there.
        while at < end:
            p, more = sample[j], gain[j] > level[sample[j]]
            active_sample[at], active_gain[at] = p, gain[j]
            active_first[at], active_last[at] = first[j], last[j]
            floor[p] = max(floor[p], 0 if more else gain[j])
            at += more
            j += 1
        for rest in range(j, offsets[c + 1]):
            floor[sample[rest]] = max(floor[sample[rest]], gain[rest])


@parallel_kernel
def activate(gains, price, reach, active, floor, parts):
    """List the pairs that gain more than ``price - reach``; raise floors to what the others gain.

    At prices above ``floor`` (N,) the others add nothing to the bound. ``parts`` of the cameras
    are listed at once.
    """
    offsets, active_offsets = gains.offsets, active.offsets
    begins = _even_parts(offsets, offsets, parts)
    floors = np.zeros((parts, len(floor)), dtype=np.int64)
    level = np.empty_like(price)
    active_offsets[0] = 0
    for p in prange(len(price)):
        level[p] = price[p] - reach[p]
    for part in prange(parts):
        _count_active(begins[part], begins[part + 1], gains, level, active_offsets[1:])
    for c in range(len(offsets) - 1):
        active_offsets[c + 1] += active_offsets[c]
    for part in prange(parts):
        _list_active(begins[part], begins[part + 1], gains, level, active, floors[part])
    for p in prange(len(floor)):
        for part in range(parts):
            floor[p] = max(floor[p], floors[part, p])


@kernel
def _best_of_view(c, gains, blurred, count, price, cells):
    """Fill the cells, of ``count``, of camera c's shots that take most; return how much."""
    low, high = np.zeros_like(cells), np.full_like(cells, count - 1)
    return best_cells(intervals_above(c, gains, blurred, price), low, high, count, cells)


@kernel
def _count_served(c, gains, price, sign, cell, before, served):
    """Add ``sign`` to each sample that a cell of camera c takes and the cell ``before`` does not.

    The latter lies below it; -1 for none.
    """
    offsets, sample, gain, first, last = gains
    for j in range(offsets[c], offsets[c + 1]):
        p = sample[j]
        held = (before < first[j]) & (first[j] <= cell) & (cell <= last[j]) & (gain[j] > price[p])
        served[p] += sign * held


@kernel
def _serve(low, high, gains, blurred, cell_offsets, shots, price, served, steps, chosen, values):
    """Find the best cells of views ``low`` to ``high``; count which samples they take."""
    cells = np.empty(shots, dtype=np.int32)
    room = 0
    for view in range(low, high):
        c = view * shots
        pairs = gains.offsets[c + 1] - gains.offsets[c]
        room = max(room, pairs + blurred.offsets[c + 1] - blurred.offsets[c])
    above = room_above(room)
    served[:] = 0
    for view in range(low, high):
        c = view * shots
        values[view] = 0
        if cell_offsets[c] == cell_offsets[c + 1]:
            continue
        if shots == 1:
            begin, end = cell_offsets[c], cell_offsets[c + 1]
            own = steps[begin + c : end + c + 1]
            own[:] = 0
            values[view] = take_best_cell(
                c, gains, blurred, price, own, above, chosen[begin:end], served
            )
            continue
        count = cell_offsets[c + 1] - cell_offsets[c]
        values[view] = _best_of_view(c, gains, blurred, count, price, cells)
        before = -1
        for shot in range(shots):
            cell = cells[shot]
            chosen[cell_offsets[c + shot] + cell] += 1
            _count_served(c, gains, price, 1, cell, before, served)
            _count_served(c, blurred, price, -1, cell, before, served)
            before = cell


@kernel
def _offer(low, high, gains, blurred, seen, cell_offsets, price, offers, cells):
    """Fill by how much more views ``low`` to ``high`` take with every picture, and in which cells.

    Parameters
    ----------
    offers : (V, shots) array of int64
    cells : (V, shots, shots) array of int32
        A row for each number of pictures.
    """
    shots = offers.shape[1]
    for view in range(low, high):
        c = view * shots
        offers[view] = 0
        count = cell_offsets[c + 1] - cell_offsets[c]
        if count > 0:
            above = intervals_above(c, gains, blurred, price)
            best_cells_of_each(above, count, offers[view], cells[view])
            for k in range(shots - 1, 0, -1):
                offers[view, k] -= offers[view, k - 1]
        for j in range(seen.offsets[c], seen.offsets[c + 1]):
            offers[view, 0] += max(seen.gain[j] - price[seen.sample[j]], 0)


@kernel
def _accept(offers, images, values, pictures):
    """Take the largest offers, ``images`` at most; fill each view's total, and how many it has."""
    shots = offers.shape[1]
    values[:], pictures[:] = 0, 0
    # A view's offers do not rise; of equal ones the stable sort leaves the first first.
    order = np.argsort(-offers.ravel(), kind="mergesort")
    for i in range(min(images, len(order))):
        view = order[i] // shots
        offer = offers[view, order[i] % shots]
        if offer <= 0:
            break
        values[view] += offer
        pictures[view] += 1


@kernel
def _serve_accepted(
    low, high, gains, blurred, seen, cell_offsets, price, cells, pictures, served, chosen
):
    """Count which samples the accepted pictures of views ``low`` to ``high`` take."""
    shots = cells.shape[1]
    served[:] = 0
    for view in range(low, high):
        c, taken = view * shots, pictures[view]
        if taken == 0:
            continue
        for j in range(seen.offsets[c], seen.offsets[c + 1]):
            served[seen.sample[j]] += seen.gain[j] > price[seen.sample[j]]
        before = -1
        for shot in range(taken if cell_offsets[c] < cell_offsets[c + 1] else 0):
            cell = cells[view, taken - 1, shot]
            chosen[cell_offsets[c + shot] + cell] += 1
            _count_served(c, gains, price, 1, cell, before, served)
            _count_served(c, blurred, price, -1, cell, before, served)
            before = cell


@kernel
def _turn(low, high, views, blurred_views, price, served, direction):
    """Turn the direction of some samples to the present subgradient; add up who takes them.

    Returns the sum of what they add to the bound and of the direction's squares.
    """
    offsets, blurred = blurred_views
    for other in range(1, len(served)):
        served[0, low:high] += served[other, low:high]
    total, square = np.int64(0), 0.0
    for p in range(low, high):
        total += views * price[p]
        left = views - served[0, p]
        if len(blurred) > 0:
            for b in range(offsets[p], offsets[p + 1]):
                if blurred[b] > price[p]:
                    total += blurred[b] - price[p]
                    left -= 1
        direction[p] += (1.0 - _MOMENTUM) * (left - direction[p])
        square += direction[p] * direction[p]
    return total, square


@kernel
def _move(low, high, better, step, direction, floor, most, price, best_price):
    """Keep some samples' prices if they are better; move them by a step against the direction."""
    if better:
        best_price[low:high] = price[low:high]
    for p in range(low, high):
        moved = price[p] - np.int64(np.rint(step * direction[p]))
        price[p] = min(max(moved, floor[p]), most[p])


@kernel
def _adapt_hope(progress, goal):
    """Let the hope grow after progress, and count the steps without; return it."""
    # A little beyond the goal: aimed at it, steps would only approach it.
    hope = min(progress[1], progress[0] - goal + _BEYOND * progress[0])
    if progress[0] <= progress[2] - _PROGRESS * hope:
        progress[1], progress[2], progress[3] = hope * _GROWTH, progress[0], 0
    else:
        progress[3] += 1
    return hope


@kernel
def _restart(hope, descent):
    """Go back to the best prices with less hope."""
    progress = descent.progress
    progress[1], progress[2], progress[3] = hope * _FALL, progress[0], 0
    # The best prices may be from before the pairs below the floor were left out.
    descent.price[:] = np.maximum(descent.best_price, descent.floor)
    descent.direction[:] = 0


@parallel_kernel
def descend(
    gains,
    blurred,
    blurred_views,
    cell_offsets,
    views,
    shots,
    seen,
    images,
    descent,
    goal,
    iterations,
):
    """Lower the bound by subgradient steps; return how many were taken.

    A step aims at a level below the least bound so far, but not far below ``goal``: the
    difference is the hope. It grows when the bound has come down by a quarter of it, and falls
    when it has not for a while.

    Parameters
    ----------
    gains, blurred, blurred_views, cell_offsets, views, shots
        Those pairs that are active, see :class:`PricedPairs`.
    seen : GainsByCamera
        Where pictures are limited, what pairs gain by being in one, even out of focus: those of
        each view's first shot. Their ranges of cells do not matter.
    images : int
        How many pictures there may be; -1 for all.
    descent : PriceDescent
    goal : float
        Units; steps end when the bound is there.
    iterations : int
        The most steps to take.
    """
    price, floor, most, best_price, direction, served, steps, chosen, progress = descent
    samples, parts, cameras = len(price), len(served), (len(cell_offsets) - 1) // shots
    values = np.empty(cameras, dtype=np.int64)
    limited = cameras if images >= 0 else 0
    offers = np.empty((limited, shots), dtype=np.int64)
    cells = np.empty((limited, shots, shots), dtype=np.int32)
    pictures = np.empty(limited, dtype=np.int32)
    sums, squares = np.empty(_PARTS, dtype=np.int64), np.empty(_PARTS, dtype=np.float64)
    size = (samples + _PARTS - 1) // _PARTS
    begins = _even_parts(gains.offsets[::shots], cell_offsets[::shots], parts)
    for iteration in range(iterations):
        for part in prange(parts):
            low, high = begins[part], begins[part + 1]
            if images >= 0:
                _offer(low, high, gains, blurred, seen, cell_offsets, price, offers, cells)
            else:
                _serve(
                    low,
                    high,
                    gains,
                    blurred,
                    cell_offsets,
                    shots,
                    price,
                    served[part],
                    steps,
                    chosen,
                    values,
                )
        if images >= 0:
            _accept(offers, images, values, pictures)
            for part in prange(parts):
                low, high = begins[part], begins[part + 1]
                _serve_accepted(
                    low,
                    high,
                    gains,
                    blurred,
                    seen,
                    cell_offsets,
                    price,
                    cells,
                    pictures,
                    served[part],
                    chosen,
                )
        for part in prange(_PARTS):
            low, high = part * size, min((part + 1) * size, samples)
            sums[part], squares[part] = _turn(
                low, high, views, blurred_views, price, served, direction
            )
        bound = float(values.sum() + sums.sum())
        better = bound < progress[0]
        progress[0] = min(bound, progress[0])
        hope = _adapt_hope(progress, goal)
        reached, stuck = progress[0] <= goal, progress[3] >= _PATIENCE
        step = 0.0
        if not (reached or stuck):
            step = (bound - progress[0] + hope) / max(squares.sum(), 1e-9)
        for part in prange(_PARTS):
            low, high = part * size, min((part + 1) * size, samples)
            _move(low, high, better, step, direction, floor, most, price, best_price)
        if reached:
            return iteration + 1
        if stuck:
            _restart(hope, descent)
    return iterations


@kernel
def most_frequent(cell_offsets, chosen, cell):
    """Fill each camera's cell that was chosen most often; cameras without cells keep theirs."""
    for c in range(len(cell)):
        if cell_offsets[c] < cell_offsets[c + 1]:
            cell[c] = np.argmax(chosen[cell_offsets[c] : cell_offsets[c + 1]])
