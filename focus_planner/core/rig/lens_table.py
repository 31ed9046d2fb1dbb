"""Conversion between focus distances and the values that a lens's driver takes.

To focus at distance d, a focus ring or voice coil moves the lens towards the subject by
F² / (d − F), which is nearly linear in 1/d; so are the values of common driver interfaces.
Between the entries of a table values are therefore interpolated linearly in dioptres: a few
entries suffice, and a table may end at infinity, which is 0 dioptres.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from focus_planner.core.validation import InputError, check_array, check_finite, check_number

#: No focus motor has more, and solvers consider every one for every camera.
MAX_FOCUS_STEPS = 65_536
#: The units that need no table entries: their conversion is known.
METRES, DIOPTRES = "m", "dioptres"

_Array = NDArray[np.float64]
_NEAREST, _FARTHEST = 1e-6, 1e9
# Up to here all integers are exact in double precision.
_LARGEST_VALUE = 2.0**53


@dataclass(frozen=True)
class LensTable:
    """Device values as a function of focus distance.

    Parameters
    ----------
    unit : str
        ``"m"``, ``"dioptres"``, or the driver's own name for its unit, such as
        ``"focus_absolute"`` (V4L2) or ``"steps"``.
    whole : bool
        Whether the driver takes whole numbers only. The lens can then be set only to the
        distances of whole numbers.
    distances : sequence of float
        Focus distances, metres, ascending; the last may be inf. May be empty with the units
        ``"m"`` and ``"dioptres"``: the lens then takes any distance.
    values : sequence of float
        The device values at these distances, strictly rising or strictly falling; interpolated
        linearly in dioptres.

    Raises
    ------
    InputError
        If distances and values do not form a table, or a table of whole numbers contains none,
        too many, or some whose distances are indistinguishable.
    """

    unit: str
    whole: bool = False
    distances: tuple[float, ...] = ()
    values: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        if not isinstance(self.unit, str) or not self.unit:
            raise InputError("table.unit", "a name such as dioptres or steps", repr(self.unit))
        if not isinstance(self.whole, (bool, np.bool_)):
            raise InputError("table.whole", "true or false", repr(self.whole))
        object.__setattr__(self, "whole", bool(self.whole))
        for name in ("distances", "values"):
            numbers = check_array(f"table.{name}", getattr(self, name), (None,))
            with np.errstate(invalid="ignore"):  # NaN is rejected below
                object.__setattr__(self, name, tuple((numbers + 0.0).tolist()))  # no -0.0
        if len(self.distances) != len(self.values):
            raise InputError(
                "table.values",
                f"as many as table.distances ({len(self.distances)})",
                str(len(self.values)),
            )
        if self.distances:
            _check_distances(np.array(self.distances))
            _check_values(np.array(self.values))
        elif self.unit not in (METRES, DIOPTRES) or self.whole:
            what = "whole values" if self.unit in (METRES, DIOPTRES) else f"the unit {self.unit}"
            raise InputError("table.distances", f"at least 2 with {what}", "none")
        if self.whole:
            self._check_whole()

    @property
    def nearest(self) -> float:
        """The table's nearest distance, metres; 0 without entries."""
        return self.distances[0] if self.distances else 0.0

    @property
    def farthest(self) -> float:
        """The table's farthest distance, metres; may be inf."""
        return self.distances[-1] if self.distances else math.inf

    @cached_property
    def settable_distances(self) -> _Array | None:
        """(n,) the distances of all whole values, metres, ascending; None if any value will do.

        Without infinity: plans consist of finite distances.
        """
        if not self.whole:
            return None
        distances = np.sort(self._distances_at(self._whole_values))
        settable: _Array = distances[np.isfinite(distances)]
        settable.flags.writeable = False
        return settable

    def value_at(self, distance: float) -> float:
        """Return the device value of a focus distance, rounded if it must be whole.

        Parameters
        ----------
        distance : float
            Metres, from :attr:`nearest` to :attr:`farthest`.

        Raises
        ------
        InputError
            If it is outside the table.
        """
        given = check_number("focus distance", distance, above=0, infinite=True)
        if not self.nearest <= given <= self.farthest:
            raise InputError(
                "focus distance",
                f"{self.nearest:g} to {self.farthest:g} m, the range of the lens table",
                f"{given:g}",
            )
        return float(self._values_at(given))

    def distance_at(self, value: float) -> float:
        """Return the focus distance of a device value, metres; may be inf.

        ``value_at(distance_at(value))`` is the value again; exactly so if it is whole.

        Parameters
        ----------
        value : float
            Between the table's least and greatest value; need not be whole.

        Raises
        ------
        InputError
            If it is outside the table.
        """
        given = check_number(f"device value ({self.unit})", value, infinite=True)
        low, high = self._value_limits
        if not low <= given <= high or (self.unit == METRES and high == math.inf and given == 0):
            raise InputError(
                f"device value ({self.unit})",
                f"{low:g} to {high:g}, the range of the lens table",
                f"{given:g}",
            )
        return float(self._distances_at(given))

    @property
    def _value_limits(self) -> tuple[float, float]:
        return (min(self.values), max(self.values)) if self.values else (0.0, math.inf)

    @property
    def _whole_values(self) -> _Array:
        low, high = self._value_limits
        return np.arange(math.ceil(low), math.floor(high) + 1.0)

    @cached_property
    def _by_dioptres(self) -> tuple[_Array, _Array, _Array]:
        """The entries by ascending dioptres: dioptres, distances, values."""
        distances = np.array(self.distances[::-1])
        return 1.0 / distances, distances, np.array(self.values[::-1])

    def _values_at(self, distances: ArrayLike) -> _Array:
        """Return the device values of distances within the table."""
        if not self.distances:
            return np.asarray(distances if self.unit == METRES else np.divide(1.0, distances))
        dioptres, _, values = self._by_dioptres
        found: _Array = np.interp(np.divide(1.0, distances), dioptres, values)
        if not self.whole:
            return found
        low, high = self._value_limits
        return np.clip(np.rint(found), math.ceil(low), math.floor(high)) + 0.0  # no -0.0

    def _distances_at(self, values: ArrayLike) -> _Array:
        """Return the distances of device values within the table."""
        with np.errstate(divide="ignore"):
            if not self.distances:
                return np.asarray(values if self.unit == METRES else np.divide(1.0, values))
            dioptres, distances, known = self._by_dioptres
            order = slice(None) if known[0] < known[-1] else slice(None, None, -1)
            found = np.interp(np.asarray(values, np.float64), known[order], dioptres[order])
            between = np.clip(np.divide(1.0, found), self.nearest, self.farthest)
        # Entries are returned as given: 1 / (1 / d) need not be d.
        entry = np.searchsorted(dioptres, found)
        exact: _Array = np.where(dioptres[entry] == found, distances[entry], between)
        return exact

    def _check_whole(self) -> None:
        low, high = self._value_limits
        count = math.floor(high) - math.ceil(low) + 1
        if not 0 < count <= MAX_FOCUS_STEPS:
            raise InputError(
                "table.values",
                f"1 to {MAX_FOCUS_STEPS} whole numbers between the first and the last",
                f"{count} from {low:g} to {high:g}",
                "leave whole out and let the driver round" if count else "",
            )
        whole = self._whole_values
        if not np.array_equal(self._values_at(self._distances_at(whole)), whole):
            raise InputError(
                "table.values",
                "whole numbers with distinguishable distances",
                f"{count} of them from {self.nearest:.17g} to {self.farthest:.17g} m",
            )
        assert self.settable_distances is not None
        if not len(self.settable_distances):
            raise InputError("table.values", "a whole number at a finite distance", "none")


