"""What colour a surface has where a ray hits it, and the mean over the rays of every pixel.

All colours are in linear light, in which they may be averaged.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import prange
from numpy.typing import NDArray

from focus_planner.core.kernels.compiling import kernel, parallel_kernel
from focus_planner.core.kernels.rasterize import TILE, scan

#: What a surface's colours come from.
PATTERN, VERTEX_COLOURS, TEXTURE = 0, 1, 2
#: The pattern's noise along each axis, a power of 2, and units of its bytes: it has to fit into a
#: core's cache.
NOISE_SIZE, NOISE_UNITS = 64, 64
_MASK = NOISE_SIZE - 1
# The pattern: each level's cells are this many times as small as those of the level before. The
# finest that is drawn has cells of this many pixels.
_FINER, _PIXELS = 4.0, 0.6
_LOG_FINER = np.log(_FINER)
_THRESHOLD, _SLOPE = 0.45, 0.35
# Where rays are farther apart than pixels, colours are averaged over this share of the distance.
_SMOOTH = 0.5
# Textures are taken this many levels sharper than one texel per pixel: every pixel has many rays.
_SHARPER = 0.7
# Numbers of what a ray hits.
_HIT = 6


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
    noise : (NOISE_SIZE³,) array of int8
        PATTERN: periodic; in units of 1 / NOISE_UNITS.
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
    places: NDArray[np.float32]
    cell: float
    noise: NDArray[np.int8]
    palette: NDArray[np.float32]
    colours: NDArray[np.float32]
    coordinates: NDArray[np.float32]
    texels: NDArray[np.uint8]
    levels: NDArray[np.int64]
    density: NDArray[np.float32]
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
    for tile in prange(tiles.bounds.shape[0] * columns):
        ty, tx = tile // columns, tile % columns
        top, left = ty * TILE, tx * TILE
        bottom, right = min(top + TILE, height), min(left + TILE, width)
        if triangles.starts[tile + 1] == triangles.starts[tile]:
            image[top:bottom, left:right] = background
            continue
        inverse, shown = np.empty((TILE, TILE)), np.empty((TILE, TILE), np.int32)
        where, total = np.empty((TILE, TILE, 2)), np.zeros((TILE * TILE, 4))
        hits, shift, origin = np.empty((TILE * TILE, _HIT)), np.empty(2), np.empty(2)
        bounds, steps = tiles.bounds[ty, tx], tiles.affine[ty, tx, 7:]
        first, last = starts[chosen[ty, tx]], starts[chosen[ty, tx] + 1]
        # Half of how far apart, on the sensor, the rays are that meet off the plane of focus.
        smooth = _SMOOTH * aperture / np.sqrt(last - first)
        for s in range(first, last):
            for axis in range(2):
                origin[axis] = aperture * aims[s, axis]
                beside = aims[s, 2] * steps[axis] + aims[s, 3] * steps[2 + axis]
                shift[axis] = beside - origin[axis] * inverse_focus
            scan(triangles, tiles, tile, bounds, origin, shift, inverse, shown, where)
            sizes = pixel, smooth, inverse_focus
            # Every kind has its own loop over pixels: what it needs is passed once, not to each.
            if looks.kind == TEXTURE:
                count = _list_in_texture(looks, light, sizes, inverse, shown, where, hits)
                _add_texture(looks.texels, looks.levels, looks.decode, hits, count, total)
                continue
            of = looks.colours if looks.kind == VERTEX_COLOURS else looks.places
            count = _list(triangles.corners, of, light, sizes, inverse, shown, where, hits)
            if looks.kind == VERTEX_COLOURS:
                _add_colours(hits, count, total)
            else:
                _add_pattern(looks.noise, looks.palette, looks.cell, hits, count, total)
        rays = last - first
        for v in range(bottom - top):
            for u in range(right - left):
                at = v * TILE + u
                missed = rays - total[at, 3]
                for i in range(3):
                    image[top + v, left + u, i] = (total[at, i] + missed * background[i]) / rays


@kernel
def _list(corners, of, light, sizes, inverse, shown, where, hits):
    """List what the rays of a tile hit, with three values of the vertices; return how much it is.

    Each hit is those values, the size of what is to be averaged over there, metres, how brightly it
    is lit, and the number of the pixel in the tile.
    """
    pixel, smooth, inverse_focus = sizes
    count = 0
    for v in range(TILE):
        for u in range(TILE):
            if shown[v, u] < 0:
                continue
            t, side = shown[v, u] >> 1, shown[v, u] & 1
            depth = 1 / inverse[v, u]
            wb, wc = where[v, u, 0] * depth, where[v, u, 1] * depth
            wa = 1 - wb - wc
            a, b, c = corners[t, 0], corners[t, 1], corners[t, 2]
            hits[count, 0] = wa * of[a, 0] + wb * of[b, 0] + wc * of[c, 0]
            hits[count, 1] = wa * of[a, 1] + wb * of[b, 1] + wc * of[c, 1]
            hits[count, 2] = wa * of[a, 2] + wb * of[b, 2] + wc * of[c, 2]
            hits[count, 3] = depth * max(pixel, smooth * abs(inverse_focus - inverse[v, u]))
            hits[count, 4] = (
                wa * light[t, 0, side] + wb * light[t, 1, side] + wc * light[t, 2, side]
            )
            hits[count, 5] = v * TILE + u
            count += 1
    return count


@kernel
def _list_in_texture(looks, light, sizes, inverse, shown, where, hits):
    """List what the rays of a tile hit, as :func:`_list`, with u, v and the texels per metre."""
    uv, density = looks.coordinates, looks.density
    pixel, smooth, inverse_focus = sizes
    count = 0
    for v in range(TILE):
        for u in range(TILE):
            if shown[v, u] < 0:
                continue
            t, side = shown[v, u] >> 1, shown[v, u] & 1
            depth = 1 / inverse[v, u]
            wb, wc = where[v, u, 0] * depth, where[v, u, 1] * depth
            wa = 1 - wb - wc
            hits[count, 0] = wa * uv[t, 0, 0] + wb * uv[t, 1, 0] + wc * uv[t, 2, 0]
            hits[count, 1] = wa * uv[t, 0, 1] + wb * uv[t, 1, 1] + wc * uv[t, 2, 1]
            hits[count, 2] = density[t]
            hits[count, 3] = depth * max(pixel, smooth * abs(inverse_focus - inverse[v, u]))
            hits[count, 4] = (
                wa * light[t, 0, side] + wb * light[t, 1, side] + wc * light[t, 2, side]
            )
            hits[count, 5] = v * TILE + u
            count += 1
    return count


@kernel
def _add_colours(hits, count, total):
    """Add the colours that are the hits' values."""
    for n in range(count):
        at, lit = int(hits[n, 5]), hits[n, 4]
        for i in range(3):
            total[at, i] += lit * hits[n, i]
        total[at, 3] += 1


