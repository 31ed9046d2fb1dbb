# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What colour a surface has where a ray hits it, and the mean over the rays of every pixel.

All colours are in linear light, in which they may be averaged. What a tile's rays hit is listed in
rows of one array, 32-bit throughout, and loops over it have neither branches nor divisions: so
compilers work on eight at a time.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from focus_planner.core.kernels.compiling import kernel, parallel_kernel
from focus_planner.core.kernels.rasterize import TILE, scan, stride

#: What a surface's colours come from.
PATTERN, VERTEX_COLOURS, TEXTURE = 0, 1, 2
_F, _U = np.float32, np.uint32
# The pattern: each level's cells are a fourth as wide as those of the level before, and there are
# so many beyond the coarsest. The finest that is drawn has cells of this many pixels at least.
_LEVELS, _PIXELS = 6, _F(3.0)
_FOUR, _FOURTH, _THIRD, _HALF, _ONE, _NONE = _F(4), _F(0.25), _F(1 / 3), _F(0.5), _F(1), _F(0)
# There are chips where noise is above the threshold. It rises by some such slope in a cell.
_THRESHOLD, _SLOPE = _F(0.43), _F(1.75)
# So that cells of different levels do not begin at the same places.
_BESIDE = _F(0.37)
# Noise: large odd numbers to hash cells with.
_HASH_X, _HASH_Y, _HASH_Z = _U(0x8DA6B343), _U(0xD8163841), _U(0xCB1AB31F)
_HASH, _HASH_BITS = _U(0x9E3779B1), _U(29)
# Where rays are farther apart than pixels, colours are averaged over this share of the distance.
_SMOOTH = 0.5
# Textures are taken this many levels sharper than one texel per pixel: every pixel has many rays.
_SHARPER = 0.7
# Rows of what rays hit: three values of the surface, how many of what is averaged over there make
# a metre, how brightly it is lit, its colour, and the pattern's.
_RESOLUTION, _LIT, _COLOUR, _SCALE, _FADING, _ROWS = 3, 4, 5, 8, 9, 10


class Looks(NamedTuple):
    """A surface's colours, of one kind; arrays of the others are empty.

    Attributes
    ----------
    kind : int
        PATTERN, VERTEX_COLOURS or TEXTURE.
    values : (T, 3, 3) array of float32
        Of each corner: its place in cells of the pattern's coarsest level; or its colour; or u and
        v, and the texels per metre of its triangle.
    cell : float
        PATTERN: the size of such a cell, metres.
    palette : (3, 3) array of float32
        PATTERN: the ground, and two kinds of chips in it.
    texels : (n, 3) array of uint8
        TEXTURE: the image, and ever smaller averages of it, as sRGB.
    levels : (L, 3) array of int64
        TEXTURE: where each of those starts, its width and its height.
    decode : (256,) array of float32
        From sRGB to linear light.
    """

    kind: int
    values: NDArray[np.float32]
    cell: float
    palette: NDArray[np.float32]
    texels: NDArray[np.uint8]
    levels: NDArray[np.int64]
    decode: NDArray[np.float32]


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
            p = corners[t, i]
            x, y, z = vertices[p, 0], vertices[p, 1], vertices[p, 2]
            a, b, c = normals[t, i, 0], normals[t, i, 1], normals[t, i, 2]
            distance = np.sqrt(x * x + y * y + z * z)
            facing = -(a * x + b * y + c * z) / distance if distance > 0 else 0.0
            rising = a * up[0] + b * up[1] + c * up[2]
            for side in range(2):
                sign = 1.0 - 2.0 * side
                sky = 0.5 + 0.5 * sign * rising
                light[t, i, side] = 0.22 + 0.33 * sky + 0.45 * max(sign * facing, 0.0)


