"""What colour a surface has where a ray hits it, and the mean over the rays of every pixel.

All colours are in linear light, in which they may be averaged.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import prange

from focus_planner.core.arrays import FloatArray, IntArray
from focus_planner.core.kernels.compiling import kernel, parallel_kernel
from focus_planner.core.kernels.rasterize import TILE, scan

#: What a surface's colours come from.
PATTERN, VERTEX_COLOURS, TEXTURE = 0, 1, 2
# The pattern: each level's cells are this many times as small as those of the level before. The
# finest that is drawn has cells of this many pixels.
_FINER, _PIXELS = 4.0, 0.6
_THRESHOLD, _SLOPE = 0.45, 0.35
# Textures are taken this many levels sharper than one texel per pixel: every pixel has many rays.
_SHARPER = 0.7


class Looks(NamedTuple):
    """A surface's colours, of one kind; arrays of the others are empty.

    Attributes
    ----------
    kind : int
        PATTERN, VERTEX_COLOURS or TEXTURE.
    places : (V, 3) array of float32
        PATTERN: the vertices, in cells of the coarsest level.
    cell : float
        PATTERN: the size of such a cell, metres.
    noise : (N, N, N) array of float32
        PATTERN: periodic, N a power of 2.
    palette : (3, 3) array of float32
        PATTERN: the ground, and two kinds of chips in it.
    colours : (V, 3) array of float32
        VERTEX_COLOURS.
    coordinates : (T, 3, 2) array of float32
        TEXTURE: u and v of the corners.
    texels : (n, 3) array of uint8
        TEXTURE: the image, and ever smaller averages of it, as sRGB.
    levels : (L, 3) array of int64
        TEXTURE: where each of those starts, its width and its height.
    density : (T,) array of float32
        TEXTURE: texels per metre.
    decode : (256,) array of float32
        From sRGB to linear light.
    """

    kind: int
    places: FloatArray
    cell: float
    noise: FloatArray
    palette: FloatArray
    colours: FloatArray
    coordinates: FloatArray
    texels: IntArray
    levels: IntArray
    density: FloatArray
    decode: FloatArray


@parallel_kernel
def light_corners(vertices, corners, normals, up, light):
    """Fill in (T, 3, 2) how brightly each triangle's corners are lit, outside and inside.

    Parameters
    ----------
    vertices : (V, 3) array
        In the camera's optical frame.
    corners : (T, 3) array of int32
    normals : (T, 3, 3) array
        Unit, in the same frame; of each corner.
    up : (3,) array
        Unit: where the sky is.
    """
    for t in prange(len(corners)):
        for i in range(3):
            x, y, z = vertices[corners[t, i]]
            a, b, c = normals[t, i]
            distance = np.sqrt(x * x + y * y + z * z)
            facing = -(a * x + b * y + c * z) / distance if distance > 0 else 0.0
            rising = a * up[0] + b * up[1] + c * up[2]
            for side in range(2):
                sign = 1.0 - 2.0 * side
                sky = 0.5 + 0.5 * sign * rising
                light[t, i, side] = 0.22 + 0.33 * sky + 0.45 * max(sign * facing, 0.0)


@kernel
def _noise(volume, x, y, z):
    """Interpolate periodic noise."""
    mask = volume.shape[0] - 1
    i, j, k = int(np.floor(x)), int(np.floor(y)), int(np.floor(z))
    x, y, z = x - i, y - j, z - k
    i0, j0, k0 = i & mask, j & mask, k & mask
    i1, j1, k1 = (i + 1) & mask, (j + 1) & mask, (k + 1) & mask
    low = (volume[i0, j0, k0] * (1 - z) + volume[i0, j0, k1] * z) * (1 - y) + (
        volume[i0, j1, k0] * (1 - z) + volume[i0, j1, k1] * z
    ) * y
    high = (volume[i1, j0, k0] * (1 - z) + volume[i1, j0, k1] * z) * (1 - y) + (
        volume[i1, j1, k0] * (1 - z) + volume[i1, j1, k1] * z
    ) * y
    return low * (1 - x) + high * x


@kernel
def _pattern(looks, x, y, z, pixel):
    """Return the colour of chips at three scales, the finest that ``pixel``, in cells, resolves."""
    finest = np.log(max(1 / (_PIXELS * pixel), 1.0)) / np.log(_FINER)
    last = int(finest)
    r, g, b = looks.palette[0]
    for level in range(max(last - 2, 0), last + 1):
        # Levels fade in and out as the camera comes nearer.
        strength = finest - last if level == last and last > 0 else 1.0
        if level == last - 2:
            strength = 1.0 - (finest - last)
        if strength <= 0:
            continue
        scale = _FINER**level
        # Shifted so that the levels' cells do not line up.
        value = _noise(
            looks.noise, x * scale + 17.3 * level, y * scale + 7.7 * level, z * scale - 11.9 * level
        )
        edge = max(_SLOPE * scale * pixel, 1e-6)
        share = min(max((abs(value) - _THRESHOLD) / edge + 0.5, 0.0), 1.0) * strength
        chip = looks.palette[1 if value > 0 else 2]
        r += share * (chip[0] - r)
        g += share * (chip[1] - g)
        b += share * (chip[2] - b)
    return r, g, b


@kernel
def _texel(looks, level, u, v):
    """Interpolate one level of a texture that repeats."""
    start, width, height = looks.levels[level]
    x, y = u * width - 0.5, (1 - v) * height - 0.5
    i, j = int(np.floor(x)), int(np.floor(y))
    x, y = x - i, y - j
    left, right = i % width, (i + 1) % width
    above, below = j % height, (j + 1) % height
    r, g, b = 0.0, 0.0, 0.0
    for row, across in ((above, 1 - y), (below, y)):
        for column, along in ((left, 1 - x), (right, x)):
            texel = looks.texels[start + row * width + column]
            weight = across * along
            r += weight * looks.decode[texel[0]]
            g += weight * looks.decode[texel[1]]
            b += weight * looks.decode[texel[2]]
    return r, g, b


@kernel
def _texture(looks, t, weights, pixel):
    """Return the texture's colour, averaged over about a pixel."""
    u, v = 0.0, 0.0
    for i in range(3):
        u += weights[i] * looks.coordinates[t, i, 0]
        v += weights[i] * looks.coordinates[t, i, 1]
    level = np.log2(max(looks.density[t] * pixel, 1e-9)) - _SHARPER
    level = min(max(level, 0.0), len(looks.levels) - 1.0)
    sharp = int(level)
    r, g, b = _texel(looks, sharp, u, v)
    share = level - sharp
    if share > 0:
        smooth = _texel(looks, sharp + 1, u, v)
        r += share * (smooth[0] - r)
        g += share * (smooth[1] - g)
        b += share * (smooth[2] - b)
    return r, g, b


