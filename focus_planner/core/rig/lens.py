"""What a lens can be set to."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from focus_planner.core.arrays import FloatArray
from focus_planner.core.rig.lens_table import MAX_FOCUS_STEPS, LensTable
from focus_planner.core.validation import (
    InputError,
    check_number,
    check_whole,
)

_FARTHEST_FOCUS = 1e12


@dataclass(frozen=True)
class Lens:
    """A thin lens with a shallow depth of field.

    Parameters
    ----------
    focal_length : float
        F, metres.
    hyperfocal_distance : float
        H = F² / (f-number · circle of confusion), metres, as in the paper's D_N and D_F
        (Sec. 4.2); texts that add F to it mean the same lens.
    min_focus, max_focus : float
        The distances that the lens can be set to, metres; 0 and inf for no limit.
    focus_distances : sequence of float, optional
        The only distances that the lens can be set to, metres, within the limits; made ascending
        and unique here.
    focus_steps : int, optional
        Instead of ``focus_distances``: how many positions the lens has between its limits,
        equally spaced in dioptres, both limits included. The position at infinity, of a lens
        without ``max_focus``, counts but is never planned: plans name finite distances.
    table : LensTable, optional
        What the lens's driver wants to be told. Its distances limit the lens too; a table of
        whole values is a list of distances itself, instead of the other two.

    Raises
    ------
    InputError
        If a value is out of range, the limits leave no distance, or two of distances, steps and a
        table of whole values are given.
    """

    focal_length: float = 0.050
    hyperfocal_distance: float = 10.0
    min_focus: float = 0.0
    max_focus: float = math.inf
    focus_distances: tuple[float, ...] | None = None
    focus_steps: int | None = None
    table: LensTable | None = None

    def __post_init__(self) -> None:
        check_number("lens.focal_length", self.focal_length, above=0)
        check_number("lens.hyperfocal_distance", self.hyperfocal_distance, above=self.focal_length)
        check_number("lens.min_focus", self.min_focus, at_least=0)
        for name in ("focal_length", "hyperfocal_distance", "min_focus"):
            _check_optical_reach(f"lens.{name}", getattr(self, name))
        check_number("lens.max_focus", self.max_focus, above=self.focal_length, infinite=True)
        if self.min_focus > self.max_focus:
            raise InputError(
                "lens.min_focus",
                f"at most max_focus ({self.max_focus:g} m)",
                f"{self.min_focus:g} m",
            )
        if self.table is not None:
            _check_table(self, self.table)
        if self.focus_distances is not None:
            object.__setattr__(self, "focus_distances", _listed_distances(self))
        if self.focus_steps is not None:
            _check_steps(self)

    @property
    def focus_limits(self) -> tuple[float, float]:
        """The nearest and farthest distance that limits and table leave, metres."""
        if self.table is None:
            return self.min_focus, self.max_focus
        return max(self.min_focus, self.table.nearest), min(self.max_focus, self.table.farthest)

    @cached_property
    def settable_distances(self) -> FloatArray | None:
        """(n,) all distances that the lens can be set to, metres, ascending; None for a range."""
        if self.focus_steps is not None:
            settable = _steps(*self.focus_limits, self.focus_steps)
        elif self.focus_distances is not None:
            settable = np.array(self.focus_distances)
        elif self.table is not None and self.table.settable_distances is not None:
            settable = _within(self.table.settable_distances, self)
        else:
            return None
        settable.flags.writeable = False
        return settable


def _check_optical_reach(argument: str, metres: float) -> None:
    """Raise if a lens's products with other distances would overflow."""
    if metres > _FARTHEST_FOCUS:
        raise InputError(argument, f"metres up to {_FARTHEST_FOCUS:g}", f"{metres:g}")


def _steps(nearest: float, farthest: float, count: int) -> FloatArray:
    """Return the finite ones of so many distances, equally spaced in dioptres."""
    dioptres = np.linspace(1 / nearest, 1 / farthest, count)
    finite = 1 / dioptres[dioptres > 0]
    # 1 / (1 / x) need not be x, and the limits are positions themselves.
    finite[0] = nearest
    if dioptres[-1] > 0:
        finite[-1] = farthest
    return np.unique(np.clip(finite, nearest, farthest))


def _within(distances: FloatArray, lens: Lens) -> FloatArray:
    """Return those distances that the lens's limits leave."""
    nearest, farthest = lens.focus_limits
    left = (distances >= nearest) & (distances <= farthest) & (distances > lens.focal_length)
    some: FloatArray = distances[left]
    return some


def _check_table(lens: Lens, table: LensTable) -> None:
    """Raise if a lens's table contradicts what else is said of it."""
    if not isinstance(table, LensTable):
        raise InputError("lens.table", "a LensTable", repr(table))
    settable = table.settable_distances
    listed = lens.focus_distances is not None or lens.focus_steps is not None
    if settable is not None and listed:
        raise InputError(
            "lens.table",
            "a table of whole values, focus_distances or focus_steps",
            "two of them",
            "a table of whole values says itself what the lens can be set to",
        )
    nearest, farthest = lens.focus_limits
    if nearest > farthest or farthest <= lens.focal_length:
        has = f"{table.nearest:g} to {table.farthest:g} m"
    elif settable is not None and not len(_within(settable, lens)):
        has = f"none of {len(settable)} whole values there"
    else:
        return
    raise InputError(
        "lens.table",
        f"distances from min_focus ({lens.min_focus:g} m) to max_focus ({lens.max_focus:g} m),"
        f" above focal_length ({lens.focal_length:g} m)",
        has,
    )


def _listed_distances(lens: Lens) -> tuple[float, ...]:
    """Return a lens's list of distances, ascending and unique; raise if it is none."""
    name, given = "lens.focus_distances", lens.focus_distances
    if isinstance(given, (str, bytes)) or not isinstance(given, Iterable):
        raise InputError(name, "a list of distances in metres", repr(given))
    listed = sorted(
        {
            check_number(f"{name}[{i}]", distance, above=lens.focal_length)
            for i, distance in enumerate(given)
        }
    )
    if not 0 < len(listed) <= MAX_FOCUS_STEPS:
        raise InputError(
            name,
            f"1 to {MAX_FOCUS_STEPS} distances",
            str(len(listed)),
            "leave it out for a lens that takes every distance between its limits",
        )
    _check_optical_reach(name, listed[0])
    nearest, farthest = lens.focus_limits
    if not nearest <= listed[0] <= listed[-1] <= farthest:
        raise InputError(
            name,
            f"distances from min_focus ({nearest:g} m) to max_focus ({farthest:g} m)"
            + (", as the lens's table leaves them" if lens.table else ""),
            f"{listed[0]:g} to {listed[-1]:g} m",
        )
    return tuple(listed)


def _check_steps(lens: Lens) -> None:
    name, steps = "lens.focus_steps", lens.focus_steps
    if lens.focus_distances is not None:
        raise InputError(name, "focus_distances or focus_steps", "both")
    if check_whole(name, steps, 2) > MAX_FOCUS_STEPS:
        raise InputError(name, f"at most {MAX_FOCUS_STEPS}", str(steps))
    if lens.focus_limits[0] <= lens.focal_length:
        raise InputError(
            "lens.min_focus",
            f"a number above focal_length ({lens.focal_length:g} m), with focus_steps",
            f"{lens.focus_limits[0]:g}",
            "the steps are counted from the nearest distance that the lens can be set to",
        )