@parallel_kernel
def expose(
    triangles,
    tiles,
    looks,
    light,
    aims,
    starts,
    chosen,
    aperture,
    inverse_focus,
    pixel,
    background,
    image,
):
    """Fill in (H, W, 3) the mean colour over rays through the aperture.

    Parameters
    ----------
    triangles : Triangles
    tiles : Tiles
    looks : Looks
    light : (T, 3, 2) array of float32
        Of each corner, outside and inside.
    aims : (S, 4) array
        Of each of a pixel's rays, x and y in an aperture of diameter 1, and how far beside the
        pixel's centre it is imaged, columns and rows.
    starts : (K + 1,) array of int
        ``aims[starts[k] : starts[k + 1]]`` is one of K sets of rays.
    chosen : (Y, X) array of int
        Which set each tile takes.
    aperture : float
        Its diameter, metres.
    inverse_focus : float
        Of the distance of the plane of focus, 1/m.
    pixel : float
        The size of a pixel at depth 1.
    background : (3,) array
    """
    height, width = image.shape[:2]
    columns = tiles.bounds.shape[1]
    count = tiles.bounds.shape[0] * columns
    step = stride(count)
    for number in prange(count):
        tile = number * step % count
        ty, tx = tile // columns, tile % columns
        top, left = ty * TILE, tx * TILE
        bottom, right = min(top + TILE, height), min(left + TILE, width)
        if triangles.starts[tile + 1] == triangles.starts[tile]:
            image[top:bottom, left:right] = background
            continue
        inverse, shown = np.empty((TILE, TILE)), np.empty((TILE, TILE), np.int32)
        where, total = np.empty((TILE, TILE, 2)), np.zeros((TILE * TILE, 4))
        hits, pixels = np.empty((_ROWS, TILE * TILE), np.float32), np.empty(TILE * TILE, np.int32)
        shift, origin = np.empty(2), np.empty(2)
        bounds, steps = tiles.bounds[ty, tx], tiles.affine[ty, tx, 7:]
        first, last = starts[chosen[ty, tx]], starts[chosen[ty, tx] + 1]
        # Half of how far apart, on the sensor, the rays are that meet off the plane of focus.
        smooth = _SMOOTH * aperture / np.sqrt(last - first)
        sizes = pixel, smooth, inverse_focus
        for s in range(first, last):
            for axis in range(2):
                origin[axis] = aperture * aims[s, axis]
                beside = aims[s, 2] * steps[axis] + aims[s, 3] * steps[2 + axis]
                shift[axis] = beside - origin[axis] * inverse_focus
            scan(triangles, tiles, tile, bounds, origin, shift, inverse, shown, where)
            seen = _list(looks.values, light, sizes, inverse, shown, where, hits, pixels)
            if looks.kind == TEXTURE:
                _colour_by_texture(looks.texels, looks.levels, looks.decode, hits, seen)
            elif looks.kind == VERTEX_COLOURS:
                hits[_COLOUR : _COLOUR + 3, :seen] = hits[:3, :seen]
            else:
                _colour_by_pattern(looks.palette, looks.cell, hits, seen)
            _add(hits, pixels, seen, total)
        rays = last - first
        for v in range(bottom - top):
            for u in range(right - left):
                at = v * TILE + u
                missed = rays - total[at, 3]
                for i in range(3):
                    image[top + v, left + u, i] = (total[at, i] + missed * background[i]) / rays


@kernel
def _list(values, light, sizes, inverse, shown, where, hits, pixels):
    """List what the rays of a tile hit, and the pixels' numbers in it; return how much it is."""
    pixel, smooth, inverse_focus = sizes
    count = 0
    for v in range(TILE):
        for u in range(TILE):
            if shown[v, u] < 0:
                continue
            t, side = shown[v, u] >> 1, shown[v, u] & 1
            near = inverse[v, u]
            wb, wc = where[v, u, 0] / near, where[v, u, 1] / near
            wa = 1 - wb - wc
            for i in range(3):
                hits[i, count] = wa * values[t, 0, i] + wb * values[t, 1, i] + wc * values[t, 2, i]
            hits[_RESOLUTION, count] = near / max(pixel, smooth * abs(inverse_focus - near))
            hits[_LIT, count] = (
                wa * light[t, 0, side] + wb * light[t, 1, side] + wc * light[t, 2, side]
            )
            pixels[count] = v * TILE + u
            count += 1
    return count


@kernel
def _add(hits, pixels, count, total):
    """Add the lit colours of what is hit to their pixels' sums."""
    for n in range(count):
        at, lit = pixels[n], hits[_LIT, n]
        for i in range(3):
            total[at, i] += lit * hits[_COLOUR + i, n]
        total[at, 3] += 1


@kernel
def _colour_by_pattern(palette, cell, hits, count):
    """Colour what is hit with chips of three sizes, the finest that are resolved.

    Levels fade in and out as the camera comes nearer.
    """
    # In the end, of each hit's finest level: pixels per cell, and cells per coarsest cell.
    pixels, scale, fading = hits[_RESOLUTION], hits[_SCALE], hits[_FADING]
    coarsest = _F(cell)
    for n in range(count):
        pixels[n] = coarsest * pixels[n]
        scale[n] = _ONE
    for _ in range(_LEVELS):
        for n in range(count):
            finer = pixels[n] >= _FOUR * _PIXELS
            scale[n] = _FOUR * scale[n] if finer else scale[n]
            pixels[n] = _FOURTH * pixels[n] if finer else pixels[n]
    for n in range(count):
        faded = min(max((pixels[n] * (_ONE / _PIXELS) - _ONE) * _THIRD, _NONE), _ONE)
        fading[n] = faded if scale[n] > _ONE else _ONE
    for i in range(3):
        hits[_COLOUR + i, :count] = palette[0, i]
    _add_chips(palette, hits, count, _F(1 / 16), _ONE, -_ONE)
    _add_chips(palette, hits, count, _FOURTH, _ONE, _NONE)
    _add_chips(palette, hits, count, _ONE, _NONE, _ONE)


