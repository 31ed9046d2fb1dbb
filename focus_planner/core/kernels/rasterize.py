# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Which triangle each pixel shows, from any point of an aperture, and where on it.

A pixel is a ray (x, y, 1) in the camera's optical frame, with the lens distortion undone; so
triangles stay triangles, and edges are exact whatever the distortion. With its corners P₀, P₁, P₂
relative to the ray's origin, a triangle is hit where the three

    eᵢ = (Pⱼ × Pₖ) · (x, y, 1) / det(P₀, P₁, P₂)

are at least 0; their sum is the inverse of the depth, and eᵢ over it are the barycentric
coordinates (M. Olano and T. Greer, Triangle Scan Conversion using 2D Homogeneous Coordinates,
Graphics Hardware 1997). Nothing has to be clipped, not even a triangle that reaches behind the
camera. Neighbours negate each other's eᵢ exactly, so that no ray slips between them.

Pixels are worked on in square tiles. Within a tile, pixel coordinates are nearly an affine function
of the ray, which tells the pixels to try.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import prange
from numpy.typing import NDArray

from focus_planner.core.arrays import FloatArray, IntArray
from focus_planner.core.kernels.compiling import kernel, parallel_kernel
from focus_planner.core.kernels.distortion import distort

#: Pixels along a tile's side, and tiles along that of a block of them.
TILE, BLOCK = 32, 8
#: Numbers of a tile's affine map: u and v as functions of (1, x, y), and the largest error; then
#: the steps of x and y from a column to the next, and from a row to the next.
AFFINE = 11
_NEWTON_STEPS = 8
_STEP = 1e-6


class Tiles(NamedTuple):
    """Rays of an image's pixels, and bounds of them by tile, rows of tiles first.

    Attributes
    ----------
    rays : (H, W, 2) array of float32
        x and y at depth 1 of each pixel's centre; NaN if no ray is imaged there.
    bounds, blocks : (Y, X, 4) and (Y', X', 4) arrays
        Least and greatest x, least and greatest y, of each tile and each block of tiles; the least
        is above the greatest if the tile shows nothing.
    affine : (Y, X, AFFINE) array
    """

    rays: NDArray[np.float32]
    bounds: FloatArray
    blocks: FloatArray
    affine: FloatArray


class Triangles(NamedTuple):
    """Triangles in a camera's optical frame.

    Attributes
    ----------
    vertices : (V, 3) array
        Metres.
    corners : (T, 3) array of int32
    starts, listed : arrays of int
        The triangles that tile i may show are ``listed[starts[i] : starts[i + 1]]``, ascending.
    """

    vertices: FloatArray
    corners: IntArray
    starts: IntArray
    listed: IntArray


@kernel
def stride(count):
    """Return a step that visits each of so many tiles once, any two in a row far apart.

    Threads take runs of tiles, and some parts of an image take much longer than others.
    """
    step = max(int(0.381966 * count), 1)
    while _divisor(step, count) > 1:
        step += 1
    return step


@kernel
def _divisor(a, b):
    while b:
        a, b = b, a % b
    return a


@parallel_kernel
def undistort(rays, targets, kind, k, reach):
    """Refine, in place, (n, 2) rays until they are imaged at the (n, 2) targets.

    Targets are in focal lengths from the principal point. Rays at which Newton's method does not
    arrive, or that are beyond ``reach``, become NaN.
    """
    for i in prange(len(rays)):
        x, y = rays[i]
        error = np.inf
        for _ in range(_NEWTON_STEPS):
            u, v = distort(x, y, kind, k)
            du, dv = targets[i, 0] - u, targets[i, 1] - v
            error = max(abs(du), abs(dv))
            if error < 1e-13:
                break
            step = _STEP * (1 + abs(x) + abs(y))
            right, below = distort(x + step, y, kind, k), distort(x, y + step, kind, k)
            left, above = distort(x - step, y, kind, k), distort(x, y - step, kind, k)
            a, c = (right[0] - left[0]) / (2 * step), (right[1] - left[1]) / (2 * step)
            b, d = (below[0] - above[0]) / (2 * step), (below[1] - above[1]) / (2 * step)
            det = a * d - b * c
            if not det > 0:
                error = np.inf
                break
            x += (d * du - b * dv) / det
            y += (a * dv - c * du) / det
        if not (error < 1e-9 and x * x + y * y < reach * reach):
            x, y = np.nan, np.nan
        rays[i, 0], rays[i, 1] = x, y


