# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The cheapest views of every sample, kept up to date while cameras move.

A sample's ranking is a row of keys, ascending: the cost in units above the view's number. Keys sort
by cost, ties by number, and fit a cache line. Where fewer views see the sample, keys of nobody
stand for those that are missing.
"""

from __future__ import annotations

import numpy as np
from numba import prange

from focus_planner.core.kernels.camera_tuples import NEVER
from focus_planner.core.kernels.compiling import kernel, parallel_kernel

#: A ranking's keys hold the view's number in so many bits.
VIEW_BITS = 18
VIEW = 2**VIEW_BITS - 1
#: More than any sum of costs: that of a choice there is not.
NO_CHOICE = np.int64(2**50)
#: The cell of a picture that is not taken.
NO_PICTURE = -2


@parallel_kernel
def rank_views(by_sample, focus, views, cell, ranking):
    """Fill every sample's ranking (N, needed + k) at these cells."""
    for p in prange(len(ranking)):
        rank(p, by_sample, focus, views, cell, ranking)


@kernel
def cost_of_rankings(ranking, needed, unseen):
    """Return what all samples cost; a view that is missing costs ``unseen`` (N,), units."""
    total = np.int64(0)
    for p in range(len(ranking)):
        for i in range(needed):
            key = ranking[p, i]
            total += unseen[p] if key & VIEW == VIEW else key >> VIEW_BITS
    return total


@kernel
def rank(p, by_sample, focus, views, cell, ranking):
    """Fill sample p's cheapest views, ascending."""
    offsets, camera, base, first, last = by_sample
    ranks = ranking.shape[1]
    for i in range(ranks):
        ranking[p, i] = (views.missing[p] << VIEW_BITS) | VIEW
    q, high = offsets[p], offsets[p + 1]
    while q < high:
        view, cost = views.number[camera[q]], NEVER
        while q < high and views.number[camera[q]] == view:
            at = cell[camera[q]]
            if at != NO_PICTURE:
                cost = min(cost, base[q] + (0 if first[q] <= at <= last[q] else focus[p]))
            q += 1
        key = (cost << VIEW_BITS) | view
        if key < ranking[p, ranks - 1]:
            i = ranks - 1
            while i > 0 and key < ranking[p, i - 1]:
                ranking[p, i] = ranking[p, i - 1]
                i -= 1
            ranking[p, i] = key


@kernel
def rerank(p, view, cost, by_sample, focus, views, cell, ranking):
    """Give a view its new cost in sample p's ranking; return whether that changed it.

    The sample's other views are looked at only where this one leaves a gap that one of them may
    fill.
    """
    ranks = ranking.shape[1]
    key = (cost << VIEW_BITS) | view
    worst = ranking[p, ranks - 1]
    at = 0
    while at < ranks and ranking[p, at] & VIEW != view:
        at += 1
    if at == ranks:
        if key >= worst:
            return False
        at = ranks - 1
    elif key > worst:
        rank(p, by_sample, focus, views, cell, ranking)
        return True
    while at > 0 and key < ranking[p, at - 1]:
        ranking[p, at] = ranking[p, at - 1]
        at -= 1
    while at < ranks - 1 and key > ranking[p, at + 1]:
        ranking[p, at] = ranking[p, at + 1]
        at += 1
    ranking[p, at] = key
    return True


@kernel
def least_beside(p, view, views, ranking):
    """Return what the last of sample p's views costs, as many as it needs, without this one."""
    for i in range(views.needed):
        if ranking[p, i] & VIEW == view:
            return ranking[p, views.needed] >> VIEW_BITS
    return ranking[p, views.needed - 1] >> VIEW_BITS


@kernel
def sums_beside(p, own, views, ranking, sums):
    """Fill sample p's least costs without some views; return whether it costs one of those now.

    ``own`` (k,) are these views. ``sums[j]`` becomes the sum of j views fewer than the sample
    needs, ``NO_CHOICE`` where j is more.
    """
    sums[:] = NO_CHOICE
    total, left, needed = np.int64(0), views.needed, False
    i = 0
    while left > 0:
        if left < len(sums):
            sums[left] = total
        view, outside = ranking[p, i] & VIEW, True
        for each in own:
            if each == view:
                outside = False
        if outside:
            total += ranking[p, i] >> VIEW_BITS
            left -= 1
        else:
            needed |= i < views.needed
        i += 1
    sums[0] = total
    return needed


@kernel
def held_by_another(c, view, first, last, views, cell):
    """Return whether a shot of a view, other than camera c, is at one of these cells."""
    for shot in range(views.offsets[view], views.offsets[view + 1]):
        if shot != c and first <= cell[shot] <= last:
            return True
    return False
