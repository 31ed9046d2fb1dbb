"""Timing of function calls."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TypeVar

import numpy as np

_Result = TypeVar("_Result")


def timed(function: Callable[[], _Result]) -> tuple[float, _Result]:
    """Return a call's duration in seconds, and its result."""
    start = time.perf_counter()
    result = function()
    return time.perf_counter() - start, result


def seconds(function: Callable[[], object], repeats: int) -> float:
    """Return the median duration of a call, seconds, after an untimed one."""
    function()
    return float(np.median([timed(function)[0] for _ in range(repeats)]))
