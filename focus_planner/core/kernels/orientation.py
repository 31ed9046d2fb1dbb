# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Signs of normals: how neighbours agree, and joining those that do."""

from __future__ import annotations

import numpy as np
from numba import prange

from focus_planner.core.kernels.compiling import kernel, parallel_kernel


@parallel_kernel
def agreement(points, normals, index, agreed):
    """Fill (M, K) how well points' normals agree with those of their neighbours, from -1 to 1.

    A normal mirrored in the plane midway to a neighbour is the neighbour's, on a plane, a circle
    and across a gap between two sheets. It is 0 for a point itself.
    """
    for p in prange(len(index)):
        for k in range(index.shape[1]):
            q = index[p, k]
            square = here = there = cosine = 0.0
            for a in range(3):
                offset = points[q, a] - points[p, a]
                square += offset * offset
                here += normals[p, a] * offset
                there += normals[q, a] * offset
                cosine += normals[p, a] * normals[q, a]
            if square > 0:
                cosine -= 2 * here * there / square
            agreed[p, k] = cosine if q != p else 0.0


@kernel
def join(low, high, evidence, certain, count):
    """Join each group to the neighbour with the strongest evidence.

    Parameters
    ----------
    low, high : (E,) arrays
        Pairs of ``count`` groups.
    evidence : (E,) array
        Positive if the two have the same sign, negative if opposite ones.
    certain : (E,) array of bool
        Pairs that may be joined.

    Returns
    -------
    group : (count,) array of int64
        The new groups, numbered from 0.
    turned : (count,) array of bool
        Whether a group has the opposite sign of its new group.
    groups : int
    """
    best = np.zeros(count)
    for e in range(len(low)):
        if certain[e]:
            best[low[e]] = max(best[low[e]], abs(evidence[e]))
            best[high[e]] = max(best[high[e]], abs(evidence[e]))
    parent, turned = np.arange(count), np.zeros(count, dtype=np.bool_)
    for e in range(len(low)):
        strength = abs(evidence[e])
        if not certain[e] or strength < min(best[low[e]], best[high[e]]):
            continue
        one, one_turned = _root(parent, turned, low[e])
        other, other_turned = _root(parent, turned, high[e])
        if one != other:
            # The lower one stays: groups are numbered by their first member.
            parent[max(one, other)] = min(one, other)
            turned[max(one, other)] = one_turned ^ other_turned ^ (evidence[e] < 0)
    group, groups = np.empty(count, dtype=np.int64), 0
    opposite = np.empty(count, dtype=np.bool_)
    for g in range(count):
        root, opposite[g] = _root(parent, turned, g)
        if root == g:
            group[g] = groups
            groups += 1
        else:
            group[g] = group[root]
    return group, opposite, groups


@kernel
def _root(parent, turned, member):
    """Return a member's root and whether their signs are opposite; shorten the way there."""
    root, opposite = member, False
    while parent[root] != root:
        opposite ^= turned[root]
        root = parent[root]
    left = opposite
    while parent[member] != root and member != root:
        above, step = parent[member], turned[member]
        parent[member], turned[member] = root, left
        left ^= step
        member = above
    return root, opposite


@parallel_kernel
def refine(points, normals, index, same_sheet, few, refined, counts):
    """Fit a plane to each point and those of its neighbours that are on the same sheet.

    Fills (M, 3) normals, with the signs of those given, and (M,) how many neighbours, the point
    itself not included, are on its sheet: whose normals have a cosine of at least ``same_sheet``
    with its own. With fewer than ``few`` of them a normal stays as it is, and all neighbours count.
    """
    for p in prange(len(index)):
        mean, moments = np.zeros(3), np.zeros((3, 3))
        count = 0
        for k in range(index.shape[1]):
            q = index[p, k]
            cosine = 0.0
            for a in range(3):
                cosine += normals[p, a] * normals[q, a]
            if q != p and cosine < same_sheet:
                continue
            count += 1
            for a in range(3):
                one = points[q, a] - points[p, a]
                mean[a] += one
                for b in range(3):
                    moments[a, b] += one * (points[q, b] - points[p, b])
        if count - 1 < few:
            refined[p], counts[p] = normals[p], index.shape[1] - 1
            continue
        counts[p] = count - 1
        for a in range(3):
            for b in range(3):
                moments[a, b] -= mean[a] * mean[b] / count
        normal = np.linalg.eigh(moments)[1][:, 0].copy()
        along = 0.0
        for a in range(3):
            along += normal[a] * normals[p, a]
        refined[p] = normal if along >= 0 else -normal
