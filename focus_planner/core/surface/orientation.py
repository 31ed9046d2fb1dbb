# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Patches of a cloud without normals in which the estimated normals have one sign.

Neighbouring points tell whether their normals have the same sign or opposite ones: a normal
mirrored in the plane midway between them is the other's (S. König and S. Gumhold, *VMV* 2009).
Where sheets are close, some pairs tell it wrongly. So points are joined to groups by the sum of
what all pairs between two groups tell, each group to the neighbour with the strongest sum, until
what is left is contradictory (after O. Borůvka, 1926). Cameras decide which side of a patch is out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from focus_planner.core import kernels
from focus_planner.core.arrays import FloatArray, IntArray

# Nearest neighbours that a point is compared with.
_COMPARED = 10
# Flat pairs tell more than those across an edge or a gap.
_POWER = 3
# Of the sum of what pairs between two groups tell, whatever its sign: with less, they contradict
# one another.
_AGREED = 0.7
# A neighbour whose normal is at more than 120° is on another sheet.
_SAME_SHEET = -0.5
# Fewer neighbours on a point's sheet tell no plane.
_FEW = 4


@dataclass(frozen=True, eq=False)
class Patches:
    """Normals that have one sign within each patch.

    Attributes
    ----------
    normals : (M, 3) array
    labels : (M,) array of int32
        The patch that each point belongs to, numbered from 0 by their first points.
    """

    normals: FloatArray
    labels: IntArray


def find_patches(points: FloatArray, normals: FloatArray, index: NDArray[np.int64]) -> Patches:
    """Give normals of unknown sign one sign within patches as large as possible.

    Parameters
    ----------
    points, normals : (M, 3) arrays
    index : (M, K) array of int64
        Each point's nearest neighbours, in general the point itself first.
    """
    count = len(points)
    near = np.ascontiguousarray(index[:, : _COMPARED + 1])
    evidence = np.empty(near.shape)
    kernels.agreement(points, normals, near, evidence)
    evidence = evidence.ravel() ** _POWER
    one, other = np.repeat(np.arange(count), near.shape[1]), near.ravel()
    total = np.abs(evidence)
    labels, turned = np.arange(count), np.zeros(count, dtype=bool)
    while True:
        apart = one != other
        low, high = np.minimum(one, other)[apart], np.maximum(one, other)[apart]
        if not len(low):
            break
        keys = low * count + high
        order = np.argsort(keys, kind="stable")
        keys = keys[order]
        starts = np.flatnonzero(np.concatenate([[True], keys[1:] != keys[:-1]]))
        low, high = low[order[starts]], high[order[starts]]
        evidence = np.add.reduceat(evidence[apart][order], starts)
        total = np.add.reduceat(total[apart][order], starts)
        certain = (np.abs(evidence) >= _AGREED * total) & (total > 0)
        if not certain.any():
            break
        group, opposite, count = kernels.join(low, high, evidence, certain, count)
        turned ^= opposite[labels]
        labels = group[labels]
        evidence = np.where(opposite[low] ^ opposite[high], -evidence, evidence)
        one, other = group[low], group[high]
    return Patches(np.where(turned[:, None], -normals, normals), labels.astype(np.int32))


def refine_normals(
    points: FloatArray, normals: FloatArray, index: NDArray[np.int64]
) -> tuple[FloatArray, FloatArray]:
    """Estimate normals from those neighbours only that are on the same sheet.

    Returns
    -------
    normals : (M, 3) array
        With the signs of those given.
    on_sheet : (M,) array
        How many neighbours are on a point's sheet; all of them if those are too few to tell.
    """
    refined, counts = np.empty_like(normals), np.empty(len(points))
    kernels.refine(points, normals, index, _SAME_SHEET, _FEW, refined, counts)
    return refined, counts
