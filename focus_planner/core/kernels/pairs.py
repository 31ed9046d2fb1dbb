# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The exact best cells of two cameras: a sweep over one, with a segment tree over the other."""

from __future__ import annotations

import numpy as np

from focus_planner.core.kernels.compiling import kernel


@kernel
def best_pair(gain_a, gain_b, rectangles, weights, count, start_a, start_b, floor):
    """Maximise gain_a[i] + gain_b[j] − Σ of the weights of the rectangles that hold (i, j).

    Parameters
    ----------
    gain_a, gain_b : (n,), (m,) arrays of int64
    rectangles : (r, 4) array of int32
        First and last i, first and last j, all inclusive. Overwritten.
    weights : (r,) array of int64
        Not negative. Overwritten.
    count : int
        How many of the rectangles there are.
    start_a, start_b : int
        Cells to start the search from.
    floor : int
        Only a larger gain counts.

    Returns
    -------
    gain, i, j
        ``(floor, -1, -1)`` if nothing exceeds the floor.

    Notes
    -----
    Rectangles only subtract, so gain_a[i] + max gain_b bounds the gain of any pair with i. A search
    along one axis at a time, O(n + m + r) per turn, goes on until it gains no more; cells at both
    ends that cannot exceed what it found are cut off. A sweep over the rest, O((n + m + r) log m),
    finds something better or proves that there is nothing.
    """
    most_a, most_b = gain_a.max(), gain_b.max()
    if most_a + most_b <= floor:
        return floor, -1, -1
    best, best_i, best_j = _search_in_turn(
        gain_a, gain_b, rectangles, weights, count, start_a, start_b, floor
    )
    if most_a + most_b <= best:
        return best, best_i, best_j
    low_a, high_a = _hopeful(gain_a, best - most_b)
    low_b, high_b = _hopeful(gain_b, best - most_a)
    kept = _clip(rectangles, weights, count, low_a, high_a, low_b, high_b)
    gain, i, j = _sweep(
        gain_a[low_a : high_a + 1], gain_b[low_b : high_b + 1], rectangles[:kept], weights, best
    )
    if i >= 0:
        best, best_i, best_j = gain, low_a + i, low_b + j
    return best, best_i, best_j


@kernel
def _search_in_turn(gain_a, gain_b, rectangles, weights, count, i, j, floor):
    """Search along one axis at a time until that gains no more; return as :func:`best_pair`."""
    best, best_i, best_j = floor, -1, -1
    while True:
        gain, j = _best_in_line(gain_b, gain_a[i], rectangles, weights, count, i, 0)
        gain, i = _best_in_line(gain_a, gain_b[j], rectangles, weights, count, j, 2)
        if gain <= best:
            return best, best_i, best_j
        best, best_i, best_j = gain, i, j


@kernel
def _clip(rectangles, weights, count, low_a, high_a, low_b, high_b):
    """Clip the rectangles, in place, to the cells in between, counted from their first.

    Returns how many are left.
    """
    kept = 0
    for r in range(count):
        first_a, last_a = max(rectangles[r, 0], low_a), min(rectangles[r, 1], high_a)
        first_b, last_b = max(rectangles[r, 2], low_b), min(rectangles[r, 3], high_b)
        if first_a <= last_a and first_b <= last_b:
            rectangles[kept, 0], rectangles[kept, 1] = first_a - low_a, last_a - low_a
            rectangles[kept, 2], rectangles[kept, 3] = first_b - low_b, last_b - low_b
            weights[kept] = weights[r]
            kept += 1
    return kept


@kernel
def _sweep(gain_a, gain_b, rectangles, weights, floor):
    """Return the best gain, i and j; ``(floor, -1, -1)`` if nothing exceeds the floor.

    Cell i of a after cell i, rectangles enter and leave a segment tree over the cells of b.
    """
    enter, next_enter = _by_place(rectangles, 0, 0, len(gain_a))
    leave, next_leave = _by_place(rectangles, 1, 1, len(gain_a) + 1)
    tree, lazy = _grow(gain_b)
    size = len(lazy)
    best, best_i, best_j = floor, -1, -1
    for i in range(len(gain_a)):
        r = leave[i]
        while r >= 0:
            _add(tree, lazy, size, rectangles[r, 2], rectangles[r, 3], weights[r])
            r = next_leave[r]
        r = enter[i]
        while r >= 0:
            _add(tree, lazy, size, rectangles[r, 2], rectangles[r, 3], -weights[r])
            r = next_enter[r]
        gain = gain_a[i] + tree[1]
        if gain > best:
            best, best_i = gain, i
            node = 1
            while node < size:
                node = 2 * node if tree[2 * node] >= tree[2 * node + 1] else 2 * node + 1
            best_j = node - size
    return best, best_i, best_j


@kernel
def _by_place(rectangles, side, shift, count):
    """Return the last rectangle at each place, and before each rectangle the one there; -1: none.

    A rectangle's place, of ``count``, is its ``side``, the column, plus ``shift``.
    """
    last, before = np.full(count, -1, dtype=np.int32), np.empty(len(rectangles), dtype=np.int32)
    for r in range(len(rectangles)):
        place = rectangles[r, side] + shift
        before[r] = last[place]
        last[place] = r
    return last, before


@kernel
def _grow(gain):
    """Return a segment tree over the gains, its root at index 1, and what :func:`_add` defers."""
    size = 1
    while size < len(gain):
        size *= 2
    tree = np.full(2 * size, -(2**62), dtype=np.int64)
    tree[size : size + len(gain)] = gain
    for node in range(size - 1, 0, -1):
        tree[node] = max(tree[2 * node], tree[2 * node + 1])
    return tree, np.zeros(size, dtype=np.int64)


@kernel
def _best_in_line(gain, offset, rectangles, weights, count, at, axis):
    """Return the best gain, and its cell, along the other axis of the line ``at`` on ``axis``."""
    steps = np.zeros(len(gain) + 1, dtype=np.int64)
    for r in range(count):
        if rectangles[r, axis] <= at <= rectangles[r, axis + 1]:
            steps[rectangles[r, 2 - axis]] += weights[r]
            steps[rectangles[r, 3 - axis] + 1] -= weights[r]
    taken, best, where = np.int64(0), np.int64(-(2**62)), 0
    for cell in range(len(gain)):
        taken += steps[cell]
        if gain[cell] - taken > best:
            best, where = gain[cell] - taken, cell
    return best + offset, where


@kernel
def _hopeful(gain, floor):
    """Return the first and last index whose gain exceeds the floor."""
    low, high = 0, len(gain) - 1
    while gain[low] <= floor:
        low += 1
    while gain[high] <= floor:
        high -= 1
    return low, high


@kernel
def _add(tree, lazy, size, first, last, value):
    """Add ``value`` to leaves ``first`` to ``last``; ``tree[1]`` is the maximum of all.

    Bottom-up: ``lazy[v]`` was added to the whole subtree of v but not passed down to its children;
    ``tree[v]`` includes it.
    """
    left, right = first + size, last + size + 1
    low, high = left, right - 1
    while left < right:
        if left & 1:
            tree[left] += value
            if left < size:
                lazy[left] += value
            left += 1
        if right & 1:
            right -= 1
            tree[right] += value
            if right < size:
                lazy[right] += value
        left >>= 1
        right >>= 1
    low >>= 1
    high >>= 1
    while low:
        tree[low] = max(tree[2 * low], tree[2 * low + 1]) + lazy[low]
        if high != low:
            tree[high] = max(tree[2 * high], tree[2 * high + 1]) + lazy[high]
        low >>= 1
        high >>= 1
