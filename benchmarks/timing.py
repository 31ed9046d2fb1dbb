# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

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


def processed(function: Callable[[], _Result]) -> tuple[float, _Result]:
    """Return the seconds that a call takes of processors, and its result.

    On a machine that others share it tells more than how long that took.
    """
    start = time.process_time()
    result = function()
    return time.process_time() - start, result


def seconds(function: Callable[[], object], repeats: int) -> float:
    """Return the median duration of a call, seconds, after an untimed one."""
    function()
    return float(np.median([timed(function)[0] for _ in range(repeats)]))
