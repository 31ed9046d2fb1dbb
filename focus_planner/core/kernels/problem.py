# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The pairs of a sample and a camera that sees it, and what they cost."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import prange

from focus_planner.core.arrays import FloatArray, IntArray, Offsets
from focus_planner.core.kernels.compiling import kernel, parallel_kernel

#: The camera of a sample that no camera sees.
UNSEEN = -1
#: The focus distance of a picture that is not taken.
UNTAKEN = -np.inf


class CostTerms(NamedTuple):
    """The constants of the base cost: the first two terms of Eq. 1.

    Attributes
    ----------
    area_weight, deviation_weight : float
        w₁ and w₂.
    area_scale : float
        ε₁, 1/m².
    deviation_limit : float
        ε₂, metres.
    """

    area_weight: float
    deviation_weight: float
    area_scale: float
    deviation_limit: float


class PairCosts(NamedTuple):
    """What the P pairs of a sample and a camera cost, sample by sample.

    Attributes
    ----------
    offsets : (N + 1,) array of int64
    camera : (P,) array of int32
    base : (P,) array
        In focus.
    near, far : (P,) arrays
        The focus distances that hold the sample in focus, metres.
    weight : float
        w₃, what a pair costs more out of focus.
    """

    offsets: Offsets
    camera: IntArray
    base: FloatArray
    near: FloatArray
    far: FloatArray
    weight: float


@kernel
def _cost(pairs, q, focus):
    """Return what pair q costs at the cameras' focus distances (C,)."""
    s = focus[pairs.camera[q]]
    if s == UNTAKEN:
        return np.inf
    if pairs.near[q] <= s <= pairs.far[q]:
        return pairs.base[q]
    return pairs.base[q] + pairs.weight  # also where s is NaN: a camera without a distance


@kernel
def _cheapest_one(p, pairs, focus, best):
    """Fill sample p's cheapest camera of all; return what it costs, 1 if there is none.

    Without branches to guess.
    """
    best[0] = UNSEEN
    least = np.inf
    for q in range(pairs.offsets[p], pairs.offsets[p + 1]):
        s = focus[pairs.camera[q]]
        held = (pairs.near[q] <= s) & (s <= pairs.far[q])  # not where s is NaN
        cost = pairs.base[q] + (0.0 if held else pairs.weight)
        cost = np.inf if s == UNTAKEN else cost
        best[0] = pairs.camera[q] if cost < least else best[0]
        least = min(cost, least)
    return 1.0 if best[0] == UNSEEN else least


@kernel
def _least_costs(p, pairs, focus, view, best, least):
    """Fill sample p's cheapest cameras, each of another view, and what they cost; return the sum.

    A view that is missing costs 1.
    """
    best[:] = UNSEEN
    least[:] = np.inf
    q, high = pairs.offsets[p], pairs.offsets[p + 1]
    while q < high:
        here, cheapest, which = view[pairs.camera[q]], np.inf, UNSEEN
        while q < high and view[pairs.camera[q]] == here:
            cost = _cost(pairs, q, focus)
            if cost < cheapest:
                cheapest, which = cost, pairs.camera[q]
            q += 1
        at = len(least)
        while at > 0 and cheapest < least[at - 1]:
            at -= 1
            if at + 1 < len(least):
                least[at + 1], best[at + 1] = least[at], best[at]
        if at < len(least):
            least[at], best[at] = cheapest, which
    total = 0.0
    for i in range(len(least)):
        total += 1.0 if best[i] == UNSEEN else least[i]
    return total


@parallel_kernel
def best_cameras(pairs, focus, view, costs, best):
    """Fill ``costs`` (N,) and ``best`` (N, needed), the cameras with the least costs (Eq. 2 and 5).

    A sample costs the mean over as many views as ``best`` has columns. ``view`` (C,) tells the
    cameras that are one view, those of neighbouring indices: it costs what the best of them does. A
    view that is missing costs 1, its camera is ``UNSEEN``. Ties go to the first camera.
    """
    count = best.shape[1]
    if count == 1:
        for p in prange(len(costs)):
            costs[p] = _cheapest_one(p, pairs, focus, best[p])
        return
    for p in prange(len(costs)):
        costs[p] = _least_costs(p, pairs, focus, view, best[p], np.empty(count)) / count


@parallel_kernel
def held_in_best(pairs, focus, best, held):
    """Fill ``held`` (N,): whether each sample is in focus in camera ``best`` (N,).

    ``focus`` (C,) are focus distances; a sample is held by no camera that does not see it.
    """
    for p in prange(len(held)):
        held[p] = False
        for q in range(pairs.offsets[p], pairs.offsets[p + 1]):
            if pairs.camera[q] == best[p]:
                s = focus[best[p]]
                held[p] = (pairs.near[q] <= s) & (s <= pairs.far[q])