@parallel_kernel
def bound_tiles(rays, pinhole_steps, bounds, affine):
    """Fill in the bounds and the affine maps of tiles of the rays.

    ``pinhole_steps`` are those of x from a column to the next and of y from a row to the next, for
    tiles with no neighbours to tell them.
    """
    height, width = rays.shape[:2]
    for tile in prange(bounds.shape[0] * bounds.shape[1]):
        ty, tx = tile // bounds.shape[1], tile % bounds.shape[1]
        top, left = ty * TILE, tx * TILE
        bottom, right = min(top + TILE, height), min(left + TILE, width)
        box = bounds[ty, tx]
        box[0], box[1], box[2], box[3] = np.inf, -np.inf, np.inf, -np.inf
        for v in range(top, bottom):
            for u in range(left, right):
                x, y = rays[v, u]
                if not np.isnan(x):
                    box[0], box[1] = min(box[0], x), max(box[1], x)
                    box[2], box[3] = min(box[2], y), max(box[3], y)
        _fit(rays, affine[ty, tx], top, bottom, left, right)
        steps = affine[ty, tx, 7:]
        steps[0], steps[1], steps[2], steps[3] = pinhole_steps[0], 0.0, 0.0, pinhole_steps[1]
        for v in range(top, bottom - 1):
            for u in range(left, right - 1):
                if not np.isnan(rays[v, u, 0] + rays[v, u + 1, 0] + rays[v + 1, u, 0]):
                    for axis in range(2):
                        steps[axis] = rays[v, u + 1, axis] - rays[v, u, axis]
                        steps[2 + axis] = rays[v + 1, u, axis] - rays[v, u, axis]


@kernel
def _fit(rays, affine, top, bottom, left, right):
    """Fit the affine map of one tile to its corners; its error is infinite if they do not tell."""
    affine[:] = 0.0
    affine[6] = np.inf
    # A tile of one column or row has no slope across it: nor is one needed.
    x0, y0 = rays[top, left]
    a, c = rays[top, right - 1, 0] - x0, rays[top, right - 1, 1] - y0
    b, d = rays[bottom - 1, left, 0] - x0, rays[bottom - 1, left, 1] - y0
    columns, rows = right - 1 - left, bottom - 1 - top
    det = a * d - b * c
    if columns == 0 or rows == 0 or not abs(det) > 0:
        return
    affine[1], affine[2] = columns * d / det, -columns * b / det
    affine[4], affine[5] = -rows * c / det, rows * a / det
    affine[0] = left - affine[1] * x0 - affine[2] * y0
    affine[3] = top - affine[4] * x0 - affine[5] * y0
    error = 0.0
    for v in range(top, bottom):
        for u in range(left, right):
            x, y = rays[v, u]
            if not np.isnan(x):
                error = max(error, abs(affine[0] + affine[1] * x + affine[2] * y - u))
                error = max(error, abs(affine[3] + affine[4] * x + affine[5] * y - v))
    affine[6] = error + 1e-6


@parallel_kernel
def bound_triangles(vertices, corners, radius, inverse_focus, boxes):
    """Fill in (T, 4) least and greatest x, y at which any point of the aperture sees a triangle.

    ``radius`` is that of the aperture, and ``inverse_focus`` the inverse of the depth of the plane
    that all its points see alike.
    """
    for t in prange(len(corners)):
        box = boxes[t]
        box[0], box[1], box[2], box[3] = np.inf, -np.inf, np.inf, -np.inf
        behind = 0
        for i in range(3):
            x, y, z = vertices[corners[t, i]]
            if z > 0:
                spread = radius * abs(inverse_focus - 1 / z)
                x, y = x / z, y / z
                box[0], box[1] = min(box[0], x - spread), max(box[1], x + spread)
                box[2], box[3] = min(box[2], y - spread), max(box[3], y + spread)
            else:
                behind += 1
        if 0 < behind < 3:
            _bound_beside(vertices, corners[t], radius, inverse_focus, box)


