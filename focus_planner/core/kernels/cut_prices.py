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

The bound of :mod:`focus_planner.core.kernels.local_cuts` has a corner wherever a camera's best cell
changes. Smoothed, the best cell is log-sum-exp over all cells, and what is taken above a price,
(s)⁺, is a parabola up to some width: the bound then rises by that width times the logarithm of the
number of cells per camera at most, and has a gradient, along which accelerated steps go down. The
widths shrink step by step. What is reported is always the bound itself, at whole prices.

Y. Nesterov, *Smooth minimization of non-smooth functions*, Math. Programming 103 (2005); A. Beck
and M. Teboulle, *A fast iterative shrinkage-thresholding algorithm*, SIAM J. Imaging Sciences 2
(2009); B. O'Donoghue and E. Candès, *Adaptive restart*, Found. Comput. Math. 15 (2015).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from focus_planner.core.arrays import FloatArray
from focus_planner.core.kernels.compiling import kernel
from focus_planner.core.kernels.local_cuts import gather_cuts

# Steps between two looks at the bound itself, and between two checks of the step's length, which
# grows by so much after each, and is halved until it is not too long.
_LOOK, _CHECK = 10, 5
_LONGER = 1.0 / 0.9
# The first step's length, in widths.
_LENGTH = 0.1
# Of multipliers' steps, in parts of those of prices: more pairs depend on one.
_OF_CUTS = 0.3
_NEGLIGIBLE = -30.0  # e to this power adds nothing


class FractionalPlan(NamedTuple):
    """A fractional solution: ``held`` (G,) of pairs, ``stands`` (M,) of cells, 0 to 1."""

    held: FloatArray
    stands: FloatArray


class Steps(NamedTuple):
    """How many steps there are at most, and how wide corners are rounded at first and at last.

    ``width`` and ``narrowest`` are units.
    """

    most: int
    width: float
    narrowest: float


class _Slopes(NamedTuple):
    """The gradient of the smoothed bound, and the fractional solution it comes from.

    ``price`` (F + 1,) and ``multiplier`` (L,) are the slopes; ``taken`` is how much of each pair is
    taken, ``before`` how much of each camera's cells stands before each, one longer than these, and
    ``extra`` what multipliers take from each pair's gain.
    """

    price: FloatArray
    multiplier: FloatArray
    taken: FloatArray
    before: FloatArray
    extra: FloatArray


class _Point(NamedTuple):
    """Prices (F + 1,), of which the last is 0, and multipliers (L,)."""

    price: FloatArray
    multiplier: FloatArray


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
def exact_bound(local, price, multiplier, extra, takings):
    """Return the local bound at whole prices and multipliers."""
    bound = price.sum()
    spread(local, multiplier, extra)
    for i in range(len(multiplier)):
        bound += local.limit[i] * multiplier[i]
    cell_offsets = local.cell_offsets
    for k in range(len(cell_offsets) - 1):
        if cell_offsets[k + 1] > cell_offsets[k]:
            part = takings[cell_offsets[k] : cell_offsets[k + 1]]
            bound += takings_with_cuts(k, local, price, multiplier, extra, part)[0]
    return bound


@kernel
def _soft_takings(k, local, point, width, slopes):
    """Fill what each cell of the k-th camera takes, with rounded corners."""
    offsets, member, gain, first, last = local.gains
    begin, end = local.cell_offsets[k], local.cell_offsets[k + 1]
    price, extra, taken, takings = point.price, slopes.extra, slopes.taken, slopes.before[begin:end]
    takings[:] = local.fixed[begin:end]
    for j in range(offsets[k], offsets[k + 1]):
        above = gain[j] - price[member[j]] - extra[j]
        # Without branches: 0 below 0, a parabola up to the width, a line from there on.
        share = min(max(above / width, 0.0), 1.0)
        taken[j] = share
        above = share * (above - 0.5 * width * share)
        takings[first[j]] += above
        takings[last[j] + 1] -= above
    ranges = local.ranges
    for r in range(local.range_offsets[k], local.range_offsets[k + 1]):
        takings[ranges[r, 1]] += point.multiplier[ranges[r, 0]]
        takings[ranges[r, 2] + 1] -= point.multiplier[ranges[r, 0]]


@kernel
def _soft_most(takings, width):
    """Return the most that one cell takes, smoothed; fill how much stands before each cell."""
    cells = len(takings) - 1
    best, total = -np.inf, 0.0
    for i in range(cells):
        total += takings[i]
        takings[i] = total
        best = max(best, total)
    total = 0.0
    for i in range(cells):
        power = (takings[i] - best) / width
        takings[i] = np.exp(power) if power > _NEGLIGIBLE else 0.0
        total += takings[i]
    before = 0.0
    for i in range(cells):
        share = takings[i] / total
        takings[i] = before
        before += share
    takings[cells] = before
    return best + width * np.log(total)


