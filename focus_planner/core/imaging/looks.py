# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A surface's colours as pictures need them: its own, or a pattern that shows sharpness."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from focus_planner.core import kernels
from focus_planner.core.arrays import FloatArray, IntArray
from focus_planner.core.surface.appearance import Colours, Texture, decode, encode
from focus_planner.core.surface.scene import Scene
from focus_planner.core.surface.surface import Mesh

# Corners whose normal is farther off their triangle's, in degrees, are at an edge of the surface.
_CREASE = 50.0
# The pattern's coarsest level, in cells along the surface's diagonal.
_CELLS = 26
# Ground and chips, as sRGB.
_PALETTE = ((226, 218, 204), (74, 84, 96), (190, 120, 84))


@dataclass(frozen=True, eq=False)
class Shaded:
    """What a scene's triangles look like.

    Attributes
    ----------
    looks : Looks
    normals : (T, 3, 3) array
        Unit, of each corner, in the surface's frame.
    """

    looks: kernels.Looks
    normals: FloatArray


def shaded(scene: Scene, vertices: FloatArray, triangles: IntArray) -> Shaded:
    """Return what a scene's triangles look like.

    A texture comes before vertex colours, and those before the pattern.

    Parameters
    ----------
    scene : Scene
    vertices, triangles : arrays
        Its opaque surface.
    """
    return Shaded(_looks(scene, vertices, triangles), _corner_normals(scene, vertices, triangles))


def _looks(scene: Scene, vertices: FloatArray, triangles: IntArray) -> kernels.Looks:
    looks = kernels.Looks(
        kind=kernels.PATTERN,
        values=np.empty((0, 3, 3), np.float32),
        cell=scene.diagonal / _CELLS,
        palette=decode(np.array(_PALETTE, np.uint8)),
        texels=np.empty((0, 3), np.uint8),
        levels=np.empty((0, 3), np.int64),
        decode=decode(np.arange(256, dtype=np.uint8)),
    )
    colours = scene.colours
    if isinstance(scene.surface, Mesh) and scene.surface.texture is not None:
        texture = scene.surface.texture
        texels, levels = _pyramid(texture.image)
        values = np.empty((len(triangles), 3, 3), np.float32)
        values[..., :2] = texture.coordinates
        values[..., 2] = _density(texture, vertices, triangles)[:, None]
        return looks._replace(kind=kernels.TEXTURE, values=values, texels=texels, levels=levels)
    if colours is not None:
        return looks._replace(kind=kernels.VERTEX_COLOURS, values=decode(colours)[triangles])
    places = ((vertices - scene.centre) / looks.cell).astype(np.float32)
    return looks._replace(values=places[triangles])


def _density(texture: Texture, vertices: FloatArray, triangles: IntArray) -> NDArray[np.float32]:
    """Return (T,) how many texels a metre of each triangle has."""
    height, width = texture.image.shape[:2]
    sides = texture.coordinates[:, 1:].astype(np.float64) - texture.coordinates[:, :1]
    texels = np.abs(np.linalg.det(sides)) * width * height
    a, b, c = (vertices[triangles[:, i]] for i in range(3))
    areas = np.sqrt((np.cross(b - a, c - a) ** 2).sum(axis=1))
    density: NDArray[np.float32] = np.sqrt(texels / areas).astype(np.float32)
    return density


def _pyramid(image: Colours) -> tuple[Colours, NDArray[np.int64]]:
    """Return an image's texels and those of ever smaller averages, and where each level starts."""
    texels, levels, start = [image.reshape(-1, 3)], [(0, image.shape[1], image.shape[0])], 0
    linear: NDArray[Any] = decode(image)
    while max(linear.shape[:2]) > 1:
        for axis in range(2):
            length = linear.shape[axis]
            if length > 1:
                # The last of an odd number joins the one before.
                starts = np.arange(0, length - length % 2, 2)
                counts = np.diff(np.append(starts, length)).astype(np.float32)
                shape = [1, 1, 1]
                shape[axis] = len(counts)
                linear = np.add.reduceat(linear, starts, axis) / counts.reshape(shape)
        start += len(texels[-1])
        texels.append(encode(linear).reshape(-1, 3))
        levels.append((start, linear.shape[1], linear.shape[0]))
    return np.concatenate(texels), np.array(levels, np.int64)


def _corner_normals(scene: Scene, vertices: FloatArray, triangles: IntArray) -> FloatArray:
    """Return (T, 3, 3) the unit normals of corners: smooth, but for edges of the surface."""
    a, b, c = (vertices[triangles[:, i]] for i in range(3))
    crosses = np.cross(b - a, c - a)
    flat = crosses / np.sqrt((crosses**2).sum(axis=1))[:, None]
    normals = scene.surface.vertex_normals if isinstance(scene.surface, Mesh) else None
    if normals is None:
        summed = np.zeros_like(vertices)
        for i in range(3):
            np.add.at(summed, triangles[:, i], crosses)
        lengths = np.sqrt((summed**2).sum(axis=1))
        normals = summed / np.where(lengths > 0, lengths, 1.0)[:, None]
    smooth = normals[triangles]
    along = np.einsum("tci,ti->tc", smooth, flat)
    smooth_enough = along >= np.cos(np.radians(_CREASE))
    corners: FloatArray = np.where(smooth_enough[..., None], smooth, flat[:, None])
    return corners
