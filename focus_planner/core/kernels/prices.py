"""Prices of samples, and the bound that they prove (core/proof/prices.py).

At prices v no plan gains more than D(v) = Σ v_p + Σ_c max_j Σ_{p held by cell j of c} (g − v_p)⁺.
Whole units all through: D is exact, and does not depend on the order of its sums.
"""

from __future__ import annotations

import numpy as np
from numba import prange

from focus_planner.core.kernels.compiling import kernel, parallel_kernel

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


@parallel_kernel
def most_gains(sample_offsets, base, focus, first, last, unseen, out, most):
    """Fill each sample's cost with all cameras out of focus, and the most that focus gains."""
    for p in prange(len(out)):
        low, high = sample_offsets[p], sample_offsets[p + 1]
        least = base[low] if low < high else unseen[p]
        sharp = least
        for q in range(low, high):
            least = min(least, base[q])
        least += focus[p] if low < high else 0
        sharp = least
        for q in range(low, high):
            if first[q] <= last[q]:
                sharp = min(sharp, base[q])
        out[p] = least
        most[p] = least - sharp


@parallel_kernel
def count_gains(camera_offsets, seen, seen_base, seen_first, seen_last, out, counts):
    """Fill ``counts`` (C,): how many of each camera's pairs gain anything from focus."""
    for c in prange(len(counts)):
        count = 0
        for j in range(camera_offsets[c], camera_offsets[c + 1]):
            if seen_first[j] <= seen_last[j] and seen_base[j] < out[seen[j]]:
                count += 1
        counts[c] = count


@parallel_kernel
def list_gains(
    camera_offsets,
    seen,
    seen_base,
    seen_first,
    seen_last,
    out,
    offsets,
    sample,
    gain,
    first,
    last,
):
    """Fill what :func:`count_gains` counted."""
    for c in prange(len(offsets) - 1):
        at = offsets[c]
        for j in range(camera_offsets[c], camera_offsets[c + 1]):
            if seen_first[j] <= seen_last[j] and seen_base[j] < out[seen[j]]:
                sample[at], first[at], last[at] = seen[j], seen_first[j], seen_last[j]
                gain[at] = out[seen[j]] - seen_base[j]
                at += 1


@kernel
def gains_by_sample(offsets, sample, gain, sample_offsets, camera, by_sample_gain):
    """Fill the same pairs sample by sample, cameras ascending; the sort counts."""
    sample_offsets[:] = 0
    for p in sample:
        sample_offsets[p + 1] += 1
    for p in range(len(sample_offsets) - 1):
        sample_offsets[p + 1] += sample_offsets[p]
    at = sample_offsets[:-1].copy()
    for c in range(len(offsets) - 1):
        for j in range(offsets[c], offsets[c + 1]):
            p = sample[j]
            camera[at[p]], by_sample_gain[at[p]] = c, gain[j]
            at[p] += 1


@kernel
def _count_active(low, high, sample, gain, price, reach):
    count = 0
    for j in range(low, high):
        if gain[j] > price[sample[j]] - reach[sample[j]]:
            count += 1
    return count


@parallel_kernel
def activate(
    offsets,
    sample,
    gain,
    first,
    last,
    price,
    reach,
    active_offsets,
    active_sample,
    active_gain,
    active_first,
    active_last,
    floor,
):
    """List the pairs that gain more than ``price - reach``; fill the most that the others gain.

    Above ``floor`` (N,), the others add nothing to the bound.
    """
    for c in prange(len(offsets) - 1):
        active_offsets[c + 1] = _count_active(
            offsets[c], offsets[c + 1], sample, gain, price, reach
        )
    active_offsets[0] = 0
    for c in range(len(offsets) - 1):
        active_offsets[c + 1] += active_offsets[c]
    floor[:] = 0
    for c in range(len(offsets) - 1):
        at = active_offsets[c]
        for j in range(offsets[c], offsets[c + 1]):
            p = sample[j]
            if gain[j] > price[p] - reach[p]:
                active_sample[at], active_gain[at] = p, gain[j]
                active_first[at], active_last[at] = first[j], last[j]
                at += 1
            elif gain[j] > floor[p]:
                floor[p] = gain[j]


