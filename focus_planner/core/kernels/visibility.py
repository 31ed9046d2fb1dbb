# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Which samples are in the field of view of which camera."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import prange

from focus_planner.core.arrays import FloatArray
from focus_planner.core.kernels.compiling import kernel, parallel_kernel

#: Samples per block. Smaller ones take more tests; larger ones are less often ruled out whole.
PER_BLOCK = 64
#: The last of the cells that an axis is divided into for sorting.
PLACES = 2**20 - 1
# More than what rounding does to a test, relative to the distances in it; and what it does to the
# square root of a difference.
_SLACK = 1e-9
_SLACK_OF_ROOT = 1e-6
# Keys are sorted by so many bits at a time: the counts of their values stay in the fastest cache.
_BITS = 11
_VALUES = 2**_BITS
_DIGITS = (64 + _BITS - 1) // _BITS
_DE_BRUIJN = np.uint64(0x03F79D71B4CB0A89)
_PLACES_OF_BITS = np.empty(64, dtype=np.int64)
for _place in range(64):
    _PLACES_OF_BITS[(int(_DE_BRUIJN) << _place) % 2**64 >> 58] = _place
_SPREADING = (
    (np.uint64(32), np.uint64(0x001F00000000FFFF)),
    (np.uint64(16), np.uint64(0x001F0000FF0000FF)),
    (np.uint64(8), np.uint64(0x100F00F00F00F00F)),
    (np.uint64(4), np.uint64(0x10C30C30C30C30C3)),
    (np.uint64(2), np.uint64(0x1249249249249249)),
)


class Views(NamedTuple):
    """Where C cameras stand, and what their images hold.

    Attributes
    ----------
    positions : (C, 3) array
        Metres.
    rotations : (C, 3, 3) array
        From each camera's optical frame to the rig's.
    frustums : (C, 7) array
        fx, fy, cx, cy, width, height in pixels, and the least depth in metres.
    """

    positions: FloatArray
    rotations: FloatArray
    frustums: FloatArray


class Blocks(NamedTuple):
    """Samples, ``PER_BLOCK`` at a time, and what bounds each of the B blocks.

    Attributes
    ----------
    points, normals : (B, 3, PER_BLOCK) arrays
        Metres, one row per coordinate; NaN beyond the last sample.
    spheres : (4, B) array
        Around the points: centre and radius, metres.
    cones : (5, B) array
        Around the normals: axis, cosine and sine of the half-angle. The cosine of a half-angle of
        a right angle or more is -1.
    """

    points: FloatArray
    normals: FloatArray
    spheres: FloatArray
    cones: FloatArray


@kernel
def _spread(value):
    """Return the lower 20 bits of a number, two zeros apart."""
    spread = np.uint64(value)
    for shift, mask in _SPREADING:
        spread = (spread | (spread << shift)) & mask
    return spread


@parallel_kernel
def block_keys(points, normals, facing):
    """Return (N,) keys that sort samples into blocks: by normal if ``facing``, then by position.

    Above the position's Morton code, 20 bits per axis of a cube around all, is the normal's octant.
    """
    keys = np.empty(len(points), dtype=np.uint64)
    low, high = points[0].copy(), points[0].copy()
    for p in range(len(points)):
        for axis in range(3):
            low[axis] = min(low[axis], points[p, axis])
            high[axis] = max(high[axis], points[p, axis])
    extent = (high - low).max()
    scale = PLACES / extent if extent > 0 else 0.0
    for p in prange(len(points)):
        key = np.uint64(0)
        for axis in range(3):
            if facing and normals[p, axis] < 0:
                key |= np.uint64(1) << np.uint64(60 + axis)
            key |= _spread(np.int64((points[p, axis] - low[axis]) * scale)) << np.uint64(axis)
        keys[p] = key
    return keys


@kernel
def _digit(key, digit):
    """Return a digit of a key, the lowest being 0."""
    return np.int64((key >> np.uint64(_BITS * digit)) & np.uint64(_VALUES - 1))


