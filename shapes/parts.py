# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Machine parts: flat faces, sharp edges, holes and pockets, by constructive solid geometry.

Parts are drawn lying on their backs, z towards the viewer, and then set up. All lengths below are
metres of a part as it is drawn; it is scaled afterwards.
"""

from __future__ import annotations

import numpy as np
from manifold3d import CrossSection, JoinType, Manifold
from numpy.random import Generator

from focus_planner import Mesh
from focus_planner.core.arrays import FloatArray
from focus_planner.core.validation import check_number
from shapes.solids import HEIGHT, box, mesh, placed, prism, ring, rod, split, union, upright

_PIECES = 56  # edges per height
_THROUGH = 1.0  # longer than any part is thick


def part(seed: int, height: float = HEIGHT) -> Mesh:
    """Return a machine part standing upright, its front towards +x.

    Parameters
    ----------
    seed : int
        Five families take turns: plate, bracket, flange, gear, housing.
    height : float
        Metres; a part that would be wider than ``shapes.solids.WIDTH`` of this is lower.

    Raises
    ------
    InputError
        If the height is not a positive number.
    """
    return mesh(split(solid(seed, height), height, _PIECES))


def solid(seed: int, height: float = HEIGHT) -> Manifold:
    """Return the same part with as few triangles as its faces need."""
    check_number("height", height, above=0)
    rng = np.random.default_rng(seed)
    return placed(upright(_FAMILIES[seed % len(_FAMILIES)](rng)), height)


def _plate(rng: Generator) -> Manifold:
    """Return a plate with ribs, bosses, a window and rows of holes."""
    width, length = rng.uniform(0.55, 0.8), rng.uniform(1.0, 1.4)
    thickness, rise = rng.uniform(0.03, 0.06), rng.uniform(0.05, 0.14)
    inset = rng.uniform(0.06, 0.09)
    corner = rng.uniform(0.02, inset)
    square = CrossSection.square((width - 2 * corner, length - 2 * corner), True)
    join = (JoinType.Round, JoinType.Miter)[rng.integers(2)]
    plate = Manifold.extrude(square.offset(corner, join, circular_segments=48), thickness)
    across = [
        box((width - 2 * inset, thickness, rise), (0.0, y, thickness))
        for y in _spaced(length / 2 - 2 * inset, rng.integers(2, 5))
    ]
    along = [
        box((0.7 * thickness, length - 3 * inset, 0.6 * rise), (x, 0.0, thickness))
        for x in _spaced(width / 2 - 2 * inset, rng.integers(1, 4))
    ]
    hole, x, y = 0.25 * inset, width / 2 - inset, length / 2 - inset
    corners = [(i, j) for i in (-x, x) for j in (-y, y)]
    bosses = [rod(1.8 * hole, 0.4 * rise, (i, j, thickness)) for i, j in corners]
    holes = [_hole(hole, i, j) for i, j in corners]
    edge = _spaced(y - 3 * hole, rng.integers(4, 9))
    holes += [_hole(0.5 * hole, i, j) for i in (-x, x) for j in edge]
    return union([plate, *across, *along, *bosses]) - union([*holes, _window(rng, width, length)])


def _window(rng: Generator, width: float, length: float) -> Manifold:
    """Return what cuts a window, round or square, through a plate."""
    size, y = rng.uniform(0.15, 0.22) * width, rng.uniform(-0.2, 0.2) * length
    if rng.integers(2):
        return _hole(size, 0.0, y)
    return box((2 * size, 1.6 * size, _THROUGH), (0.0, y, -_THROUGH / 2))


def _bracket(rng: Generator) -> Manifold:
    """Return an angle bracket: a wall on a foot, with gussets between them, and holes."""
    width, height, depth = rng.uniform(0.5, 0.7), rng.uniform(1.0, 1.3), rng.uniform(0.4, 0.55)
    thickness, gusset = rng.uniform(0.04, 0.07), rng.uniform(0.02, 0.04)
    wall = box((width, height, thickness), (0.0, height / 2, 0.0))
    foot = box((width, thickness, depth), (0.0, thickness / 2, 0.0))
    reach, rise = rng.uniform(0.6, 0.9) * depth, rng.uniform(0.5, 0.85) * height
    outline = np.array([[0.0, 0.0], [reach, 0.0], [0.15 * reach, rise], [0.0, rise]])
    web = prism(outline, gusset).rotate((0.0, -90.0, 0.0)).translate((gusset / 2, 0.0, 0.0))
    gussets = [
        web.translate((x, 0.0, 0.0)) for x in _spaced((width - gusset) / 2, rng.integers(2, 4))
    ]
    hole, x = rng.uniform(0.02, 0.035), 0.27 * width
    columns = _spaced(x, len(gussets) - 1) if len(gussets) == 3 else np.array([-x / 2, x / 2])
    rows = np.linspace(0.3, 0.9, rng.integers(3, 6)) * height
    holes = [_hole(hole, i, j) for i in columns for j in rows]
    below = [
        rod(hole, _THROUGH, (i, -j * depth, -_THROUGH / 2)).rotate((90.0, 0.0, 0.0))
        for i in columns
        for j in (0.4, 0.75)
    ]
    return union([wall, foot, *gussets]) - union([*holes, *below])


def _flange(rng: Generator) -> Manifold:
    """Return a pipe flange on a stand: a disc with bolts and a neck, stiffened by ribs."""
    radius, thickness = rng.uniform(0.4, 0.5), rng.uniform(0.05, 0.09)
    bore, wall = rng.uniform(0.12, 0.2), rng.uniform(0.03, 0.05)
    neck, foot = rng.uniform(0.2, 0.45), bore + wall + rng.uniform(0.02, 0.06)
    disc = rod(radius, thickness)
    face = rod(0.62 * radius + 0.1 * bore, rng.uniform(0.008, 0.02)).mirror((0.0, 0.0, 1.0))
    cone = rod(foot, 0.4 * neck, (0.0, 0.0, thickness), top=bore + wall)
    pipe = rod(bore + wall, neck, (0.0, 0.0, thickness))
    bolts = int(rng.integers(6, 13))
    bolt, circle = rng.uniform(0.022, 0.032), radius - 0.065
    ribs = ring(_rib(rng.uniform(0.015, 0.03), foot, circle, neck), int(rng.integers(3, 9)))
    spots = ring(rod(1.7 * bolt, _THROUGH, (circle, 0.0, thickness - 0.012)), bolts)
    through = ring(_hole(bolt, circle, 0.0), bolts)
    solid = union([disc, face, cone, pipe, ribs.translate((0.0, 0.0, thickness))])
    solid -= union([spots, through, _hole(bore, 0.0, 0.0)])
    return solid + _stand(rng, radius, 0.8 * thickness)


def _rib(thickness: float, foot: float, circle: float, neck: float) -> Manifold:
    """Return a triangular rib from a neck outwards, along +x."""
    outer = 0.5 * (foot + circle) + 0.02
    outline = np.array([[0.8 * foot, 0.0], [outer, 0.0], [0.8 * foot, 0.75 * neck]])
    return prism(outline, thickness).translate((0.0, 0.0, -thickness / 2)).rotate((90.0, 0.0, 0.0))


def _gear(rng: Generator) -> Manifold:
    """Return a spur gear on a stand: teeth, a web with holes, a hub with a bore and a keyway."""
    teeth, radius = int(rng.integers(18, 41)), rng.uniform(0.4, 0.5)
    depth = 2.25 * 2 * radius / (teeth + 2)
    face, web = rng.uniform(0.12, 0.22), rng.uniform(0.03, 0.06)
    bore = rng.uniform(0.05, 0.08)
    hub, rim = bore + rng.uniform(0.04, 0.07), radius - depth - rng.uniform(0.03, 0.05)
    body = prism(_teeth(teeth, radius, depth), face).translate((0.0, 0.0, -face / 2))
    recess = (rod(rim, _THROUGH) - rod(hub, _THROUGH)).translate((0.0, 0.0, web / 2))
    shaft = rod(hub, face + rng.uniform(0.02, 0.12), (0.0, 0.0, -face / 2))
    holes, middle = int(rng.integers(4, 8)), (hub + rim) / 2
    size = min(0.36 * (rim - hub), 0.7 * middle * np.sin(np.pi / holes))
    cuts = [recess, recess.mirror((0.0, 0.0, 1.0)), ring(_hole(size, middle, 0.0), holes)]
    key = box((0.5 * bore, bore, _THROUGH), (0.0, bore, -_THROUGH / 2))
    gear = (body - union(cuts)) + shaft
    gear -= union([_hole(bore, 0.0, 0.0), key])
    return gear + _stand(rng, radius - depth, 0.5 * face).translate((0.0, 0.0, -0.25 * face))


def _teeth(count: int, radius: float, depth: float) -> FloatArray:
    """Return the (6 count, 2) outline of a gear: straight flanks, flat tips and roots."""
    phases = np.array([-0.5, -0.28, -0.2, -0.11, 0.11, 0.2, 0.28])[1:]
    below = np.array([1.0, 0.55, 0.0, 0.0, 0.55, 1.0]) * depth
    angles = 2 * np.pi * (np.arange(count)[:, None] + phases).ravel() / count
    radii = radius - np.tile(below, count)
    return np.stack([radii * np.cos(angles), radii * np.sin(angles)], axis=1)


def _stand(rng: Generator, radius: float, thickness: float) -> Manifold:
    """Return a post on a foot, below a disc of a radius around the origin; it is ``thickness``."""
    height, width = rng.uniform(0.35, 0.5), rng.uniform(0.14, 0.24)
    post = box((width, height, thickness), (0.0, 0.015 - radius - height / 2, 0.0))
    foot = box((0.6, 0.05, 0.45), (0.0, 0.015 - radius - height, thickness / 2 - 0.225))
    return post + foot


def _housing(rng: Generator) -> Manifold:
    """Return a gearbox's housing: open pockets in front, a bearing, fins and feet behind."""
    width, length, depth = rng.uniform(0.55, 0.7), rng.uniform(1.0, 1.3), rng.uniform(0.25, 0.4)
    wall = rng.uniform(0.03, 0.05)
    columns, rows = int(rng.integers(1, 3)), int(rng.integers(2, 5))
    block = box((width, length, depth))
    size = ((width - wall) / columns - wall, (length - wall) / rows - wall)
    floors = rng.uniform(0.2, 0.6, columns * rows) * depth
    pockets = [
        box((*size, _THROUGH), (x, y, floor))
        for (x, y), floor in zip(_grid(size, wall, columns, rows), floors, strict=True)
    ]
    flange = box((width + 0.14, length + 0.14, 1.2 * wall), (0.0, 0.0, depth - 1.2 * wall))
    bolts = [
        _hole(0.016, x, y)
        for x in (-width / 2 - 0.035, width / 2 + 0.035)
        for y in _spaced(length / 2, rng.integers(4, 8))
    ]
    fins = [
        box((0.9 * width, 0.35 * wall, rng.uniform(0.05, 0.06)), (0.0, y, -0.05))
        for y in _spaced(0.42 * length, rng.integers(5, 10))
    ]
    foot = box((width + 0.14, 0.06, depth + 0.1), (0.0, -length / 2 - 0.07, -0.05))
    bearing, along = rng.uniform(0.3, 0.38) * min(size), rng.uniform(0.2, 0.3) * length
    seat = rod(bearing + 0.04, 0.1, (0.0, along, -0.08))
    solid = union([block, flange, foot, *fins, seat]) - union([*pockets, *bolts])
    return solid - _hole(bearing, 0.0, along)


def _grid(
    size: tuple[float, float], wall: float, columns: int, rows: int
) -> list[tuple[float, float]]:
    """Return the middles of pockets with walls between them, column by column."""
    x = (np.arange(columns) - (columns - 1) / 2) * (size[0] + wall)
    y = (np.arange(rows) - (rows - 1) / 2) * (size[1] + wall)
    return [(i, j) for i in x.tolist() for j in y.tolist()]


def _hole(radius: float, x: float, y: float) -> Manifold:
    """Return what drills through everything at a place."""
    return rod(radius, _THROUGH, (x, y, -_THROUGH / 2))


def _spaced(reach: float, count: int | np.integer) -> FloatArray:
    """Return ``count`` places from ``-reach`` to ``reach``; one alone is in the middle."""
    return np.linspace(-reach, reach, int(count)) if count > 1 else np.zeros(1)


_FAMILIES = (_plate, _bracket, _flange, _gear, _housing)