def _check_distances(distances: _Array) -> None:
    """Raise unless there are at least two, ascending, in dioptres too."""
    name = "table.distances"
    if len(distances) < 2:
        raise InputError(name, "at least 2", str(len(distances)))
    finite = distances[:-1] if distances[-1] == math.inf else distances
    outside = ~((finite >= _NEAREST) & (finite <= _FARTHEST))
    if outside.any():
        raise InputError(
            name,
            f"{_NEAREST:g} to {_FARTHEST:g} m; only the last may be inf",
            f"{finite[outside][0]:g}",
        )
    if not (np.diff(1.0 / distances) < 0).all():
        raise InputError(name, "ascending metres", _abbreviated(distances))


def _check_values(values: _Array) -> None:
    name = "table.values"
    check_finite(name, values, "value")
    if np.abs(values).max() > _LARGEST_VALUE:
        raise InputError(name, f"numbers up to {_LARGEST_VALUE:g}", f"{np.abs(values).max():g}")
    steps = np.diff(values)
    if not ((steps > 0).all() or (steps < 0).all()):
        raise InputError(name, "strictly rising or strictly falling numbers", _abbreviated(values))


def _abbreviated(numbers: Any) -> str:
    text = ", ".join(f"{number:g}" for number in numbers)
    return text if len(text) <= 60 else text[:57] + "..."