@kernel
def ascending(keys):
    """Return (N,) indices that sort (N,) keys of 64 bits; equal ones stay in order.

    Digit by digit, the lowest first, each by counting.
    """
    begins = np.zeros((_DIGITS, _VALUES + 1), dtype=np.int64)
    for key in keys:
        for digit in range(_DIGITS):
            begins[digit, _digit(key, digit) + 1] += 1
    order, other = np.arange(len(keys)), np.empty(len(keys), dtype=np.int64)
    key, other_key = keys.copy(), np.empty_like(keys)
    for digit in range(_DIGITS):
        at = begins[digit]
        if at.max() == len(keys):
            continue  # all the same
        for value in range(_VALUES):
            at[value + 1] += at[value]
        for i in range(len(keys)):
            value = _digit(key[i], digit)
            other[at[value]], other_key[at[value]] = order[i], key[i]
            at[value] += 1
        order, other = other, order
        key, other_key = other_key, key
    return order


@parallel_kernel
def blocks_of(points, normals, order):
    """Return the blocks of samples in the given order, (N,) indices."""
    count = (len(order) + PER_BLOCK - 1) // PER_BLOCK
    places = np.full((count, 3, PER_BLOCK), np.nan)
    directions = np.full((count, 3, PER_BLOCK), np.nan)
    spheres, cones = np.empty((4, count)), np.empty((5, count))
    for b in prange(count):
        size = min(PER_BLOCK, len(order) - b * PER_BLOCK)
        for i in range(size):
            p = order[b * PER_BLOCK + i]
            for axis in range(3):
                places[b, axis, i] = points[p, axis]
                directions[b, axis, i] = normals[p, axis]
        sphere, cone = _bounds(places[b, :, :size], directions[b, :, :size])
        spheres[:, b] = sphere
        cones[:, b] = cone
    return Blocks(places, directions, spheres, cones)


@kernel
def _bounds(points, normals):
    """Return the sphere and the cone that bound (3, n) points and normals."""
    sphere, cone = np.empty(4), np.empty(5)
    for axis in range(3):
        sphere[axis] = (points[axis].min() + points[axis].max()) / 2
        cone[axis] = normals[axis].sum()
    length = np.sqrt(cone[0] ** 2 + cone[1] ** 2 + cone[2] ** 2)
    radius, cosine = 0.0, 1.0
    for i in range(points.shape[1]):
        away, along, norm = 0.0, 0.0, 0.0
        for axis in range(3):
            away += (points[axis, i] - sphere[axis]) ** 2
            along += normals[axis, i] * cone[axis]
            norm += normals[axis, i] ** 2
        radius = max(radius, np.sqrt(away))
        told = norm > 0 and length > 0
        cosine = min(cosine, along / (np.sqrt(norm) * length)) if told else -1.0
    sphere[3] = radius
    cone[:3] /= max(length, 1e-300)
    cone[3] = cosine - _SLACK if cosine > _SLACK else -1.0
    cone[4] = np.sqrt(max(0.0, 1.0 - cone[3] ** 2))
    return sphere, cone


@kernel
def _may_see(spheres, cones, position, rotation, frustum, facing, may):
    """Fill ``may`` (n,): False only if none of a block is in view, rounding included.

    So it is where the whole sphere lies beyond one side of the frustum, or where all normals of the
    cone point away from the camera from anywhere in the sphere.
    """
    px, py, pz = position
    fx, fy, cx, cy, width, height, nearest = frustum
    left, right = cx + 0.5, cx + 0.5 - width
    top, bottom = cy + 0.5, cy + 0.5 - height
    to_left, to_right = np.sqrt(fx * fx + left * left), np.sqrt(fx * fx + right * right)
    to_top, to_bottom = np.sqrt(fy * fy + top * top), np.sqrt(fy * fy + bottom * bottom)
    reach = abs(px) + abs(py) + abs(pz)
    for b in range(len(may)):
        dx, dy, dz = spheres[0, b] - px, spheres[1, b] - py, spheres[2, b] - pz
        away = np.sqrt(dx * dx + dy * dy + dz * dz)
        room = spheres[3, b] + _SLACK * (away + spheres[3, b] + reach)
        along = cones[0, b] * dx + cones[1, b] * dy + cones[2, b] * dz
        across = np.sqrt(max(0.0, away * away - along * along))
        averse = (cones[3, b] > 0) & (
            along * cones[3, b] - across * cones[4, b] > room + _SLACK_OF_ROOT * away
        )
        z = rotation[0, 2] * dx + rotation[1, 2] * dy + rotation[2, 2] * dz
        x = rotation[0, 0] * dx + rotation[1, 0] * dy + rotation[2, 0] * dz
        y = rotation[0, 1] * dx + rotation[1, 1] * dy + rotation[2, 1] * dz
        beyond = (fx * x + left * z < -room * to_left) | (fx * x + right * z > room * to_right)
        beyond |= (fy * y + top * z < -room * to_top) | (fy * y + bottom * z > room * to_bottom)
        may[b] = (z + room > nearest) & (not beyond) & (not (facing & averse))


