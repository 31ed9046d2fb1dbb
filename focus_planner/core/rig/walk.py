# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The order in which the cameras of a rig are visited, by who sets lenses or by what moves."""

from __future__ import annotations

import numpy as np

from focus_planner.core.arrays import FloatArray, IntArray
from focus_planner.core.rig.geometry import camera_positions, camera_rotations
from focus_planner.core.rig.rig import Rig

# Relative to the rig's size: closer together, cameras are at one place.
_SAME_PLACE = 0.01
# Degrees: the same, for cameras around a centre.
_SAME_ANGLE = 0.5
# A gap in a ring of cameras is its way in if it is so wide, in degrees, and so many times as wide
# as any other.
_OPENING, _WIDER = 90.0, 1.5


def walking_order(rig: Rig) -> IntArray:
    """Return the indices of the cameras as one walks the rig: column by column, each from below.

    A rig that is a sequence is in its own order, that of shooting. With a grid, its columns.
    Otherwise z is up (REP 103), and columns are found in the poses: where the optical axes meet in
    the middle, by the angle around it, anticlockwise from the column of the first camera or, if the
    ring is open, from the end nearer to it; else, as with cameras on a wall or on a gantry, along
    the longer horizontal side, from the end nearer to the first camera. Cameras above or below the
    middle come last. Of cameras in one spot, the axes stand for the places.

    Returns
    -------
    (C,) array of int
        Every index once.
    """
    indices = np.arange(len(rig), dtype=np.int32)
    if rig.sequence:
        return indices
    if rig.grid is not None:
        return indices.reshape(rig.grid.rows, rig.grid.columns).T.ravel()
    places, axes = camera_positions(rig), camera_rotations(rig)[:, :, 2]
    size = float(np.ptp(places, axis=0).max())
    # Rounding is relative to the coordinates, and can be larger than no size at all.
    if size <= 1e-9 * (1 + float(np.abs(places).max())):
        places, size = axes, 1.0
        centre: FloatArray | None = np.zeros(2)
    else:
        centre = _centre(places[:, :2], axes[:, :2])
    columns = _along(places, size) if centre is None else _around(places[:, :2] - centre)
    # The sort is stable: what is left keeps the rig's order.
    return np.lexsort((_up(places), columns)).astype(np.int32)


def _centre(places: FloatArray, axes: FloatArray) -> FloatArray | None:
    """Return where horizontal axes meet; None if they do not.

    Parameters
    ----------
    places, axes : (C, 2) arrays
    """
    # The point of least squared distance from all axes, weighted by how horizontal they are.
    crosswise = np.einsum("ni,ni->n", axes, axes)[:, None, None] * np.eye(2)
    crosswise = crosswise - axes[:, :, None] * axes[:, None, :]
    total = crosswise.sum(axis=0)
    if np.linalg.eigvalsh(total)[0] < 0.05 * len(axes):  # nearly parallel, or vertical
        return None
    centre: FloatArray = np.linalg.solve(total, np.einsum("nij,nj->i", crosswise, places))
    offsets = places - centre
    aligned = np.abs(np.einsum("ni,ni->n", offsets, axes))
    lengths = np.linalg.norm(offsets, axis=1) * np.linalg.norm(axes, axis=1)
    return centre if np.median(aligned) > 0.7 * np.median(lengths) else None


def _around(offsets: FloatArray) -> IntArray:
    """Return each camera's column by its angle as seen from the centre.

    Parameters
    ----------
    offsets : (C, 2) array
        Of the cameras from the centre.
    """
    radius = np.linalg.norm(offsets, axis=1)
    beside = radius > 0.05 * radius.max()
    columns = np.full(len(offsets), len(offsets), np.int32)  # above or below the centre: the last
    if beside.any():
        columns[beside] = _ring(np.degrees(np.arctan2(offsets[beside, 1], offsets[beside, 0])))
    return columns


def _ring(angles: FloatArray) -> IntArray:
    """Return the columns of angles in degrees."""
    order = np.argsort(angles, kind="stable")
    gaps = np.diff(angles[order], append=angles[order[0]] + 360)  # behind each
    widest = int(np.argmax(gaps))
    others = np.delete(gaps, widest)
    is_open = gaps[widest] > max(_OPENING, _WIDER * others.max(initial=0.0))
    # From behind the widest gap on, so that no column is cut in two.
    order, gaps = np.roll(order, -widest - 1), np.roll(gaps, -widest - 1)[:-1]
    columns = np.empty(len(angles), np.int32)
    columns[order] = _columns(gaps, _SAME_ANGLE)
    count = int(columns.max()) + 1
    if not is_open:
        columns = (columns - columns[0]) % count
    elif 2 * columns[0] > count - 1:
        columns = count - 1 - columns
    return columns


def _along(places: FloatArray, size: float) -> IntArray:
    """Return each camera's column along the rig's longer horizontal side."""
    along, _ = _sides(places)
    if along[0] > 0:
        along = -along
    order = np.argsort(along, kind="stable")
    columns = np.empty(len(places), np.int32)
    columns[order] = _columns(np.diff(along[order]), _SAME_PLACE * size)
    return columns


def _columns(gaps: FloatArray, least: float) -> IntArray:
    """Return the columns of cameras in a row, given the gaps between them.

    Evenly spaced cameras are columns of their own, and those of one column are much nearer to each
    other than to the next: half the mean gap tells the two apart.
    """
    between = max(least, float(gaps.mean()) / 2) if len(gaps) else least
    return np.concatenate([[0], np.cumsum(gaps > between)]).astype(np.int32)


def _sides(places: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the coordinates along the longer and the shorter horizontal side, from the middle."""
    level = places[:, :2] - places[:, :2].mean(axis=0)
    _, _, axes = np.linalg.svd(level, full_matrices=False)
    axes = np.vstack([axes, np.zeros((2 - len(axes), 2))])
    # The signs are arbitrary.
    axes = axes * np.where(axes[np.arange(2), np.abs(axes).argmax(axis=1)] < 0, -1.0, 1.0)[:, None]
    return level @ axes[0], level @ axes[1]


def _up(places: FloatArray) -> FloatArray:
    """Return what orders the cameras of a column: the height or, of a flat rig, the way across."""
    _, across = _sides(places)
    return places[:, 2] if np.ptp(places[:, 2]) >= _SAME_PLACE * np.ptp(across) else across