@kernel
def _add_pattern(noise, palette, cell, hits, count, total):
    """Add the colours of chips at three scales, the finest that are resolved.

    Levels fade in and out as the camera comes nearer.
    """
    for n in range(count):
        pixel = hits[n, 3] / cell
        finest = max(-np.log(_PIXELS * pixel) / _LOG_FINER, 0.0)
        last = int(finest)
        fading = finest - last
        first = max(last - 2, 0)
        scale = 1.0
        for _ in range(first):
            scale *= _FINER
        r, g, b = palette[0, 0], palette[0, 1], palette[0, 2]
        for level in range(first, last + 1):
            # Shifted so that the levels' cells do not line up.
            x = hits[n, 0] * scale + 17.3 * level
            y = hits[n, 1] * scale + 7.7 * level
            z = hits[n, 2] * scale - 11.9 * level
            value = _noise(noise, x, y, z)
            strength = 1.0
            if level == last - 2:
                strength = 1.0 - fading
            elif level == last and last > 0:
                strength = fading
            edge = max(_SLOPE * scale * pixel, 1e-6)
            share = min(max((abs(value) - _THRESHOLD) / edge + 0.5, 0.0), 1.0) * strength
            if share > 0:
                chip = 1 if value > 0 else 2
                r += share * (palette[chip, 0] - r)
                g += share * (palette[chip, 1] - g)
                b += share * (palette[chip, 2] - b)
            scale *= _FINER
        at, lit = int(hits[n, 5]), hits[n, 4]
        total[at, 0] += lit * r
        total[at, 1] += lit * g
        total[at, 2] += lit * b
        total[at, 3] += 1


@kernel
def _noise(volume, x, y, z):
    """Interpolate periodic noise."""
    i, j, k = int(np.floor(x)), int(np.floor(y)), int(np.floor(z))
    x, y, z = x - i, y - j, z - k
    i0, i1 = (i & _MASK) * NOISE_SIZE, ((i + 1) & _MASK) * NOISE_SIZE
    j0, j1 = j & _MASK, (j + 1) & _MASK
    k0, k1 = k & _MASK, (k + 1) & _MASK
    a, b = (i0 + j0) * NOISE_SIZE, (i0 + j1) * NOISE_SIZE
    c, d = (i1 + j0) * NOISE_SIZE, (i1 + j1) * NOISE_SIZE
    a0, b0 = float(volume[a + k0]), float(volume[b + k0])
    c0, d0 = float(volume[c + k0]), float(volume[d + k0])
    a0 += z * (volume[a + k1] - a0)
    b0 += z * (volume[b + k1] - b0)
    c0 += z * (volume[c + k1] - c0)
    d0 += z * (volume[d + k1] - d0)
    a0 += y * (b0 - a0)
    c0 += y * (d0 - c0)
    return (a0 + x * (c0 - a0)) / NOISE_UNITS


@kernel
def _add_texture(texels, levels, decode, hits, count, total):
    """Add a texture's colours, averaged over about a pixel."""
    for n in range(count):
        u, v = hits[n, 0], hits[n, 1]
        level = np.log2(max(hits[n, 2] * hits[n, 3], 1e-9)) - _SHARPER
        level = min(max(level, 0.0), len(levels) - 1.0)
        sharp = int(level)
        r, g, b = _texel(texels, levels, decode, sharp, u, v)
        share = level - sharp
        if share > 0:
            smooth = _texel(texels, levels, decode, sharp + 1, u, v)
            r += share * (smooth[0] - r)
            g += share * (smooth[1] - g)
            b += share * (smooth[2] - b)
        at, lit = int(hits[n, 5]), hits[n, 4]
        total[at, 0] += lit * r
        total[at, 1] += lit * g
        total[at, 2] += lit * b
        total[at, 3] += 1


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
