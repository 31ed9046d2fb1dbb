"""Focus ranges worth choosing between, costs in whole units."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from focus_planner.core.arrays import FloatArray, IntArray, Offsets
from focus_planner.core.rig.lens import Lens
from focus_planner.core.rig.optics import nearest_settable

# Solvers count cost in whole units of 2^-43 of the total weight: sums are exact whatever their
# order, ties are ties, and a step that does not pay is never taken. What rounding a sample's
# cost to a unit changes, 1e-13 of the total, no capture can tell; kernels/k_view.py needs the
# bits above.
UNITS = 2**43


@dataclass(frozen=True, eq=False)
class Cells:
    """The focus distances worth choosing between, and what each pair costs, in whole units.

    Attributes
    ----------
    lenses : tuple of Lens
        The problem's.
    offsets : (C + 1,) array of int64
        Camera c's cells are ``offsets[c]`` to ``offsets[c + 1]``, ascending.
    near, far : (M,) arrays
        The focus distances that each cell reaches from and to, metres; far may be inf.
    base : (P,) array of int64
        Cost of each pair in focus, weighted, in units.
    first, last : (P,) arrays of int32
        The cells of its camera, counted from the camera's first, that hold each pair in focus;
        first > last if none does.
    seen, seen_base, seen_first, seen_last : (P,) arrays
        The pairs' samples, and the same, camera by camera: camera c's pairs, samples ascending,
        are ``camera_offsets[c]`` to ``camera_offsets[c + 1]`` of the problem.
    focus : (N,) array of int64
        What the sample costs more out of focus, weighted, in units.
    unseen : (N,) array of int64
        What the sample costs if no camera sees it, weighted, in units.
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

    def distances(self) -> FloatArray:
        """Return (M,) the focus distance in the middle of each cell, metres (Sec. 3.4.1)."""
        cameras = np.repeat(np.arange(len(self.lenses)), np.diff(self.offsets))
        return settable(self.lenses, cameras, middle(self.near, self.far))


def middle(near: FloatArray, far: FloatArray) -> FloatArray:
    """Return the middle of [near, far]; where far is inf the middle in dioptres, 2·near."""
    bounded = np.isfinite(far)
    return np.where(bounded, (near + np.where(bounded, far, near)) / 2, 2 * near)


def settable(
    lenses: tuple[Lens, ...], cameras: NDArray[np.integer[Any]], distances: FloatArray
) -> FloatArray:
    """Return the focus distances, each moved to the nearest that its camera's lens takes.

    The middle of a cell does not leave it: the cell's ends can be set.
    """
    moved = np.empty_like(distances)
    for lens, part in _by_lens(lenses, cameras):
        moved[part] = nearest_settable(distances[part], lens)
    return moved


def _by_lens(
    lenses: tuple[Lens, ...], cameras: NDArray[np.integer[Any]]
) -> Iterator[tuple[Lens, NDArray[np.int64] | slice]]:
    """Yield every kind of lens, and which of the cameras, given by index, have it."""
    kinds = {lens: kind for kind, lens in enumerate(dict.fromkeys(lenses))}
    if len(kinds) == 1:
        yield lenses[0], slice(None)
        return
    # Sorted once, as small numbers: with a table of its own every camera is a kind.
    number = np.min_scalar_type(len(kinds))
    kind_of_each = np.array([kinds[lens] for lens in lenses], dtype=number)[cameras]
    order = np.argsort(kind_of_each, kind="stable")
    ends = np.cumsum(np.bincount(kind_of_each, minlength=len(kinds)))
    for lens, low, high in zip(kinds, [0, *ends[:-1]], ends, strict=True):
        yield lens, order[low:high]


def cost_of_units(units: int) -> float:
    """Return 1000 × the weighted mean that a total in units stands for."""
    return 1000.0 * units / UNITS


def units_of_cost(cost: float) -> int:
    """Return the total in units, rounded down, that 1000 × the weighted mean stands for."""
    return math.floor(cost / 1000.0 * UNITS)


def _units(values: FloatArray) -> Offsets:
    return np.rint(values).astype(np.int64)