@kernel
def _soft_slopes(k, local, slopes):
    """Take what the k-th camera takes off the slopes of prices; add where it stands to cuts'."""
    offsets, member, _, first, last = local.gains
    price, taken = slopes.price, slopes.taken
    before = slopes.before[local.cell_offsets[k] : local.cell_offsets[k + 1]]
    for j in range(offsets[k], offsets[k + 1]):
        taken[j] *= before[last[j] + 1] - before[first[j]]
        price[member[j]] -= taken[j]
    ranges = local.ranges
    for r in range(local.range_offsets[k], local.range_offsets[k + 1]):
        slopes.multiplier[ranges[r, 0]] += before[ranges[r, 2] + 1] - before[ranges[r, 1]]


@kernel
def _soft_bound(local, point, width, slopes):
    """Return the smoothed local bound; fill its slopes."""
    cell_offsets = local.cell_offsets
    bound = point.price.sum()
    slopes.price[:] = 1.0
    spread(local, point.multiplier, slopes.extra)
    for i in range(len(point.multiplier)):
        bound += local.limit[i] * point.multiplier[i]
        slopes.multiplier[i] = local.limit[i]
    for k in range(len(cell_offsets) - 1):
        if cell_offsets[k + 1] > cell_offsets[k]:
            _soft_takings(k, local, point, width, slopes)
            bound += _soft_most(slopes.before[cell_offsets[k] : cell_offsets[k + 1]], width)
            _soft_slopes(k, local, slopes)
        else:
            slopes.taken[local.gains.offsets[k] : local.gains.offsets[k + 1]] = 0.0
    for i in range(len(point.multiplier)):
        for e in range(local.pair_offsets[i], local.pair_offsets[i + 1]):
            slopes.multiplier[i] -= slopes.taken[local.pairs[e]]
    return bound


@kernel
def _clip_price(i, price, local, most):
    """Return the i-th price within what it may be."""
    return min(max(price, float(local.floor[i])), float(most[local.sample[i]]))


@kernel
def _step(local, most, length, start, slopes, end):
    """Step down from a point; return by how much a parabola of that length would fall.

    That is how far the smoothed bound falls at least, unless the step is too long.
    """
    fall = 0.0
    for i in range(len(local.sample)):
        moved = _clip_price(i, start.price[i] - length * slopes.price[i], local, most)
        by = moved - start.price[i]
        fall -= by * slopes.price[i] + 0.5 * by * by / length
        end.price[i] = moved
    for i in range(len(local.cut)):
        slope = slopes.multiplier[i]
        moved = max(start.multiplier[i] - _OF_CUTS * length * slope, 0.0)
        by = moved - start.multiplier[i]
        fall -= by * slope + 0.5 * by * by / (_OF_CUTS * length)
        end.multiplier[i] = moved
    return fall


@kernel
def _turns_back(start, end, last):
    """Return whether a step from ``start`` to ``end`` goes back towards the last point."""
    product = 0.0
    for i in range(len(end.price)):
        product += (start.price[i] - end.price[i]) * (end.price[i] - last.price[i])
    for i in range(len(end.multiplier)):
        product += (
            (start.multiplier[i] - end.multiplier[i])
            * (end.multiplier[i] - last.multiplier[i])
            / _OF_CUTS
        )
    return product > 0


@kernel
def _go_on(local, most, momentum, end, last, start):
    """Move the next step's start beyond the end of this one; the end becomes the last point."""
    for i in range(len(local.sample)):
        beyond = end.price[i] + momentum * (end.price[i] - last.price[i])
        start.price[i] = _clip_price(i, beyond, local, most)
    for i in range(len(local.cut)):
        by = end.multiplier[i] - last.multiplier[i]
        start.multiplier[i] = max(end.multiplier[i] + momentum * by, 0.0)
    last.price[:] = end.price
    last.multiplier[:] = end.multiplier


@kernel
def _slopes_of(local):
    """Return room for slopes."""
    pairs = len(local.pair)
    return _Slopes(
        np.zeros(len(local.floor)),
        np.zeros(len(local.cut)),
        np.zeros(pairs),
        np.zeros(len(local.fixed)),
        np.zeros(pairs),
    )


@kernel
def _copy_of(point):
    return _Point(point.price.copy(), point.multiplier.copy())