@parallel_kernel
def near_view(blocks, views, facing):
    """Return (C, B) whether each camera may see any sample of each block."""
    _, _, spheres, cones = blocks
    positions, rotations, frustums = views
    may = np.empty((len(positions), spheres.shape[1]), dtype=np.bool_)
    for c in prange(len(positions)):
        _may_see(spheres, cones, positions[c], rotations[c], frustums[c], facing, may[c])
    return may


@kernel
def _see(points, normals, position, rotation, frustum, facing, seen):
    """Fill ``seen`` (PER_BLOCK,): whether each point of a block is in view.

    ``frustum`` is fx, fy, cx, cy, width, height, nearest. No branches, so that the compiler takes
    several points at once.
    """
    px, py, pz = position
    fx, fy, cx, cy, width, height, nearest = frustum
    for i in range(PER_BLOCK):
        dx, dy, dz = points[0, i] - px, points[1, i] - py, points[2, i] - pz
        front = normals[0, i] * dx + normals[1, i] * dy + normals[2, i] * dz < 0
        z = rotation[0, 2] * dx + rotation[1, 2] * dy + rotation[2, 2] * dz
        x = rotation[0, 0] * dx + rotation[1, 0] * dy + rotation[2, 0] * dz
        y = rotation[0, 1] * dx + rotation[1, 1] * dy + rotation[2, 1] * dz
        u, v = np.divide(fx * x, z) + cx, np.divide(fy * y, z) + cy
        inside = (u >= -0.5) & (u < width - 0.5) & (v >= -0.5) & (v < height - 0.5)
        seen[i] = (z > nearest) & inside & (front | (not facing))


@parallel_kernel
def list_in_view(blocks, may, views, facing, room, listed):
    """List the samples in each camera's image, and facing it if ``facing``; return (C,) counts.

    Camera c's are written to ``listed`` from ``room[c]`` on, as places in the order of the blocks:
    ``PER_BLOCK`` at most for each block that it may see.
    """
    counts = np.zeros(len(views.positions), dtype=np.int64)
    for c in prange(len(counts)):
        counts[c] = _list_in_view(c, blocks, may[c], views, facing, listed[room[c] :])
    return counts


@kernel
def _list_in_view(c, blocks, may, views, facing, listed):
    """List what is in camera c's view; return how many samples are."""
    at, seen = 0, np.empty(PER_BLOCK, dtype=np.bool_)
    position, rotation, frustum = views.positions[c], views.rotations[c], views.frustums[c]
    for b in np.flatnonzero(may):
        _see(blocks.points[b], blocks.normals[b], position, rotation, frustum, facing, seen)
        for i in range(PER_BLOCK):
            listed[at] = b * PER_BLOCK + i
            at += seen[i]
    return at


