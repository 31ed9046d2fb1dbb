# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Statues: figures and busts on plinths, smooth forms with noise along their normals.

They are drawn in metres, of a person's size, and scaled afterwards.
"""

from __future__ import annotations

import numpy as np
from manifold3d import Manifold
from numpy.random import Generator

from focus_planner import Mesh
from focus_planner.core.arrays import FloatArray
from focus_planner.core.validation import check_number
from shapes.limbs import Field, Limb, Melted, sculpted, waves
from shapes.solids import HEIGHT, Vector, mesh, placed, split, turned, union

_SOFTNESS = 0.012  # metres, of figures
_EDGE = 0.042  # of the grid that finds their surface
_PIECES = 80  # edges per height, of plinths


def statue(seed: int, height: float = HEIGHT) -> Mesh:
    """Return a statue on a plinth, its front towards +x.

    Parameters
    ----------
    seed : int
        Figures, the draped ones among them, and busts take turns.
    height : float
        Metres, of statue and plinth.

    Raises
    ------
    InputError
        If the height is not a positive number.
    """
    check_number("height", height, above=0)
    rng = np.random.default_rng(seed)
    solid = _bust(rng) if seed % 2 else _figure(rng, draped=seed % 4 == 2)
    return mesh(split(placed(solid, height), height, _PIECES))


def _figure(rng: Generator, *, draped: bool) -> Manifold:
    """Return a standing figure on a low plinth."""
    limbs = [*_torso(), *_head(rng, (0.0, 0.0, 1.62), 1.0)]
    for side in (-1.0, 1.0):
        limbs += _arm(rng, side)
    limbs += _robe(rng) if draped else [*_leg(rng, -1.0), *_leg(rng, 1.0)]
    noise = waves(rng, 0.05, 0.3, 0.004)
    folds = _folds(rng) if draped else waves(rng, 0.03, 0.1, 0.002)
    figure = sculpted(
        Melted(limbs, _SOFTNESS), _EDGE, 3, lambda points: noise(points) + folds(points)
    )
    base = 0.34 if draped else 0.29
    return union([figure, _plinth(rng, base, rng.uniform(0.15, 0.4)).translate((0.0, 0.0, 0.03))])


def _bust(rng: Generator) -> Manifold:
    """Return a head and shoulders on a pedestal, twice as large as a figure's."""
    limbs = _head(rng, (0.03, 0.0, 0.56), 1.15)
    limbs += [
        Limb((0.0, 0.0, 0.36), (0.03, 0.0, 0.52), 0.08, 0.066),
        Limb((-0.01, -0.19, 0.3), (-0.01, 0.19, 0.3), 0.085, 0.085),
        Limb((0.03, -0.1, 0.2), (0.03, 0.1, 0.2), 0.125, 0.125),
        Limb((0.0, 0.0, -0.02), (0.0, 0.0, 0.2), 0.1, 0.12),
    ]
    noise, fine = waves(rng, 0.05, 0.2, 0.003), waves(rng, 0.02, 0.05, 0.001)
    bust = sculpted(Melted(limbs, _SOFTNESS), _EDGE, 4, lambda points: noise(points) + fine(points))
    bust = bust.trim_by_plane((0.0, 0.0, 1.0), 0.0)
    return union([bust, _plinth(rng, rng.uniform(0.17, 0.21), rng.uniform(0.2, 0.4))])


def _torso() -> list[Limb]:
    return [
        Limb((0.0, -0.07, 0.98), (0.0, 0.07, 0.98), 0.105, 0.105),  # hips
        Limb((0.01, -0.04, 1.0), (0.02, -0.07, 1.3), 0.1, 0.11),
        Limb((0.01, 0.04, 1.0), (0.02, 0.07, 1.3), 0.1, 0.11),
        Limb((0.0, -0.15, 1.4), (0.0, 0.15, 1.4), 0.06, 0.06),  # shoulders
        Limb((0.0, 0.0, 1.42), (0.015, 0.0, 1.58), 0.06, 0.05),  # neck
    ]


