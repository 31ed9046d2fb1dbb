# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Input validation, and the one form of its errors: argument, expected, got, remedy."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.exceptions import ComplexWarning
from numpy.typing import ArrayLike, DTypeLike, NDArray

from focus_planner.core.text import MAX_REASON, did_you_mean, printable

#: Metres. Larger coordinates are mistakes, and products of them may overflow.
MAX_COORDINATE = 1e8

#: Frames above a frame.
MAX_FRAME_DEPTH = 100

#: How far from 1 rounding leaves the length of a vector that was just normalised.
UNIT_ROUNDING = 1e-15

# Longest text, in characters: messages may contain names of any length, and an error is one line
# of a log.
_MAX_EXPECTED = 2000
_MAX_BITS = 400  # of a whole number in an error: 120 digits


class InputError(ValueError):
    """Invalid input, reported in the terms of the user who supplied it.

    Parameters
    ----------
    argument : str
        The user's name for the value that is wrong (``"vertices"``, ``"rig.yaml: lens"``).
    expected, got : str
        What would have been accepted, and what was given. Each becomes a single printable line;
        long texts are shortened in the middle.
    remedy : str, optional
        What to do about it, as a clause; printable likewise.
    """

    def __init__(self, argument: str, expected: str, got: str, remedy: str = "") -> None:
        self.argument = printable(argument, MAX_REASON)
        self.expected = printable(expected, _MAX_EXPECTED)
        self.got = printable(got, MAX_REASON)
        self.remedy = printable(remedy, _MAX_EXPECTED)
        tail = f"; {self.remedy}" if remedy else ""
        super().__init__(f"{self.argument}: expected {self.expected}, got {self.got}{tail}")


def check_array(
    argument: str,
    value: ArrayLike,
    shape: tuple[int | None, ...],
    dtype: DTypeLike = np.float64,
) -> NDArray[Any]:
    """Return ``value`` as a contiguous read-only array of ``shape`` (``None``: any length).

    Raises
    ------
    InputError
        If the value is not numeric or has another shape.
    """
    wanted = "(" + ", ".join("n" if size is None else str(size) for size in shape) + ")"
    try:
        with np.errstate(invalid="ignore"), warnings.catch_warnings():
            # NaN among integers is caught below; complex numbers must not be truncated silently.
            warnings.simplefilter("error", ComplexWarning)
            array = np.array(value, dtype=dtype, order="C")
    except (TypeError, ValueError, OverflowError, ComplexWarning):
        # Without the text that is no number.
        raise InputError(argument, f"numbers of shape {wanted}", "something else") from None
    if array.dtype.kind in "iu" and not np.array_equal(array, np.asarray(value)):
        raise InputError(argument, "whole numbers", "others")
    if array.ndim != len(shape) or any(
        size is not None and size != actual for size, actual in zip(shape, array.shape, strict=True)
    ):
        raise InputError(argument, f"shape {wanted}", f"shape {array.shape}")
    array.flags.writeable = False
    return array


def check_finite(
    argument: str, array: NDArray[np.floating[Any]], what: str, remedy: str = ""
) -> None:
    """Raise unless every row of ``array`` is finite; ``what`` names a row (``"vertex"``)."""
    finite = np.isfinite(array)
    if finite.all():
        return
    bad = np.flatnonzero(~finite.all(axis=tuple(range(1, array.ndim))))
    raise InputError(
        argument,
        "finite numbers",
        f"NaN or infinity in {len(bad)} of {len(array)} (first: {what} {bad[0]})",
        remedy,
    )


def check_number(
    argument: str,
    value: Any,
    *,
    above: float | None = None,
    at_least: float | None = None,
    at_most: float = math.inf,
    infinite: bool = False,
) -> float:
    """Return ``value`` as a float within the limits; ``infinite`` also lets infinity through.

    Raises
    ------
    InputError
        If it is not a number, not finite (unless ``infinite``) or out of range.
    """
    expected = "a number"
    if above is not None:
        expected += f" above {above:g}"
    if at_least is not None:
        expected += f" of at least {at_least:g}"
    if isinstance(value, bool) or not isinstance(value, (int, float, np.integer, np.floating)):
        raise InputError(argument, expected, shown(value))
    try:
        number = float(value)
    except OverflowError:
        raise InputError(argument, f"{expected}, up to 1e308", shown(value)) from None
    if at_most < number < math.inf:
        raise InputError(argument, f"{expected}, at most {at_most:g}", f"{number:g}")
    if (
        not (np.isfinite(number) or (infinite and number == np.inf))
        or (above is not None and number <= above)
        or (at_least is not None and number < at_least)
    ):
        raise InputError(argument, expected, f"{number:g}")
    return number


def check_whole(argument: str, value: Any, at_least: int, at_most: float = math.inf) -> int:
    """Return ``value`` as an int from ``at_least`` to ``at_most``.

    Raises
    ------
    InputError
        If it is not a whole number, too small or too large.
    """
    expected = f"a whole number of at least {at_least}"
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < at_least:
        raise InputError(argument, expected, shown(value))
    if value > at_most:
        raise InputError(argument, f"{expected}, at most {at_most}", shown(value))
    return int(value)


def shown(value: Any) -> str:
    """Return a value for an error; long whole numbers, which ``repr`` refuses, by their length."""
    if isinstance(value, int) and value.bit_length() > _MAX_BITS:
        return f"a whole number of {value.bit_length():,} bits"
    return repr(value)


def check_choice(argument: str, value: str, choices: tuple[str, ...]) -> str:
    """Return ``value`` if it is one of ``choices``.

    Raises
    ------
    InputError
        If it is not; names the one that was probably meant.
    """
    if value not in choices:
        remedy = did_you_mean(value, choices) if isinstance(value, str) else ""
        raise InputError(argument, "one of " + ", ".join(choices), shown(value), remedy)
    return value


def first_few(names: Iterable[str], most: int = 6) -> str:
    """Return the first names as text, and how many more there are."""
    listed = list(names)
    more = f" and {len(listed) - most} more" if len(listed) > most else ""
    return ", ".join(listed[:most]) + more