@kernel
def _fill_rays(points, position, listed, centre, stop_short, rays):
    """Fill (n, 6) the rays from one camera, at most ``PER_BLOCK`` of them."""
    x, y, z, share = np.empty((4, PER_BLOCK))
    ox, oy, oz = position[0] - centre[0], position[1] - centre[1], position[2] - centre[2]
    for i in range(len(listed)):
        b, place = listed[i] // PER_BLOCK, listed[i] % PER_BLOCK
        x[i] = points[b, 0, place] - centre[0] - ox
        y[i] = points[b, 1, place] - centre[1] - oy
        z[i] = points[b, 2, place] - centre[2] - oz
    # All of them, whatever is beyond the last: the compiler takes several at once.
    for i in range(PER_BLOCK):
        length = np.sqrt(x[i] * x[i] + y[i] * y[i] + z[i] * z[i])
        share[i] = np.divide(max(length - stop_short, 0.0), max(length, 1e-300))
    for i in range(len(listed)):
        rays[i, 0], rays[i, 1], rays[i, 2] = ox, oy, oz
        rays[i, 3], rays[i, 4], rays[i, 5] = x[i] * share[i], y[i] * share[i], z[i] * share[i]


@parallel_kernel
def fill_rays(blocks, positions, room, listed, offsets, centre, stop_short, rays):
    """Fill (n, 6) the rays from each camera to the samples it lists, from ``offsets[c]`` on.

    They are relative to ``centre`` and stop ``stop_short``, in metres, short of the sample.
    """
    points = blocks.points
    for c in prange(len(positions)):
        count = offsets[c + 1] - offsets[c]
        for low in range(0, count, PER_BLOCK):
            high = min(low + PER_BLOCK, count)
            _fill_rays(
                points,
                positions[c],
                listed[room[c] + low : room[c] + high],
                centre,
                stop_short,
                rays[offsets[c] + low : offsets[c] + high],
            )


@parallel_kernel
def count_seen(offsets, hidden):
    """Return (C,) how many of each camera's rays are not hidden."""
    counts = np.zeros(len(offsets) - 1, dtype=np.int64)
    for c in prange(len(counts)):
        for i in range(offsets[c], offsets[c + 1]):
            counts[c] += not hidden[i]
    return counts


@kernel
def _list_ascending(marked, found):
    """Fill the numbers of the bits that are set in an array of words, ascending."""
    at = 0
    for w in range(len(marked)):
        word = marked[w]
        while word:
            # A de Bruijn sequence tells the lowest bit's place by what is moved to the top.
            lowest = word & (~word + np.uint64(1))
            found[at] = 64 * w + _PLACES_OF_BITS[(lowest * _DE_BRUIJN) >> np.uint64(58)]
            at += 1
            word ^= lowest


@parallel_kernel
def list_seen(room, listed, offsets, hidden, order, seen_offsets, found):
    """Fill ``found`` with each camera's samples that are not hidden, ascending.

    Camera c's are written from ``seen_offsets[c]`` on; what it lists as p is sample ``order[p]``.
    """
    for c in prange(len(offsets) - 1):
        part = slice(offsets[c], offsets[c + 1])
        own = listed[room[c] : room[c] + offsets[c + 1] - offsets[c]]
        marked = _mark_seen(own, hidden[part], order)
        _list_ascending(marked, found[seen_offsets[c] : seen_offsets[c + 1]])


@kernel
def _mark_seen(listed, hidden, order):
    """Return the samples that one camera lists and are not hidden, as bits of words."""
    marked = np.zeros((len(order) + 63) // 64, dtype=np.uint64)
    for i in range(len(listed)):
        p = order[listed[i]]
        marked[p >> 6] |= np.uint64(not hidden[i]) << np.uint64(p & 63)
    return marked


@parallel_kernel
def gather(starts, counts, shifts, offsets, source, gathered):
    """Fill camera c's part of ``gathered``, from ``offsets[c]`` on, with its parts of ``source``.

    Part k is ``counts[k, c]`` numbers from ``starts[k, c]`` on; each is raised by ``shifts[k]``.
    """
    for c in prange(len(offsets) - 1):
        at = offsets[c]
        for k in range(len(counts)):
            low, count = starts[k, c], counts[k, c]
            _copy_shifted(source[low : low + count], shifts[k], gathered[at : at + count])
            at += count


@kernel
def _copy_shifted(source, shift, copied):
    """Fill a copy that is raised by a number."""
    for i in range(len(source)):
        copied[i] = source[i] + shift