@kernel
def _colour(looks, corner, t, weights, pixel):
    if looks.kind == TEXTURE:
        return _texture(looks, t, weights, pixel)
    attribute = looks.colours if looks.kind == VERTEX_COLOURS else looks.places
    a, b, c = attribute[corner[0]], attribute[corner[1]], attribute[corner[2]]
    x = weights[0] * a[0] + weights[1] * b[0] + weights[2] * c[0]
    y = weights[0] * a[1] + weights[1] * b[1] + weights[2] * c[1]
    z = weights[0] * a[2] + weights[1] * b[2] + weights[2] * c[2]
    if looks.kind == VERTEX_COLOURS:
        return x, y, z
    return _pattern(looks, x, y, z, pixel / looks.cell)


@parallel_kernel
def expose(triangles, tiles, looks, light, aims, inverse_focus, pixel, background, image):
    """Fill in (H, W, 3) the mean colour over rays through the aperture.

    Parameters
    ----------
    triangles : Triangles
    tiles : Tiles
    looks : Looks
    light : (T, 3, 2) array of float32
        Of each corner, outside and inside.
    aims : (S, 4) array
        Of each of a pixel's rays, x and y in the plane of the aperture, metres, and how far beside
        the pixel's centre it is imaged, columns and rows.
    inverse_focus : float
        Of the distance of the plane of focus, 1/m.
    pixel : float
        The size of a pixel at depth 1.
    background : (3,) array
    """
    height, width = image.shape[:2]
    columns = tiles.bounds.shape[1]
    for tile in prange(tiles.bounds.shape[0] * columns):
        inverse, shown = np.empty((TILE, TILE)), np.empty((TILE, TILE), np.int32)
        where, total = np.empty((TILE, TILE, 2)), np.zeros((TILE, TILE, 3))
        shift, weights = np.empty(2), np.empty(3)
        steps = tiles.affine[tile // columns, tile % columns, 7:]
        top, left = tile // columns * TILE, tile % columns * TILE
        rows, across = min(TILE, height - top), min(TILE, width - left)
        rays = len(aims) if triangles.starts[tile + 1] > triangles.starts[tile] else 0
        for s in range(rays):
            aim = aims[s]
            for axis in range(2):
                beside = aim[2] * steps[axis] + aim[3] * steps[2 + axis]
                shift[axis] = beside - aim[axis] * inverse_focus
            scan(triangles, tiles, tile, aim[:2], shift, inverse, shown, where)
            for v in range(rows):
                for u in range(across):
                    t = shown[v, u]
                    if t < 0:
                        for i in range(3):
                            total[v, u, i] += background[i]
                        continue
                    depth = 1 / inverse[v, u]
                    weights[1], weights[2] = where[v, u, 0] * depth, where[v, u, 1] * depth
                    weights[0] = 1 - weights[1] - weights[2]
                    corner = triangles.corners[t]
                    colour = _colour(looks, corner, t, weights, pixel * depth)
                    # A triangle's outside is seen where its corners run clockwise in the image.
                    side = 1 - _outside(triangles.vertices, corner, aim)
                    lit = 0.0
                    for i in range(3):
                        lit += weights[i] * light[t, i, side]
                    total[v, u, 0] += lit * colour[0]
                    total[v, u, 1] += lit * colour[1]
                    total[v, u, 2] += lit * colour[2]
        for v in range(rows):
            for u in range(across):
                for i in range(3):
                    mean = total[v, u, i] / rays if rays else background[i]
                    image[top + v, left + u, i] = mean


@kernel
def _outside(vertices, corner, aim):
    """Return 1 if a ray from the aperture sees the outer side of a triangle, else 0."""
    a, b, c = vertices[corner[0]], vertices[corner[1]], vertices[corner[2]]
    ax, ay = a[0] - aim[0], a[1] - aim[1]
    bx, by = b[0] - aim[0], b[1] - aim[1]
    cx, cy = c[0] - aim[0], c[1] - aim[1]
    det = (
        ax * (by * c[2] - b[2] * cy)
        + ay * (b[2] * cx - bx * c[2])
        + a[2] * (bx * cy - by * cx)
    )
    return 1 if det < 0 else 0