@kernel
def _bound_beside(vertices, triangle, radius, inverse_focus, box):
    """Bound what of a triangle that reaches behind the camera is before it.

    At depth z, what is at least d beside all of the aperture is seen at least d / z off.
    """
    nearest, farthest, depth = np.full(2, np.inf), np.full(2, -np.inf), 0.0
    for i in range(3):
        corner = vertices[triangle[i]]
        depth = max(depth, corner[2])
        for axis in range(2):
            nearest[axis] = min(nearest[axis], corner[axis])
            farthest[axis] = max(farthest[axis], corner[axis])
    for axis in range(2):
        box[2 * axis], box[2 * axis + 1] = -np.inf, np.inf
        if nearest[axis] > radius:
            box[2 * axis] = (nearest[axis] - radius) / depth - radius * inverse_focus
        if farthest[axis] < -radius:
            box[2 * axis + 1] = (farthest[axis] + radius) / depth + radius * inverse_focus


@kernel
def list_by_tile(boxes, bounds, blocks, margin, starts, listed):
    """List the triangles that each tile may show; return how many entries there are.

    Called first with no room in ``listed``, to count: ``starts`` then holds the counts' sums.
    ``margin`` widens the tiles, for rays beside pixels' centres.
    """
    counting = len(listed) == 0
    if counting:
        starts[:] = 0
    columns = bounds.shape[1]
    for t in range(len(boxes)):
        box = boxes[t]
        for by in range(blocks.shape[0]):
            for bx in range(blocks.shape[1]):
                if not _meet(box, blocks[by, bx], margin):
                    continue
                for ty in range(by * BLOCK, min(by * BLOCK + BLOCK, bounds.shape[0])):
                    for tx in range(bx * BLOCK, min(bx * BLOCK + BLOCK, columns)):
                        if _meet(box, bounds[ty, tx], margin):
                            tile = ty * columns + tx
                            if not counting:
                                listed[starts[tile]] = t
                            starts[tile + counting] += 1
    if counting:
        for tile in range(1, len(starts)):
            starts[tile] += starts[tile - 1]
    else:  # every start has moved to its tile's end
        for tile in range(len(starts) - 1, 0, -1):
            starts[tile] = starts[tile - 1]
        starts[0] = 0
    return starts[-1]


@kernel
def _meet(box, other, margin):
    return (
        box[0] <= other[1] + margin
        and box[1] >= other[0] - margin
        and box[2] <= other[3] + margin
        and box[3] >= other[2] - margin
    )


