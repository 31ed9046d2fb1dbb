# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Plants in pots: many thin leaves that hide each other.

Leaves are closed thin solids: a planner takes the outer side of a mesh as the visible one, so an
open sheet would be seen from one side only. Lengths are metres of a plant as it grows here; it is
scaled afterwards.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from manifold3d import CrossSection, Manifold
from numpy.random import Generator

from focus_planner import Mesh
from focus_planner.core.arrays import FloatArray
from focus_planner.core.validation import check_number
from shapes.solids import HEIGHT, mesh, placed, turned, union

_THICKNESS = 0.003  # of leaves
_GOLDEN_ANGLE = 137.508  # degrees from leaf to leaf
_AROUND = 8  # sides of stems


def plant(seed: int, height: float = HEIGHT) -> Mesh:
    """Return a plant in a pot.

    Parameters
    ----------
    seed : int
        Three families take turns: broad leaves on branches, a rosette of straps, fronds.
    height : float
        Metres; a plant that would be wider than ``shapes.solids.WIDTH`` of this is lower.

    Raises
    ------
    InputError
        If the height is not a positive number.
    """
    check_number("height", height, above=0)
    rng = np.random.default_rng(seed)
    solid = union(_FAMILIES[seed % len(_FAMILIES)](rng))
    return mesh(placed(solid, height))


