# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.
"""What is wrong with geometry in practice: noise, holes, poses, and subjects that move.

Everything is drawn from a generator that is handed in, in an order that does not depend on how
large the error is: the same generator gives the same pattern at any size. Only arithmetic that
rounds alike on every machine is used.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from focus_planner.core.arrays import FloatArray
from focus_planner.core.rig.rig import Rig
from focus_planner.core.surface.scene import Scene
from focus_planner.core.surface.surface import Mesh, PointCloud, Surface, have_area

#: Metres: what is twice as far apart is displaced independently.
NOISE_SPACING = 0.05
#: Of the whole surface: what is missing in one place.
HOLE = 0.01


def noisy(scene: Scene, sigma: float, random: np.random.Generator) -> Surface:
    """Return the surface as a depth sensor measures it: displaced along its normals.

    Parameters
    ----------
    scene : Scene
    sigma : float
        Standard deviation of the displacement, metres; neighbouring places are displaced alike.
    random : Generator
    """
    surface = scene.surface
    if isinstance(surface, Mesh):
        shift = sigma * smooth_noise(surface.vertices, NOISE_SPACING, random)
        vertices = surface.vertices + shift[:, None] * _vertex_normals(surface)
        kept = have_area(vertices, surface.triangles)
        return Mesh(vertices, surface.triangles[kept], vertex_importance=surface.vertex_importance)
    samples = scene.sample(0, 0, "area")
    shift = sigma * smooth_noise(samples.points, NOISE_SPACING, random)
    return PointCloud(
        samples.points + shift[:, None] * samples.normals,
        None if surface.normals is None else samples.normals,
        samples.weights / samples.areas,
    )


def smooth_noise(points: FloatArray, spacing: float, random: np.random.Generator) -> FloatArray:
    """Return (n,) standard normal numbers that change smoothly from place to place.

    Numbers on a cubic lattice are interpolated, and divided by the deviation that remains.

    Parameters
    ----------
    points : (n, 3) array
        Metres.
    spacing : float
        Of the lattice, metres.
    random : Generator
    """
    scaled = (points - points.min(axis=0)) / spacing
    low = np.floor(scaled)
    part = scaled - low
    ease = part * part * (3 - 2 * part)
    corners = np.array(list(product((0, 1), repeat=3)))
    nodes = low.astype(np.int64)[:, None] + corners
    sizes = tuple((nodes.max(axis=(0, 1)) + 1).tolist())
    keys = np.ravel_multi_index(tuple(np.moveaxis(nodes, 2, 0)), sizes)
    used, place = np.unique(keys, return_inverse=True)
    values = random.standard_normal(len(used))[place.reshape(keys.shape)]
    total, squares = np.zeros((2, len(points)))
    for number, corner in enumerate(corners):
        x, y, z = np.where(corner, ease, 1 - ease).T
        weight = x * y * z
        total += weight * values[:, number]
        squares += weight * weight
    return np.asarray(total / np.sqrt(squares))


def with_holes(scene: Scene, share: float, random: np.random.Generator) -> Surface:
    """Return the surface without a share of its area, in holes of :data:`HOLE` each.

    Each hole is what is nearest, of what is left, to a random place on the surface.

    Parameters
    ----------
    scene : Scene
    share : float
        Above 0, below 1.
    random : Generator
    """
    surface = scene.surface
    if isinstance(surface, Mesh):
        places = surface.vertices[surface.triangles].sum(axis=1) / 3
        areas = np.sqrt((surface.cross_products**2).sum(axis=1)) / 2
        return replace(
            surface,
            triangles=surface.triangles[_outside_holes(places, areas, share, random)],
            texture=None,
        )
    samples = scene.sample(0, 0, "area")
    kept = np.flatnonzero(_outside_holes(samples.points, samples.areas, share, random))
    left = samples.take(kept)
    return PointCloud(
        left.points,
        None if surface.normals is None else left.normals,
        left.weights / left.areas,
    )


def moved(surface: Surface, metres: float, random: np.random.Generator) -> Surface:
    """Return the surface, moved by a distance in a random horizontal direction."""
    x, y = metres * _horizontal(random)
    return _changed(surface, lambda points: points + np.array([x, y, 0.0]), lambda each: each)


def leaning(surface: Surface, metres: float, random: np.random.Generator) -> Surface:
    """Return the surface, leaning in a random direction around where it stands.

    Parameters
    ----------
    surface : Surface
    metres : float
        How far a point above the foot is moved that is as high as the surface's bounding box is
        long from corner to corner.
    random : Generator
    """
    points = surface.vertices if isinstance(surface, Mesh) else surface.points
    low, high = points.min(axis=0), points.max(axis=0)
    foot = np.array([*((low + high) / 2)[:2], low[2]])
    x, y = _horizontal(random)
    slope = metres / math.sqrt(((high - low) ** 2).sum())
    cosine = 1 / math.sqrt(1 + slope * slope)
    sine = slope * cosine

    def turn(vectors: FloatArray) -> FloatArray:
        along = x * vectors[:, 0] + y * vectors[:, 1]
        farther = (cosine - 1) * along + sine * vectors[:, 2]
        up = cosine * vectors[:, 2] - sine * along
        return np.stack([vectors[:, 0] + farther * x, vectors[:, 1] + farther * y, up], axis=1)

    return _changed(surface, lambda each: foot + turn(each - foot), turn)


def with_position_error(rig: Rig, sigma: float, random: np.random.Generator) -> Rig:
    """Return the rig with cameras displaced: independent normal errors in x, y and z.

    Parameters
    ----------
    rig : Rig
    sigma : float
        Of each coordinate, metres.
    random : Generator
    """
    shifts = (sigma * random.standard_normal((len(rig), 3))).tolist()
    cameras = []
    for camera, (dx, dy, dz) in zip(rig.cameras, shifts, strict=True):
        x, y, z = camera.position
        cameras.append(replace(camera, position=(x + dx, y + dy, z + dz)))
    return replace(rig, cameras=tuple(cameras))


def with_rotation_error(rig: Rig, sigma: float, random: np.random.Generator) -> Rig:
    """Return the rig with cameras turned: independent normal errors about their x, y and z axes.

    Parameters
    ----------
    rig : Rig
    sigma : float
        Of each angle, degrees, small.
    random : Generator
    """
    # Cayley's map needs no sine; below 5° its angle is right within 0.1 %.
    halves = (math.radians(sigma) / 2 * random.standard_normal((len(rig), 3))).tolist()
    cameras = []
    for camera, (a, b, c) in zip(rig.cameras, halves, strict=True):
        x, y, z, w = camera.orientation
        product_of_both = (
            x + w * a + y * c - z * b,
            y + w * b + z * a - x * c,
            z + w * c + x * b - y * a,
            w - x * a - y * b - z * c,
        )
        norm = math.sqrt(1 + a * a + b * b + c * c)
        qx, qy, qz, qw = (each / norm for each in product_of_both)
        cameras.append(replace(camera, orientation=(qx, qy, qz, qw)))
    return replace(rig, cameras=tuple(cameras))


def _vertex_normals(mesh: Mesh) -> FloatArray:
    """Return (V, 3) outward normals, the mean of the triangles around by area; 0 where none is.

    Vertices at the same place share theirs, lest noise open cracks between their triangles.
    """
    places, place = np.unique(mesh.vertices, axis=0, return_inverse=True)
    corners = place.reshape(-1)[mesh.triangles]
    sums = np.zeros_like(places)
    for corner, axis in product(range(3), range(3)):
        sums[:, axis] += np.bincount(corners[:, corner], mesh.cross_products[:, axis], len(places))
    lengths = np.sqrt((sums**2).sum(axis=1))
    normals = sums / np.where(lengths > 0, lengths, 1.0)[:, None]
    return np.asarray(normals[place.reshape(-1)])


def _outside_holes(
    places: FloatArray, areas: FloatArray, share: float, random: np.random.Generator
) -> NDArray[np.bool_]:
    """Return (n,) which parts of a surface are left."""
    left = np.ones(len(areas), dtype=np.bool_)
    cumulative = np.cumsum(areas)
    whole = float(cumulative[-1])
    missing = 0.0
    while missing < share * whole and left.sum() > 1:
        centre = places[np.searchsorted(cumulative, random.random() * whole, side="right")]
        parts = np.flatnonzero(left)
        near = parts[np.argsort(((places[parts] - centre) ** 2).sum(axis=1), kind="stable")]
        wanted = min(HOLE * whole, share * whole - missing)
        count = int(np.searchsorted(np.cumsum(areas[near]), wanted)) + 1
        gone = near[: min(count, len(near) - 1)]
        left[gone] = False
        missing += float(areas[gone].sum())
    return left


def _horizontal(random: np.random.Generator) -> FloatArray:
    """Return (2,) the x and y of a random horizontal direction."""
    drawn = random.standard_normal(2)
    return np.asarray(drawn / np.sqrt((drawn**2).sum()))


def _changed(
    surface: Surface,
    place: Callable[[FloatArray], FloatArray],
    turn: Callable[[FloatArray], FloatArray],
) -> Surface:
    """Return a surface somewhere else, given what becomes of points and of directions."""
    if isinstance(surface, Mesh):
        normals = surface.vertex_normals
        turned = None if normals is None else turn(normals)
        return replace(surface, vertices=place(surface.vertices), vertex_normals=turned)
    normals = surface.normals
    turned = None if normals is None else turn(normals)
    return replace(surface, points=place(surface.points), normals=turned)