@kernel
def _shares_of(cell_offsets, before):
    """Turn how much stands before each cell into how much stands at it."""
    for k in range(len(cell_offsets) - 1):
        for i in range(cell_offsets[k], cell_offsets[k + 1] - 1):
            before[i] = before[i + 1] - before[i]


@kernel
def adapt_cuts(local, most, base, goal, steps, price, multiplier, last):
    """Adapt prices and multipliers; return the least bound, that of the last, and a solution.

    Parameters
    ----------
    local : LocalCuts
    most : (N,) array of int64
    base, goal : int
        Units; steps end when a bound, at first ``base``, is at the goal.
    steps : Steps
    price : (F + 1,) array of int64
        Become the best found; the last of them is 0.
    multiplier : (L,) array of int64
        Become the best found.
    last : tuple of arrays
        As these two; become those of the last step.

    Returns
    -------
    best, final : int
        What the best and the last prove, units.
    taken : array
        How much of each local pair is taken, 0 to 1.
    share : array
        How much of each camera stands at each cell; as long as ``local.fixed``.
    """
    now, now_of_cuts = last
    extra, takings = np.zeros(len(local.pair), dtype=np.int64), np.empty_like(local.fixed)
    rest = base - exact_bound(local, price, multiplier, extra, takings)
    start = _Point(price.astype(np.float64), multiplier.astype(np.float64))
    end, before, tried = _copy_of(start), _copy_of(start), _slopes_of(local)
    slopes = _slopes_of(local)
    best, final = base, base
    width, momentum = steps.width, 1.0
    length = _LENGTH * width
    narrower = (steps.narrowest / steps.width) ** (1.0 / max(steps.most, 1))
    for step in range(1, steps.most + 1):
        bound = _soft_bound(local, start, width, slopes)
        fall = _step(local, most, length, start, slopes, end)
        if step % _CHECK == 1:
            while _soft_bound(local, end, width, tried) > bound - fall + 1e-9 * abs(bound):
                length *= 0.5
                fall = _step(local, most, length, start, slopes, end)
            length *= _LONGER
        if _turns_back(start, end, before):
            momentum = 1.0
        grown = 0.5 * (1.0 + np.sqrt(1.0 + 4.0 * momentum * momentum))
        _go_on(local, most, (momentum - 1.0) / grown, end, before, start)
        momentum = grown
        width *= narrower
        length *= narrower
        if step % _LOOK == 0 or step == steps.most:
            now[:] = np.rint(end.price)
            now_of_cuts[:] = np.rint(end.multiplier)
            final = rest + exact_bound(local, now, now_of_cuts, extra, takings)
            if final < best:
                best = final
                price[:] = now
                multiplier[:] = now_of_cuts
            if best <= goal:
                break
    _shares_of(local.cell_offsets, slopes.before)
    return best, final, slopes.taken, slopes.before


@kernel
def adapt_all(node, last, cuts, whole, base, goal, reach, steps, plan):
    """Adapt all prices and multipliers of a node; return the least bound and that of the last.

    Parameters
    ----------
    node : CutNode
        Its prices and multipliers become the best found.
    last : tuple of arrays
        Prices (N,) and multipliers (K,); become those of the last step.
    cuts : CutPool
    whole : Whole
    base, goal : int
        Units; the first is what the node's prices prove.
    reach : int
        Pairs that gain less than the price by 2^-reach of the sample's most are left out.
    steps : Steps
    plan : FractionalPlan
        Becomes what the last step takes.
    """
    local = gather_cuts(np.arange(len(node.low)).astype(np.int32), node, cuts, whole, reach)
    price, multiplier = np.zeros(len(local.sample) + 1, dtype=np.int64), node.multiplier[local.cut]
    price[:-1] = node.price[local.sample]
    ends = price.copy(), multiplier.copy()
    best, final, taken, share = adapt_cuts(
        local, whole.most, base, goal, steps, price, multiplier, ends
    )
    last[0][:], last[1][:] = node.price, node.multiplier
    last[0][local.sample], last[1][local.cut] = ends[0][:-1], ends[1]
    node.price[local.sample] = price[:-1]
    node.multiplier[local.cut] = multiplier
    plan.held[:], plan.stands[:] = 0.0, 0.0
    plan.held[local.pair] = taken
    for k in range(len(local.origin)):
        begin, end = local.cell_offsets[k], local.cell_offsets[k + 1]
        if end > begin:
            plan.stands[local.origin[k] : local.origin[k] + end - begin - 1] = share[
                begin : end - 1
            ]
    return best, final