@kernel
def _add_chips(palette, hits, count, coarser, steady, faded):
    """Add chips of cells that are so much coarser than the finest.

    Their strength is steady + faded × fading.
    """
    x, y, z, pixels, fading = hits[0], hits[1], hits[2], hits[_RESOLUTION], hits[_FADING]
    red, green, blue, scales = hits[_COLOUR], hits[_COLOUR + 1], hits[_COLOUR + 2], hits[_SCALE]
    r1, g1, b1 = palette[1]
    r2, g2, b2 = palette[2]
    sharpness = _ONE / (_SLOPE * coarser)
    for n in range(count):
        scale = scales[n] * coarser
        strength = steady + faded * fading[n] if scale >= _ONE else _NONE
        value = _noise(x[n] * scale + _BESIDE, y[n] * scale + _BESIDE, z[n] * scale + _BESIDE)
        inside = (abs(value) - _THRESHOLD) * (sharpness * pixels[n]) + _HALF
        share = strength * min(max(inside, _NONE), _ONE)
        r, g, b = red[n], green[n], blue[n]
        red[n] = r + share * ((r1 if value > _NONE else r2) - r)
        green[n] = g + share * ((g1 if value > _NONE else g2) - g)
        blue[n] = b + share * ((b1 if value > _NONE else b2) - b)


@njit(inline="always")
def _noise(x, y, z):
    """Return noise with features of about a cell, of standard deviation 0.32.

    It is 0 at the corners of cells, with a gradient there that is one of a cube's diagonals (K.
    Perlin, An Image Synthesizer, SIGGRAPH 1985).
    """
    floor_x, floor_y, floor_z = np.floor(x), np.floor(y), np.floor(z)
    left, top, front = x - floor_x, y - floor_y, z - floor_z
    right, bottom, back = left - _ONE, top - _ONE, front - _ONE
    i, j, k = (
        _U(_U(np.int32(floor_x)) * _HASH_X),
        _U(_U(np.int32(floor_y)) * _HASH_Y),
        _U(_U(np.int32(floor_z)) * _HASH_Z),
    )
    i1, j1, k1 = _U(i + _HASH_X), _U(j + _HASH_Y), _U(k + _HASH_Z)
    a, a1 = _rise(i ^ j ^ k, left, top, front), _rise(i ^ j ^ k1, left, top, back)
    b, b1 = _rise(i ^ j1 ^ k, left, bottom, front), _rise(i ^ j1 ^ k1, left, bottom, back)
    c, c1 = _rise(i1 ^ j ^ k, right, top, front), _rise(i1 ^ j ^ k1, right, top, back)
    d, d1 = _rise(i1 ^ j1 ^ k, right, bottom, front), _rise(i1 ^ j1 ^ k1, right, bottom, back)
    along = _ease(front)
    a, b, c, d = (
        a + along * (a1 - a),
        b + along * (b1 - b),
        c + along * (c1 - c),
        d + along * (d1 - d),
    )
    down = _ease(top)
    a, c = a + down * (b - a), c + down * (d - c)
    return a + _ease(left) * (c - a)


@njit(inline="always")
def _rise(cell, x, y, z):
    """Return how much the gradient of a cell's corner rises to a place beside it."""
    bits = _U(cell * _HASH) >> _HASH_BITS
    return (x if bits & _U(1) else -x) + (y if bits & _U(2) else -y) + (z if bits & _U(4) else -z)


@njit(inline="always")
def _ease(x):
    return x * x * (_F(3) - x - x)


@kernel
def _colour_by_texture(texels, levels, decode, hits, count):
    """Colour what is hit as a texture is, averaged over about a pixel."""
    for n in range(count):
        u, v, density = hits[0, n], hits[1, n], hits[2, n]
        level = np.log2(max(density / hits[_RESOLUTION, n], 1e-9)) - _SHARPER
        level = min(max(level, 0.0), len(levels) - 1.0)
        sharp = int(level)
        r, g, b = _texel(texels, levels, decode, sharp, u, v)
        share = level - sharp
        if share > 0:
            smooth = _texel(texels, levels, decode, sharp + 1, u, v)
            r += share * (smooth[0] - r)
            g += share * (smooth[1] - g)
            b += share * (smooth[2] - b)
        hits[_COLOUR, n], hits[_COLOUR + 1, n], hits[_COLOUR + 2, n] = r, g, b


@kernel
def _texel(texels, levels, decode, level, u, v):
    """Interpolate one level of a texture that repeats."""
    start, width, height = levels[level, 0], levels[level, 1], levels[level, 2]
    x, y = u * width - 0.5, (1 - v) * height - 0.5
    i, j = int(np.floor(x)), int(np.floor(y))
    x, y = x - i, y - j
    left, right = i % width, (i + 1) % width
    above, below = j % height, (j + 1) % height
    r, g, b = 0.0, 0.0, 0.0
    for row, across in ((above, 1 - y), (below, y)):
        for column, along in ((left, 1 - x), (right, x)):
            texel, weight = start + row * width + column, across * along
            r += weight * decode[texels[texel, 0]]
            g += weight * decode[texels[texel, 1]]
            b += weight * decode[texels[texel, 2]]
    return r, g, b