@kernel
def scan(triangles, tiles, tile, bounds, origin, shift, inverse, shown, where):
    """Fill in, for a tile's pixels, the inverse depth that each shows, the triangle, and where.

    Parameters
    ----------
    triangles : Triangles
    tiles : Tiles
    tile : int
    bounds : (4,) array
        The tile's.
    origin : (2,) array
        Where the rays start: x, y in the plane of the aperture, metres.
    shift : (2,) array
        Added to the rays' x and y.
    inverse : (TILE, TILE) array
        1/m; 0 where nothing is.
    shown : (TILE, TILE) array of int
        Twice the triangle's index, one more if its inner side is seen; -1 where nothing is.
    where : (TILE, TILE, 2) array
        The weights of the second and the third corner, times the inverse depth.
    """
    inverse[:] = 0.0
    shown[:] = -1
    rays = tiles.rays
    ty, tx = tile // tiles.bounds.shape[1], tile % tiles.bounds.shape[1]
    top, left = ty * TILE, tx * TILE
    bottom, right = min(top + TILE, rays.shape[0]), min(left + TILE, rays.shape[1])
    affine = tiles.affine[ty, tx]
    # Rows of arrays as objects of their own would cost more, here, than what is done with them.
    vertices, corners, listed = triangles.vertices, triangles.corners, triangles.listed
    from_x, from_y, shift_x, shift_y = origin[0], origin[1], shift[0], shift[1]
    for at in range(triangles.starts[tile], triangles.starts[tile + 1]):
        t = listed[at]
        a, b, c = corners[t, 0], corners[t, 1], corners[t, 2]
        ax, bx, cx = vertices[a, 0] - from_x, vertices[b, 0] - from_x, vertices[c, 0] - from_x
        ay, by, cy = vertices[a, 1] - from_y, vertices[b, 1] - from_y, vertices[c, 1] - from_y
        az, bz, cz = vertices[a, 2], vertices[b, 2], vertices[c, 2]
        u0, u1, v0, v1 = left, right, top, bottom
        if min(az, bz, cz) > 0:
            qa, qb, qc = ax / az, bx / bz, cx / cz
            low_x = max(min(qa, qb, qc) - shift_x, bounds[0])
            high_x = min(max(qa, qb, qc) - shift_x, bounds[1])
            qa, qb, qc = ay / az, by / bz, cy / cz
            low_y = max(min(qa, qb, qc) - shift_y, bounds[2])
            high_y = min(max(qa, qb, qc) - shift_y, bounds[3])
            if low_x > high_x or low_y > high_y:
                continue
            if affine[6] < TILE:
                x, y = (low_x + high_x) / 2, (low_y + high_y) / 2
                half_x, half_y = (high_x - low_x) / 2, (high_y - low_y) / 2
                middle = affine[0] + affine[1] * x + affine[2] * y
                half = abs(affine[1]) * half_x + abs(affine[2]) * half_y + affine[6]
                u0 = max(u0, int(np.ceil(middle - half)))
                u1 = min(u1, int(np.floor(middle + half)) + 1)
                middle = affine[3] + affine[4] * x + affine[5] * y
                half = abs(affine[4]) * half_x + abs(affine[5]) * half_y + affine[6]
                v0 = max(v0, int(np.ceil(middle - half)))
                v1 = min(v1, int(np.floor(middle + half)) + 1)
                if u0 >= u1 or v0 >= v1:
                    continue
        nax, nay, naz = by * cz - bz * cy, bz * cx - bx * cz, bx * cy - by * cx
        nbx, nby, nbz = cy * az - cz * ay, cz * ax - cx * az, cx * ay - cy * ax
        ncx, ncy, ncz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
        det = ax * nax + ay * nay + az * naz
        if det == 0:
            continue
        sign = 1.0 if det > 0 else -1.0
        nax, nay, naz = sign * nax, sign * nay, sign * naz
        nbx, nby, nbz = sign * nbx, sign * nby, sign * nbz
        ncx, ncy, ncz = sign * ncx, sign * ncy, sign * ncz
        scale = sign / det
        inner = 1 if det > 0 else 0  # the corners then run anticlockwise in the image
        for v in range(v0, v1):
            for u in range(u0, u1):
                x, y = rays[v, u, 0] + shift_x, rays[v, u, 1] + shift_y
                ea = nax * x + nay * y + naz
                eb = nbx * x + nby * y + nbz
                ec = ncx * x + ncy * y + ncz
                if ea >= 0 and eb >= 0 and ec >= 0:
                    near = (ea + eb + ec) * scale
                    i, j = v - top, u - left
                    if near > inverse[i, j]:
                        inverse[i, j] = near
                        shown[i, j] = 2 * t + inner
                        where[i, j, 0], where[i, j, 1] = eb * scale, ec * scale


@kernel
def _see(triangles, tiles, tile):
    """Return (TILE, TILE) the inverse depth of what the centres of a tile's pixels show."""
    inverse, shown = np.empty((TILE, TILE)), np.empty((TILE, TILE), np.int32)
    centre, where = np.zeros(2), np.empty((TILE, TILE, 2))
    bounds = tiles.bounds[tile // tiles.bounds.shape[1], tile % tiles.bounds.shape[1]]
    scan(triangles, tiles, tile, bounds, centre, centre, inverse, shown, where)
    return inverse


@parallel_kernel
def farthest_off_focus(triangles, tiles, inverse_focus, farthest):
    """Fill in (Y, X) by how much 1/depth of what a tile shows differs, at most, from the focus's.

    0 where nothing is.
    """
    columns = farthest.shape[1]
    count = farthest.shape[0] * columns
    step = stride(count)
    for number in prange(count):
        tile, most = number * step % count, 0.0
        if triangles.starts[tile + 1] > triangles.starts[tile]:
            inverse = _see(triangles, tiles, tile)
            for v in range(TILE):
                for u in range(TILE):
                    if inverse[v, u] > 0:
                        most = max(most, abs(inverse[v, u] - inverse_focus))
        farthest[tile // columns, tile % columns] = most


@parallel_kernel
def depths(triangles, tiles, image):
    """Fill in (H, W) the depth of what each pixel's centre shows; inf where nothing is."""
    height, width = image.shape
    columns = tiles.bounds.shape[1]
    count = tiles.bounds.shape[0] * columns
    step = stride(count)
    for number in prange(count):
        tile = number * step % count
        inverse = _see(triangles, tiles, tile)
        top, left = tile // columns * TILE, tile % columns * TILE
        for v in range(top, min(top + TILE, height)):
            for u in range(left, min(left + TILE, width)):
                near = inverse[v - top, u - left]
                image[v, u] = 1 / near if near > 0 else np.inf
