# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Smooth bodies: tapered capsules that melt into each other, and noise on their surface."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from manifold3d import Manifold
from numpy.random import Generator

from focus_planner.core.arrays import FloatArray
from shapes.solids import Vector

#: (n,) metres of (n, 3) points.
Field = Callable[[FloatArray], FloatArray]

_STEPS = 3  # from the grid's surface to that of the field


@dataclass(frozen=True)
class Limb:
    """A capsule from ``start`` to ``end`` whose radius changes from one to the other, metres."""

    start: Vector
    end: Vector
    radius: float
    end_radius: float


class Melted:
    """The union of limbs, blended where they are within about ``softness`` metres.

    Called with (n, 3) points, it returns their signed distances, metres, positive inside, near
    the surface and approximately.
    """

    def __init__(self, limbs: Sequence[Limb], softness: float) -> None:
        self._softness = softness
        self._start = np.array([limb.start for limb in limbs])
        self._axes = np.array([limb.end for limb in limbs]) - self._start
        self._squares = np.maximum((self._axes**2).sum(axis=1), 1e-12)
        self._radii = np.array([limb.radius for limb in limbs])
        self._growth = np.array([limb.end_radius for limb in limbs]) - self._radii
        ends = np.stack([self._start, self._start + self._axes])
        reach = np.maximum(self._radii, self._radii + self._growth)[:, None] + 4 * softness
        #: (6,) of a box around all: least x, y, z, greatest x, y, z.
        self.bounds = np.concatenate(
            [(ends - reach).min(axis=(0, 1)), (ends + reach).max(axis=(0, 1))]
        )

    def __call__(self, points: FloatArray) -> FloatArray:
        """Return (n,) signed distances of (n, 3) points."""
        inside = self._each(points)[0] / self._softness
        blended: FloatArray = np.logaddexp.reduce(inside, axis=1)
        return self._softness * blended

    def normals(self, points: FloatArray) -> FloatArray:
        """Return (n, 3) unit vectors outward, as if limbs were not tapered."""
        inside, away, distances = self._each(points)
        shares = np.exp((inside - inside.max(axis=1, keepdims=True)) / self._softness)
        return _unit(np.einsum("nl,nlk->nk", shares / np.maximum(distances, 1e-12), away))

    def _each(self, points: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return how far points are inside each limb, and the ways from its axis, with lengths.

        They are (n, limbs), (n, limbs, 3) and (n, limbs). Called for one point at a time, it
        takes what NumPy does with the fewest calls.
        """
        offsets = points[:, None] - self._start
        along = np.einsum("nlk,lk->nl", offsets, self._axes) / self._squares
        along = np.minimum(np.maximum(along, 0.0), 1.0)
        away = offsets - along[..., None] * self._axes
        distances = np.sqrt(np.einsum("nlk,nlk->nl", away, away))
        return self._radii + along * self._growth - distances, away, distances


def sculpted(field: Melted, edge: float, pieces: int, heights: Field) -> Manifold:
    """Return the solid of a field, its surface moved outwards by ``heights``, metres.

    Parameters
    ----------
    field : Melted
    edge : float
        Metres, of the grid that finds the surface.
    pieces : int
        Into how many edges are split then.
    heights : callable
        Of (n, 3) points on the surface.
    """
    coarse = Manifold.level_set(
        lambda x, y, z: float(field(np.array([[x, y, z]]))[0]), field.bounds.tolist(), edge
    )

    def moved(points: FloatArray) -> FloatArray:
        for _ in range(_STEPS):
            points = points + field(points)[:, None] * field.normals(points)
        return points + heights(points)[:, None] * field.normals(points)

    return coarse.refine(pieces).warp_batch(moved)


def waves(
    rng: Generator, shortest: float, longest: float, height: float, *, count: int = 48
) -> Field:
    """Return band-limited noise: waves in random directions, long ones higher.

    Parameters
    ----------
    rng : Generator
    shortest, longest : float
        Of the wavelengths, metres.
    height : float
        Root of the mean square, metres.
    count : int
        Of waves.
    """
    lengths = np.exp(rng.uniform(np.log(shortest), np.log(longest), count))
    vectors = 2 * np.pi * _unit(rng.normal(size=(count, 3))) / lengths[:, None]
    phases = rng.uniform(0.0, 2 * np.pi, count)
    amplitudes = height * lengths / np.sqrt((lengths**2).sum() / 2)

    def noise(points: FloatArray) -> FloatArray:
        total: FloatArray = np.sin(points @ vectors.T + phases) @ amplitudes
        return total

    return noise


def _unit(vectors: FloatArray) -> FloatArray:
    unit: FloatArray = vectors / np.sqrt((vectors**2).sum(axis=1, keepdims=True))
    return unit
