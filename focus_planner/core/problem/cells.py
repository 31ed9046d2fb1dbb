# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Focus cells: the ranges of focus distance worth choosing between, with costs in whole units."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from focus_planner.core.arrays import FloatArray, IntArray, Offsets
from focus_planner.core.brief import brief_repr
from focus_planner.core.rig.lens import Lens
from focus_planner.core.rig.optics import nearest_settable

# Solvers count cost in whole units of 2^-43 of the total weight: sums are exact in any order, ties
# are ties, and no step is taken that does not pay. Rounding to units changes costs by 1e-13 of the
# total, far below what any capture can show; kernels/k_view.py needs the remaining bits.
UNITS = 2**43


@dataclass(frozen=True, eq=False)
class Cells:
    """Each camera's focus cells, and the cost of each pair in whole units.

    A cell is a maximal range of focus distances that hold the same pairs in focus, such that no
    other range holds those and more: one distance per cell is worth considering (Sec. 3.4.1).

    With several views per sample the units of each are divided by their number: a sample costs the
    sum of so many least costs.

    Attributes
    ----------
    lenses : tuple of Lens
        The problem's: one per camera.
    offsets : (C + 1,) array of int64
        Camera c's cells are ``offsets[c]`` to ``offsets[c + 1]``, ascending.
    near, far : (M,) arrays
        The ends of each cell, metres; far may be inf.
    base : (P,) array of int64
        Weighted cost of each pair in focus, units.
    first, last : (P,) arrays of int32
        The first and last cell that holds each pair in focus, counted from its camera's first
        cell; first > last if none does.
    seen, seen_base, seen_first, seen_last : (P,) arrays
        Sample, base, first and last of each pair, ordered by camera and ascending sample: camera
        c's pairs are ``camera_offsets[c]`` to ``camera_offsets[c + 1]`` of the problem.
    focus : (N,) array of int64
        Weighted extra cost of each sample out of focus, units.
    unseen : (N,) array of int64
        Weighted cost of each view of a sample that is missing, units.
    """

    lenses: tuple[Lens, ...]
    offsets: Offsets
    near: FloatArray
    far: FloatArray
    base: Offsets
    first: IntArray
    last: IntArray
    seen: IntArray
    seen_base: Offsets
    seen_first: IntArray
    seen_last: IntArray
    focus: Offsets
    unseen: Offsets

    __repr__ = brief_repr

    def distances(self) -> FloatArray:
        """Return (M,) the settable focus distance nearest to each cell's middle, metres."""
        cameras = np.repeat(np.arange(len(self.lenses)), np.diff(self.offsets))
        return settable(self.lenses, cameras, middle(self.near, self.far))


def middle(near: FloatArray, far: FloatArray) -> FloatArray:
    """Return the middle of [near, far]; where far is inf, the middle in dioptres: 2·near."""
    bounded = np.isfinite(far)
    return np.where(bounded, (near + np.where(bounded, far, near)) / 2, 2 * near)


def settable(
    lenses: tuple[Lens, ...], cameras: NDArray[np.integer[Any]], distances: FloatArray
) -> FloatArray:
    """Return the nearest distance to each that its camera's lens can be set to, metres.

    From the middle of a cell this stays within the cell, whose ends are settable.
    """
    moved = np.empty_like(distances)
    for lens, part in group_by_lens(lenses, cameras):
        moved[part] = nearest_settable(distances[part], lens)
    return moved


def group_by_lens(
    lenses: tuple[Lens, ...], cameras: NDArray[np.integer[Any]]
) -> Iterator[tuple[Lens, NDArray[np.int64] | slice]]:
    """Yield every distinct lens and where it occurs among the cameras, given by index."""
    kinds, kind = lens_kinds(lenses)
    if len(kinds) == 1:
        yield lenses[0], slice(None)
        return
    # One sort of small integers: with a table each, every camera's lens is different.
    kind_of_each = kind.astype(np.min_scalar_type(len(kinds)))[cameras]
    order = np.argsort(kind_of_each, kind="stable")
    ends = np.cumsum(np.bincount(kind_of_each, minlength=len(kinds)))
    for lens, low, high in zip(kinds, [0, *ends[:-1]], ends, strict=True):
        yield lens, order[low:high]


def lens_kinds(lenses: tuple[Lens, ...]) -> tuple[tuple[Lens, ...], IntArray]:
    """Return the distinct lenses, and as (C,) indices into these which one each camera has."""
    return _kinds_of(_Identity(lenses))


@dataclass(frozen=True, eq=False)
class _Identity:
    """Lenses that are the same as others only if they are one object: comparing them takes long."""

    lenses: tuple[Lens, ...]

    def __hash__(self) -> int:
        return id(self.lenses)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Identity) and self.lenses is other.lenses


@lru_cache(maxsize=16)
def _kinds_of(same: _Identity) -> tuple[tuple[Lens, ...], IntArray]:
    number = {lens: kind for kind, lens in enumerate(dict.fromkeys(same.lenses))}
    return tuple(number), np.array([number[lens] for lens in same.lenses], dtype=np.int32)


def cost_of_units(units: int) -> float:
    """Return the cost, 1000 × the weighted mean, of a total in units."""
    return 1000.0 * units / UNITS


def units_of_cost(cost: float) -> int:
    """Return the total in units, rounded down, of a cost, 1000 × the weighted mean."""
    return math.floor(cost / 1000.0 * UNITS)


def to_units(values: FloatArray) -> Offsets:
    """Return values, already in multiples of a unit, rounded to whole units."""
    return np.rint(values).astype(np.int64)