@parallel_kernel
def base_costs(samples, poses, sample_index, camera_index, terms, depth, base_cost):
    """Fill ``depth`` and ``base_cost`` (P,) of pairs of a sample and a camera (Eq. 1).

    Parameters
    ----------
    samples : tuple of (N, 3) arrays
        Points, metres, and outward normals.
    poses : tuple of (C, 3) and (C, 3, 3) arrays
        The cameras' positions, metres, and rotations.
    sample_index, camera_index : (P,) arrays of int32
    terms : CostTerms
    depth, base_cost : (P,) arrays
        Filled; depth along the optical axis, metres.
    """
    for q in prange(len(sample_index)):
        p, c = sample_index[q], camera_index[q]
        depth[q], base_cost[q] = _base_cost(p, c, samples, poses, terms)


@kernel
def _base_cost(p, c, samples, poses, terms):
    """Return the depth and the base cost of sample p in camera c."""
    points, normals = samples
    positions, rotations = poses
    dx = points[p, 0] - positions[c, 0]
    dy = points[p, 1] - positions[c, 1]
    dz = points[p, 2] - positions[c, 2]
    r = rotations[c]
    x = r[0, 0] * dx + r[1, 0] * dy + r[2, 0] * dz
    y = r[0, 1] * dx + r[1, 1] * dy + r[2, 1] * dz
    z = r[0, 2] * dx + r[1, 2] * dy + r[2, 2] * dz
    # The paper's normals point inward, these outward: hence the sign.
    cosine = -(r[0, 2] * normals[p, 0] + r[1, 2] * normals[p, 1] + r[2, 2] * normals[p, 2])
    area = 1.0
    if cosine > 0:
        area = min(terms.area_scale * z * z / cosine, 1.0)
    deviation = min(np.sqrt(x * x + y * y) / terms.deviation_limit, 1.0)
    return z, terms.area_weight * area + terms.deviation_weight * deviation


@parallel_kernel
def focus_intervals(depth, camera, kind, optics, tolerance, near, far):
    """Fill ``near`` and ``far`` (n,): the focus distances that hold each depth in focus, metres.

    See :func:`focus_planner.core.rig.optics.focus_interval`. An empty interval is (inf, -inf).

    Parameters
    ----------
    depth : (n,) array
        Metres.
    camera : (n,) array of int32
    kind : (C,) array of int32
        Each camera's kind of lens.
    optics : (K, 4) array
        Of each kind: the hyperfocal distance, the focal length, and the least and greatest
        distance that it can be set to, metres.
    tolerance : float
        Metres.
    """
    for q in prange(len(depth)):
        h, f, least, most = optics[kind[camera[q]]]
        back, front = depth[q] + tolerance, depth[q] - tolerance
        nearest, farthest = np.inf, -np.inf
        if front > f:
            nearest = max(np.divide(back * (h + f), h + back), least)
            farthest = most
            if h - front > 0:
                farthest = min(np.divide(front * (h - f), h - front), most)
        if not nearest <= farthest:
            nearest, farthest = np.inf, -np.inf
        near[q], far[q] = nearest, farthest


@kernel
def sort_by_sample(camera_offsets, sample_index, sample_offsets):
    """Return the camera-by-camera pairs in the order of their samples, cameras ascending.

    Fills ``sample_offsets`` (N + 1,). A counting sort, so equal samples keep the cameras' order.
    """
    for p in sample_index:
        sample_offsets[p + 1] += 1
    for p in range(len(sample_offsets) - 1):
        sample_offsets[p + 1] += sample_offsets[p]
    at = sample_offsets[:-1].copy()
    sample = np.empty(len(sample_index), dtype=np.int32)
    camera = np.empty(len(sample_index), dtype=np.int32)
    for c in range(len(camera_offsets) - 1):
        for j in range(camera_offsets[c], camera_offsets[c + 1]):
            p = sample_index[j]
            camera[at[p]] = c
            at[p] += 1
    for p in range(len(sample_offsets) - 1):
        sample[sample_offsets[p] : sample_offsets[p + 1]] = p
    return sample, camera


@kernel
def sort_by_camera(camera_index, camera_offsets):
    """Return (P,) the indices of the pairs, camera by camera, each camera's ascending."""
    at = camera_offsets[:-1].copy()
    pairs = np.empty(len(camera_index), dtype=np.int32)
    for q in range(len(camera_index)):
        c = camera_index[q]
        pairs[at[c]] = q
        at[c] += 1
    return pairs