@kernel
def _best_cell(low, high, sample, gain, first, last, price, steps):
    """Return the most that one cell of a camera takes above the prices, and that cell."""
    steps[:] = 0
    for j in range(low, high):
        # What is not above the price adds nothing, without a branch that no processor foresees.
        above = max(gain[j] - price[sample[j]], 0)
        steps[first[j]] += above
        steps[last[j] + 1] -= above
    best, where, total = np.int64(-1), 0, np.int64(0)
    for i in range(len(steps) - 1):
        total += steps[i]
        if total > best:
            best, where = total, i
    return best, where


@parallel_kernel
def descend(
    offsets,
    sample,
    gain,
    first,
    last,
    cell_offsets,
    price,
    floor,
    most,
    best_price,
    direction,
    served,
    chosen,
    steps,
    state,
    goal,
    iterations,
):
    """Lower the bound by subgradient steps; return how many were taken.

    ``price`` (N,) stays between ``floor`` and ``most``. A step aims at a level
    below the best bound so far, not far below ``goal``: the hope. It grows when the bound has come
    down by a quarter of it, and falls when it has not for a while. ``state`` (4,) float: best
    bound, hope, bound at the last progress, steps since.

    ``served`` (T, N) is room for counting, by T parts of the cameras; ``chosen`` (M,) counts how
    often each cell was a camera's best; ``steps`` has a place more than cells per camera.
    """
    samples, cameras, parts = len(price), len(offsets) - 1, len(served)
    values = np.empty(cameras, dtype=np.int64)
    sums = np.empty(_PARTS, dtype=np.int64)
    squares = np.empty(_PARTS, dtype=np.float64)
    size = (samples + _PARTS - 1) // _PARTS
    for iteration in range(iterations):
        for part in prange(parts):
            served[part] = 0
            for c in range(part * cameras // parts, (part + 1) * cameras // parts):
                values[c] = 0
                if cell_offsets[c] == cell_offsets[c + 1]:
                    continue
                low, high = offsets[c], offsets[c + 1]
                values[c], cell = _best_cell(
                    low,
                    high,
                    sample,
                    gain,
                    first,
                    last,
                    price,
                    steps[cell_offsets[c] + c : cell_offsets[c + 1] + c + 1],
                )
                chosen[cell_offsets[c] + cell] += 1
                for j in range(low, high):
                    p = sample[j]
                    held = (first[j] <= cell) & (cell <= last[j]) & (gain[j] > price[p])
                    served[part, p] += held
        for part in prange(_PARTS):
            total, square = np.int64(0), 0.0
            for p in range(part * size, min((part + 1) * size, samples)):
                total += price[p]
                slope = 1.0
                for other in range(parts):
                    slope -= served[other, p]
                direction[p] += (1.0 - _MOMENTUM) * (slope - direction[p])
                square += direction[p] * direction[p]
            sums[part], squares[part] = total, square
        bound = float(values.sum() + sums.sum())
        if bound < state[0]:
            state[0] = bound
            for part in prange(_PARTS):
                for p in range(part * size, min((part + 1) * size, samples)):
                    best_price[p] = price[p]
        # A little beyond the goal, or it would be neared for ever.
        hope = min(state[1], state[0] - goal + _BEYOND * state[0])
        if state[0] <= state[2] - _PROGRESS * hope:
            state[1], state[2], state[3] = hope * _GROWTH, state[0], 0
        else:
            state[3] += 1
        if state[0] <= goal:
            return iteration + 1
        if state[3] >= _PATIENCE:
            state[1], state[2], state[3] = hope * _FALL, state[0], 0
            # The best prices may be from before the pairs below the floor were left out.
            price[:] = np.maximum(best_price, floor)
            direction[:] = 0
            continue
        total_square = squares.sum()
        step = (bound - state[0] + hope) / max(total_square, 1e-9)
        for part in prange(_PARTS):
            for p in range(part * size, min((part + 1) * size, samples)):
                moved = price[p] - np.int64(np.rint(step * direction[p]))
                price[p] = min(max(moved, floor[p]), most[p])
    return iterations


@kernel
def most_frequent(cell_offsets, chosen, cell):
    """Fill each camera's cell that was chosen most often; cameras without cells keep theirs."""
    for c in range(len(cell)):
        if cell_offsets[c] < cell_offsets[c + 1]:
            cell[c] = np.argmax(chosen[cell_offsets[c] : cell_offsets[c + 1]])
