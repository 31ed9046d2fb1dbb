# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

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

from focus_planner.core.brief import brief_repr
from focus_planner.core.rig.plausible import NEAREST_FOCUS
from focus_planner.core.validation import InputError, check_array, check_finite, check_number, shown

#: No focus motor has more, and solvers consider every one for every camera.
MAX_FOCUS_STEPS = 65_536
#: The units that need no table entries: their conversion is known.
METRES, DIOPTRES = "m", "dioptres"

_Array = NDArray[np.float64]
_NEAREST, _FARTHEST = 1e-6, 1e9
# Up to here all integers are exact in double precision.
_LARGEST_VALUE = 2.0**53
# As a part of a step: by which the last one may miss the table's end, computed in doubles.
_STEP_ROUNDING = 1e-9


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
    step : float
        Distance between the values that the driver takes, counted from the table's least value (the
        least whole one if ``whole``), such as 5 for every fifth; 0 for none, or for every whole
        value. The lens can then be set only to the distances of these values.

    Raises
    ------
    InputError
        If distances and values do not form a table, or a table of whole numbers or steps contains
        none, too many, or some whose distances are indistinguishable.
    """

    unit: str
    whole: bool = False
    distances: tuple[float, ...] = ()
    values: tuple[float, ...] = ()
    step: float = 0.0

    __repr__ = brief_repr

    def __post_init__(self) -> None:
        if not isinstance(self.unit, str) or not self.unit:
            raise InputError("table.unit", "a name such as dioptres or steps", shown(self.unit))
        if not isinstance(self.whole, (bool, np.bool_)):
            raise InputError("table.whole", "true or false", shown(self.whole))
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
        self._check_step()
        if not self.distances and (self.unit not in (METRES, DIOPTRES) or self._steps):
            raise InputError("table.distances", f"at least 2 with {self._need}", "none")
        if self._steps:
            self._check_settable()

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
        """(n,) distances of the values that the driver takes, metres, ascending; None if of any.

        Without infinity: plans consist of finite distances.
        """
        if not self._steps:
            return None
        distances = np.sort(self._distances_at(self._settable_values))
        settable: _Array = distances[np.isfinite(distances)]
        settable.flags.writeable = False
        return settable

    def value_at(self, distance: float) -> float:
        """Return the device value of a focus distance: the nearest one that the driver takes.

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

        ``value_at(distance_at(value))`` is the value again; exactly so if the table has whole
        values or steps, and it is one of them.

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
    def _steps(self) -> float:
        """The distance between values that the driver takes, 0 if it takes any."""
        return self.step or float(self.whole)

    @property
    def _need(self) -> str:
        """What cannot do without entries."""
        if self.unit not in (METRES, DIOPTRES):
            return f"the unit {self.unit}"
        return "a step" if self.step else "whole values"

    @property
    def _rule(self) -> str:
        """The parameter that says which values the driver takes."""
        return "step" if self.step else "whole"

    @cached_property
    def _grid(self) -> tuple[float, int, int]:
        """The values that the driver takes: where steps count from, and the first and last."""
        low, high = self._value_limits
        first = float(math.ceil(low)) if self.whole else low
        # Of whole values every one is in its place whatever the step is counted from.
        origin = first % self._steps if self.whole else first
        least = round((first - origin) / self._steps)
        # Whole numbers are exact. A step may be tiny.
        last = (float(math.floor(high)) if self.whole else high) - origin
        rounding = 0.0 if self.whole else _STEP_ROUNDING
        return origin, least, math.floor(min(last / self._steps, _LARGEST_VALUE) + rounding)

    @property
    def _settable_values(self) -> _Array:
        _, least, greatest = self._grid
        return self._value_of_step(np.arange(least, greatest + 1.0))

    def _value_of_step(self, number: _Array) -> _Array:
        values: _Array = np.minimum(self._grid[0] + self._steps * number, self._value_limits[1])
        return values + 0.0  # no -0.0

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
        if not self._steps:
            return found
        origin, least, greatest = self._grid
        return self._value_of_step(
            np.clip(np.rint((found - origin) / self._steps), least, greatest)
        )

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
        entry = np.minimum(np.searchsorted(dioptres, found), len(dioptres) - 1)
        exact: _Array = np.where(dioptres[entry] == found, distances[entry], between)
        return exact

    def _check_step(self) -> None:
        object.__setattr__(self, "step", check_number("table.step", self.step, at_least=0.0))
        if self.whole and self.step % 1.0:
            raise InputError("table.step", "a whole number with whole values", f"{self.step:g}")

    def _check_settable(self) -> None:
        low, high = self._value_limits
        _, least, greatest = self._grid
        count, what = greatest - least + 1, "values a step apart" if self.step else "whole numbers"
        if not 0 < count <= MAX_FOCUS_STEPS:
            raise InputError(
                "table.values",
                f"1 to {MAX_FOCUS_STEPS} {what} between the first and the last",
                f"{count} from {low:g} to {high:g}",
                f"leave {self._rule} out and let the driver round" if count else "",
            )
        settable = self._settable_values
        if not np.array_equal(self._values_at(self._distances_at(settable)), settable):
            raise InputError(
                "table.values",
                f"{what} with distinguishable distances",
                f"{count} of them from {self.nearest:.17g} to {self.farthest:.17g} m",
            )
        assert self.settable_distances is not None
        if not len(self.settable_distances):
            what = "a value" if self.step else "a whole number"
            raise InputError("table.values", f"{what} at a finite distance", "none")


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
    NEAREST_FOCUS.check(f"{name} (the nearest)", float(distances.min()))
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
