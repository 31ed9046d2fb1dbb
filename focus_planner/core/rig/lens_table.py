"""What a lens's driver wants to be told: focus distances in its own unit.

A focus ring or a voice coil moves the lens towards the subject by F² / (d − F), which is all but
linear in 1/d, as is what driver interfaces count in. So in between the entries of a table values
are linear in dioptres: few entries do, and a table may end at infinity, which is 0 dioptres.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from focus_planner.core.validation import InputError, check_array, check_finite, check_number

#: No focus motor has more; each is a candidate of every camera.
MAX_FOCUS_STEPS = 65_536
#: The units that need no table: what they are of a distance is known.
METRES, DIOPTRES = "m", "dioptres"

_Array = NDArray[np.float64]
_NEAREST, _FARTHEST = 1e-6, 1e9
# Up to here neighbouring whole numbers are different floating-point numbers.
_LARGEST = 2.0**53


@dataclass(frozen=True)
class LensTable:
    """What a lens's driver wants to be told: device values over focus distances.

    Parameters
    ----------
    unit : str
        ``"m"``, ``"dioptres"``, or the driver's own name of what it counts, such as
        ``"focus_absolute"`` (V4L2) or ``"steps"``.
    whole : bool
        Whether the driver takes whole numbers only. The lens then takes the distances of those,
        and no others.
    distances : sequence of float
        Focus distances, metres, ascending; the last may be inf. With the units ``"m"`` and
        ``"dioptres"`` there need be none: the lens then takes any distance.
    values : sequence of float
        The device values there, strictly rising or strictly falling; in between they are linear
        in dioptres.

    Raises
    ------
    InputError
        If these make no table, or a table of whole numbers has none, too many, or some that
        distances cannot tell apart.
    """

    unit: str
    whole: bool = False
    distances: tuple[float, ...] = ()
    values: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        if not isinstance(self.unit, str) or not self.unit:
            raise InputError("table.unit", "a name, such as dioptres or steps", repr(self.unit))
        if not isinstance(self.whole, (bool, np.bool_)):
            raise InputError("table.whole", "true or false", repr(self.whole))
        object.__setattr__(self, "whole", bool(self.whole))
        for name in ("distances", "values"):
            numbers = check_array(f"table.{name}", getattr(self, name), (None,))
            with np.errstate(invalid="ignore"):  # NaN is refused below
                object.__setattr__(self, name, tuple((numbers + 0.0).tolist()))  # no -0.0
        if len(self.distances) != len(self.values):
            raise InputError(
                "table.values",
                f"as many as there are distances ({len(self.distances)})",
                str(len(self.values)),
            )
        if self.distances:
            _check_distances(np.array(self.distances))
            _check_values(np.array(self.values))
        elif self.unit not in (METRES, DIOPTRES) or self.whole:
            what = "whole values" if self.unit in (METRES, DIOPTRES) else f"the unit {self.unit}"
            raise InputError("table.distances", f"at least 2, with {what}", "none")
        if self.whole:
            self._check_whole()

    @property
    def nearest(self) -> float:
        """The nearest distance that the table has, metres; 0 without entries."""
        return self.distances[0] if self.distances else 0.0

    @property
    def farthest(self) -> float:
        """The farthest distance that the table has, metres; may be inf."""
        return self.distances[-1] if self.distances else math.inf

    @cached_property
    def settable_distances(self) -> _Array | None:
        """(n,) the distances of all whole values, metres, ascending; None if others go as well.

        Infinity is not among them: plans name finite distances.
        """
        if not self.whole:
            return None
        distances = np.sort(self._distances_at(self._whole_values))
        settable: _Array = distances[np.isfinite(distances)]
        settable.flags.writeable = False
        return settable

    def value_at(self, distance: float) -> float:
        """Return the device value of a focus distance, the nearest whole one if it must be whole.

        Parameters
        ----------
        distance : float
            Metres, from :attr:`nearest` to :attr:`farthest`.

        Raises
        ------
        InputError
            If it is not in the table.
        """
        given = check_number("focus distance", distance, above=0, infinite=True)
        if not self.nearest <= given <= self.farthest:
            raise InputError(
                "focus distance",
                f"metres from {self.nearest:g} to {self.farthest:g}, which the lens table has",
                f"{given:g}",
            )
        return float(self._values_at(given))

    def distance_at(self, value: float) -> float:
        """Return the focus distance of a device value, metres; inf where the value is infinity's.

        ``value_at(distance_at(value))`` is the value again, if whole exactly.

        Parameters
        ----------
        value : float
            Between the table's least and greatest; need not be whole.

        Raises
        ------
        InputError
            If it is not in the table.
        """
        given = check_number(f"device value ({self.unit})", value, infinite=True)
        low, high = self._value_limits
        if not low <= given <= high or (self.unit == METRES and high == math.inf and given == 0):
            raise InputError(
                f"device value ({self.unit})",
                f"{low:g} to {high:g}, as in the lens table",
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
    def _rising(self) -> tuple[_Array, _Array, _Array]:
        """Dioptres ascending, with their distances and values."""
        distances = np.array(self.distances[::-1])
        return 1.0 / distances, distances, np.array(self.values[::-1])

    def _values_at(self, distances: ArrayLike) -> _Array:
        """Return the device values of distances that the table has."""
        if not self.distances:
            return np.asarray(distances if self.unit == METRES else np.divide(1.0, distances))
        dioptres, _, values = self._rising
        found: _Array = np.interp(np.divide(1.0, distances), dioptres, values)
        if not self.whole:
            return found
        low, high = self._value_limits
        return np.clip(np.rint(found), math.ceil(low), math.floor(high)) + 0.0  # no -0.0

    def _distances_at(self, values: ArrayLike) -> _Array:
        """Return the distances of device values that the table has."""
        with np.errstate(divide="ignore"):
            if not self.distances:
                return np.asarray(values if self.unit == METRES else np.divide(1.0, values))
            dioptres, distances, known = self._rising
            order = slice(None) if known[0] < known[-1] else slice(None, None, -1)
            found = np.interp(np.asarray(values, np.float64), known[order], dioptres[order])
            between = np.clip(np.divide(1.0, found), self.nearest, self.farthest)
        # 1 / (1 / d) need not be d, and the entries are known.
        entry = np.searchsorted(dioptres, found)
        exact: _Array = np.where(dioptres[entry] == found, distances[entry], between)
        return exact

    def _check_whole(self) -> None:
        low, high = self._value_limits
        count = math.floor(high) - math.ceil(low) + 1
        if not 0 < count <= MAX_FOCUS_STEPS:
            raise InputError(
                "table.values",
                f"1 to {MAX_FOCUS_STEPS} whole numbers from the first to the last",
                f"{count} from {low:g} to {high:g}",
                "leave whole out, and have the driver round what it is told" if count else "",
            )
        whole = self._whole_values
        if not np.array_equal(self._values_at(self._distances_at(whole)), whole):
            raise InputError(
                "table.values",
                "whole numbers that differ in distance",
                f"{count} of them from {self.nearest:.17g} to {self.farthest:.17g} m",
            )
        assert self.settable_distances is not None
        if not len(self.settable_distances):
            raise InputError("table.values", "a whole number at a finite distance", "none")


def _check_distances(distances: _Array) -> None:
    """Raise unless there are two or more, and they ascend, in dioptres too."""
    name = "table.distances"
    if len(distances) < 2:
        raise InputError(name, "at least 2", str(len(distances)))
    finite = distances[:-1] if distances[-1] == math.inf else distances
    outside = ~((finite >= _NEAREST) & (finite <= _FARTHEST))
    if outside.any():
        raise InputError(
            name,
            f"metres from {_NEAREST:g} to {_FARTHEST:g}; only the last may be inf",
            f"{finite[outside][0]:g}",
        )
    if not (np.diff(1.0 / distances) < 0).all():
        raise InputError(name, "ascending metres", _shown(distances))


def _check_values(values: _Array) -> None:
    name = "table.values"
    check_finite(name, values, "value")
    if np.abs(values).max() > _LARGEST:
        raise InputError(name, f"numbers up to {_LARGEST:g}", f"{np.abs(values).max():g}")
    steps = np.diff(values)
    if not ((steps > 0).all() or (steps < 0).all()):
        raise InputError(name, "strictly rising or strictly falling numbers", _shown(values))


def _shown(numbers: Any) -> str:
    text = ", ".join(f"{number:g}" for number in numbers)
    return text if len(text) <= 60 else text[:57] + "..."