def _bush(rng: Generator) -> Iterator[Manifold]:
    """Yield a pot, a stem, branches and their broad leaves."""
    yield _pot(rng, 0.0)
    trunk = _path(rng, np.zeros(3), 90.0, 0.0, 1.15, 0.1)
    yield _stem(trunk, 0.022, 0.008)
    yield from _leaves(rng, trunk[len(trunk) // 2 :], 8)
    for i in range(int(rng.integers(7, 12))):
        start = trunk[int(rng.integers(len(trunk) // 4, len(trunk) - 3))]
        azimuth = _GOLDEN_ANGLE * i + rng.uniform(-20.0, 20.0)
        branch = _path(rng, start, rng.uniform(30.0, 60.0), azimuth, rng.uniform(0.3, 0.5), 0.2)
        yield _stem(branch, 0.011, 0.005)
        yield from _leaves(rng, branch[2:], int(rng.integers(5, 8)))


def _leaves(rng: Generator, path: FloatArray, count: int) -> Iterator[Manifold]:
    """Yield leaves along a path, each turned by the golden angle."""
    first = rng.uniform(0.0, 360.0)
    for i, place in enumerate(np.linspace(0, len(path) - 1, count)):
        length = rng.uniform(0.16, 0.26)
        width, curvature = rng.uniform(0.24, 0.34) * length, rng.uniform(0.5, 2.0) / length
        leaf = _leaf(length, width, curvature, 12)
        yield _grown(leaf, path[int(place)], rng.uniform(5.0, 55.0), first + _GOLDEN_ANGLE * i)


def _rosette(rng: Generator) -> Iterator[Manifold]:
    """Yield a pot, a short trunk and straps: inner ones steep, outer ones flat and hanging."""
    yield _pot(rng, rng.uniform(0.25, 0.45))
    trunk = _path(rng, np.zeros(3), 90.0, 0.0, rng.uniform(0.3, 0.5), 0.05)
    yield _stem(trunk, 0.035, 0.03)
    count = int(rng.integers(28, 43))
    for i in range(count):
        steep = (i + 0.5) / count
        length = rng.uniform(0.5, 0.65)
        curvature = rng.uniform(0.8, 2.2) * (1.3 - steep) / 0.6
        leaf = _leaf(length, rng.uniform(0.022, 0.034), curvature, 16)
        at = trunk[-1] - [0.0, 0.0, 0.08 * (1 - steep)]
        yield _grown(leaf, at, 10.0 + 75.0 * steep + rng.uniform(-5.0, 5.0), _GOLDEN_ANGLE * i)


def _fern(rng: Generator) -> Iterator[Manifold]:
    """Yield a pot and fronds: arching ribs with leaflets on either side."""
    yield _pot(rng, rng.uniform(0.6, 0.9))
    count = int(rng.integers(8, 12))
    for i in range(count):
        elevation = 60.0 + 28.0 * i / count
        length = rng.uniform(0.65, 0.85)
        rib = _path(
            rng, np.zeros(3), elevation, _GOLDEN_ANGLE * i, length, 0.02, drop=rng.uniform(0.6, 1.1)
        )
        yield _stem(rib, 0.008, 0.005)
        yield from _leaflets(rng, rib)


def _leaflets(rng: Generator, rib: FloatArray) -> Iterator[Manifold]:
    """Yield pairs of leaflets along a rib, longest in its middle."""
    pairs = int(rng.integers(8, 12))
    for place in np.linspace(0.15, 0.97, pairs):
        at = rib[int(place * (len(rib) - 1))]
        ahead = rib[-1] - rib[0]
        azimuth = float(np.degrees(np.arctan2(ahead[1], ahead[0])))
        length = 0.15 * float(np.sqrt(np.sin(np.pi * place**0.8))) + 0.04
        for side in (-1.0, 1.0):
            leaf = _leaf(length, 0.17 * length, 1.2 / length, 6)
            yield _grown(leaf, at, rng.uniform(0.0, 25.0), azimuth + side * rng.uniform(55.0, 75.0))


def _leaf(length: float, half_width: float, curvature: float, pieces: int) -> Manifold:
    """Return a leaf from the origin along x, folded at its midrib and bent downwards.

    Parameters
    ----------
    length, half_width : float
        Metres.
    curvature : float
        Radians per metre.
    pieces : int
        Of its length, in which it is bent.
    """
    across = np.array([-1.0, -0.5, 0.0, 0.5, 1.0])
    edges = [np.stack([across, np.full(5, rise)], axis=1) for rise in (0.0, _THICKNESS)]
    strip = Manifold.extrude(CrossSection([np.vstack([edges[0], edges[1][::-1]])]), 1.0, pieces)

    def bent(points: FloatArray) -> FloatArray:
        side, rise, along = points.T
        wide = half_width * (0.12 + 2.3 * np.sqrt(along) * (1 - along))
        rise = rise + 0.3 * wide * np.abs(side)
        angle, reach = curvature * length * along, 1 / curvature + rise
        return np.stack(
            [reach * np.sin(angle), side * wide, reach * np.cos(angle) - 1 / curvature], axis=1
        )

    return strip.warp_batch(bent)


def _grown(leaf: Manifold, at: FloatArray, elevation: float, azimuth: float) -> Manifold:
    """Return a leaf that begins at a place and points in a direction, degrees."""
    return leaf.rotate((0.0, -elevation, azimuth)).translate(at)


def _path(
    rng: Generator,
    start: FloatArray,
    elevation: float,
    azimuth: float,
    length: float,
    wander: float,
    *,
    drop: float = 0.0,
) -> FloatArray:
    """Return (17, 3) points of a path that wanders, and by ``drop`` radians turns downwards."""
    up = np.radians(elevation) - drop * np.linspace(0.0, 1.0, 16)
    around = np.radians(azimuth)
    ways = np.stack([np.cos(up) * np.cos(around), np.cos(up) * np.sin(around), np.sin(up)], axis=1)
    ways += np.cumsum(rng.normal(0.0, wander / 4, ways.shape), axis=0)
    ways *= length / 16 / np.sqrt((ways**2).sum(axis=1, keepdims=True))
    path: FloatArray = np.vstack([start, start + np.cumsum(ways, axis=0)])
    return path


def _stem(path: FloatArray, radius: float, end_radius: float) -> Manifold:
    """Return a stem along a path, thinner towards its end."""
    radii = np.linspace(radius, end_radius, len(path))
    knots = [
        Manifold.sphere(r, _AROUND).translate(at)
        for at, r in zip(path, radii.tolist(), strict=True)
    ]
    return union(Manifold.batch_hull(knots[i : i + 2]) for i in range(len(knots) - 1))


def _pot(rng: Generator, stand: float) -> Manifold:
    """Return a pot with soil just below z = 0, on a stand of a height."""
    height, rim = rng.uniform(0.18, 0.3), rng.uniform(0.12, 0.17)
    foot, ground = rim * rng.uniform(0.6, 0.85), -height - stand
    outline = [
        *([foot, -height], [rim - 0.01, -0.02], [rim + 0.008, -0.02], [rim + 0.008, 0.025]),
        *([rim - 0.012, 0.025], [rim - 0.012, -0.005], [0.0, -0.005]),
    ]
    base = [[0.0, ground]]
    if stand:
        base = [
            *([0.0, ground], [1.3 * rim, ground], [1.3 * rim, ground + 0.03]),
            *([0.35 * rim, ground + 0.06], [0.3 * rim, -height - 0.06]),
            *([1.1 * rim, -height - 0.03], [1.1 * rim, -height]),
        ]
    return turned(np.array([*base, *outline])).refine_to_length(0.04)


_FAMILIES = (_bush, _rosette, _fern)