def _head(rng: Generator, middle: Vector, size: float) -> list[Limb]:
    """Return a head with a nose, a chin, ears, and hair or a knot of it."""
    x, y, z = middle
    turn = rng.uniform(-0.6, 0.6)

    def limb(start: Vector, end: Vector, radius: float, end_radius: float) -> Limb:
        ends = []
        for forward, left, up in (start, end):
            ahead = forward * np.cos(turn) - left * np.sin(turn)
            aside = forward * np.sin(turn) + left * np.cos(turn)
            ends.append((x + size * ahead, y + size * aside, z + size * up))
        return Limb(ends[0], ends[1], size * radius, size * end_radius)

    chin, nose, back = rng.uniform(0.045, 0.075), rng.uniform(0.1, 0.125), rng.uniform(0.05, 0.1)
    return [
        limb((-0.015, 0.0, 0.06), (0.03, 0.0, 0.0), 0.093, 0.07),
        limb((0.05, 0.0, -0.05), (chin, 0.0, -0.075), 0.04, 0.028),
        limb((0.085, 0.0, 0.055), (nose, 0.0, 0.005), 0.01, 0.017),
        limb((0.075, -0.04, 0.065), (0.075, 0.04, 0.065), 0.018, 0.018),  # brow
        limb((0.0, -0.088, 0.0), (-0.01, -0.092, 0.045), 0.01, 0.016),
        limb((0.0, 0.088, 0.0), (-0.01, 0.092, 0.045), 0.01, 0.016),
        limb((-back, 0.0, rng.uniform(-0.04, 0.12)), (-0.02, 0.0, 0.08), 0.055, 0.09),
    ]


def _arm(rng: Generator, side: float) -> list[Limb]:
    """Return an arm in a random pose; ``side`` is 1 for the left one, which is at +y."""
    shoulder = np.array([0.0, 0.17 * side, 1.39])
    swing, lift = rng.uniform(-0.3, 0.9), rng.uniform(0.25, 1.3)
    upper = np.array([np.sin(swing), side * np.sin(lift), -np.cos(lift)])
    bend = rng.uniform(0.0, 1.0)
    lower = (1 - bend) * upper + bend * np.array([0.7, -0.2 * side, rng.uniform(-0.2, 1.0)])
    elbow = shoulder + 0.28 * upper / np.sqrt((upper**2).sum())
    wrist = elbow + 0.25 * lower / np.sqrt((lower**2).sum())
    hand = wrist + 0.09 * lower / np.sqrt((lower**2).sum())
    return [
        Limb(_at(shoulder), _at(elbow), 0.055, 0.042),
        Limb(_at(elbow), _at(wrist), 0.042, 0.03),
        Limb(_at(wrist), _at(hand), 0.032, 0.028),
    ]


def _leg(rng: Generator, side: float) -> list[Limb]:
    """Return a leg, a little bent and apart from the other one."""
    hip = np.array([0.0, 0.09 * side, 0.95])
    ankle = np.array([rng.uniform(-0.12, 0.1), rng.uniform(0.1, 0.15) * side, 0.08])
    knee = (hip + ankle) / 2 + [rng.uniform(0.02, 0.09), rng.uniform(0.0, 0.03) * side, 0.02]
    toes = ankle + [0.15, 0.05 * side, -0.04]
    return [
        Limb(_at(hip), _at(knee), 0.088, 0.058),
        Limb(_at(knee), _at(ankle), 0.058, 0.04),
        Limb(_at(ankle), _at(toes), 0.045, 0.032),
    ]


def _robe(rng: Generator) -> list[Limb]:
    """Return a robe from the waist to the ground, over one knee."""
    side = rng.choice([-1.0, 1.0])
    return [
        Limb((0.0, 0.0, 1.0), (0.0, 0.0, 0.2), 0.14, rng.uniform(0.19, 0.24)),
        Limb((0.05, 0.08 * side, 0.9), (0.12, 0.1 * side, 0.52), 0.09, 0.08),
    ]


def _folds(rng: Generator) -> Field:
    """Return folds that hang below the waist, deeper towards the ground."""
    counts = rng.integers(7, 16, 4)
    phases, leans = rng.uniform(0.0, 2 * np.pi, 4), rng.uniform(-2.0, 2.0, 4)
    deep = rng.uniform(0.004, 0.007)

    def folds(points: FloatArray) -> FloatArray:
        angles = np.arctan2(points[:, 1], points[:, 0])[:, None]
        below = np.clip((0.98 - points[:, 2]) / 0.6, 0.0, 1.0)
        height: FloatArray = (
            deep * below * np.sin(counts * angles + leans * points[:, 2:] + phases).sum(axis=1)
        )
        return height

    return folds


def _plinth(rng: Generator, radius: float, height: float) -> Manifold:
    """Return a plinth below z = 0, round or square, with a foot and a cornice."""
    outline = np.array(
        [
            *([0.0, -height - 0.16], [1.3, -height - 0.16], [1.3, -height - 0.1]),
            *([1.12, -height - 0.08], [1.02, -height - 0.03], [0.9, -height], [0.84, -0.14]),
            *([0.92, -0.08], [1.08, -0.05], [1.08, 0.0], [0.0, 0.0]),
        ]
    )
    if rng.integers(2):
        return turned(outline * [np.sqrt(2) * radius, 1.0], 4).rotate((0.0, 0.0, 45.0))
    return turned(outline * [radius, 1.0])


def _at(point: FloatArray) -> Vector:
    x, y, z = point.tolist()
    return x, y, z
