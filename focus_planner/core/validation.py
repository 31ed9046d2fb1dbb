"""One form of error: which argument, what was expected, what came, what to do."""

from __future__ import annotations

import re
import warnings
from typing import Any

import numpy as np
from numpy.exceptions import ComplexWarning
from numpy.typing import ArrayLike, DTypeLike, NDArray

_FARTHEST = 1e8

_ROUNDING = 1e-15  # of the length of what was just normalised


_LINE_BREAK = re.compile(r"\s*[\r\n]\s*")
# Characters of what came, and of what was expected: messages bring names of any length, and an
# error is one line of a log.
_MOST_TOLD, _MOST_EXPECTED = 400, 2000


class InputError(ValueError):
    """Input that cannot be planned with; its text is fit for the person who gave it.

    Parameters
    ----------
    argument : str
        Name of what was wrong, as the user knows it (``"vertices"``, ``"rig.yaml: lens"``).
    expected, got : str
        What would have been accepted, and what came. All is made one printable line, and of what
        is long the beginning and the end are told.
    remedy : str, optional
        What to do about it, as a clause.
    """

    def __init__(self, argument: str, expected: str, got: str, remedy: str = "") -> None:
        self.argument = _brief(argument)
        self.expected = _brief(expected, _MOST_EXPECTED)
        self.got = _brief(got)
        self.remedy = remedy
        tail = f"; {remedy}" if remedy else ""
        super().__init__(f"{self.argument}: expected {self.expected}, got {self.got}{tail}")


def _brief(text: str, most: int = _MOST_TOLD) -> str:
    """Return a text as one printable line, of a long one its beginning and its end."""
    if len(text) > most:
        half = most // 2
        text = f"{text[:half]} … {text[-half:]}"
    line = _LINE_BREAK.sub(" ", text)
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in line)


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
            # NaN as a whole number is caught below; complex numbers are not cut to real ones.
            warnings.simplefilter("error", ComplexWarning)
            array = np.array(value, dtype=dtype, order="C")
    except (TypeError, ValueError, OverflowError, ComplexWarning) as error:
        raise InputError(argument, f"numbers of shape {wanted}", f"{error}") from None
    if array.dtype.kind == "i" and not np.array_equal(array, np.asarray(value)):
        raise InputError(argument, "whole numbers", "others")
    if array.ndim != len(shape) or any(
        size is not None and size != actual for size, actual in zip(shape, array.shape, strict=True)
    ):
        raise InputError(argument, f"shape {wanted}", f"shape {array.shape}")
    array.flags.writeable = False
    return array


def check_finite(argument: str, array: NDArray[np.float64], what: str, remedy: str = "") -> None:
    """Raise unless every row of ``array`` is finite; ``what`` names a row (``"vertex"``)."""
    finite = np.isfinite(array).all(axis=tuple(range(1, array.ndim)))
    if finite.all():
        return
    bad = np.flatnonzero(~finite)
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
    infinite: bool = False,
) -> float:
    """Return ``value`` as a float within the limits.

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
        raise InputError(argument, expected, repr(value))
    number = float(value)
    if (
        not (np.isfinite(number) or (infinite and number == np.inf))
        or (above is not None and number <= above)
        or (at_least is not None and number < at_least)
    ):
        raise InputError(argument, expected, f"{number:g}")
    return number


def check_whole(argument: str, value: Any, at_least: int) -> int:
    """Return ``value`` as an int of at least ``at_least``.

    Raises
    ------
    InputError
        If it is not a whole number or too small.
    """
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < at_least:
        raise InputError(argument, f"a whole number of at least {at_least}", repr(value))
    return int(value)


def check_choice(argument: str, value: str, choices: tuple[str, ...]) -> str:
    """Return ``value`` if it is one of ``choices``.

    Raises
    ------
    InputError
        If it is not.
    """
    if value not in choices:
        raise InputError(argument, "one of " + ", ".join(choices), repr(value))
    return value
