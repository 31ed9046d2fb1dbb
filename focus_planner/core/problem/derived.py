# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What is derived of a problem, kept with it while it is planned on again and again."""

from __future__ import annotations

import os
from collections.abc import Callable, Hashable
from dataclasses import is_dataclass
from threading import RLock
from typing import Any, TypeVar
from weakref import WeakKeyDictionary

import numpy as np

from focus_planner.core.problem.problem import Problem
from focus_planner.core.rig.lens import Lens

Found = TypeVar("Found")


class _Derived:
    """What is kept of a problem; found by one thread while others that ask wait for it."""

    def __init__(self) -> None:
        self.found: dict[Hashable, Any] = {}
        self.unlock()

    def unlock(self) -> None:
        self.lock = RLock()


# A problem of one plan alone keeps nothing: what its solver has done with is given back.
_derived: WeakKeyDictionary[Problem, _Derived] = WeakKeyDictionary()


def keep_derived(problem: Problem) -> None:
    """Have what is derived of a problem from now on kept for as long as the problem."""
    _derived.setdefault(problem, _Derived())


def derived(problem: Problem, key: Hashable, find: Callable[[], Found]) -> Found:
    """Return what was found under a key, or find it, and keep it if the problem keeps such."""
    kept = _derived.get(problem)
    if kept is None:
        return find()
    with kept.lock:
        if key not in kept.found:
            kept.found[key] = find()
        found: Found = kept.found[key]
    return found


def keeps_derived(problem: Problem) -> bool:
    """Return whether what is derived of a problem is kept: others may plan on it later."""
    return problem in _derived


def bytes_with_derived(problem: Problem) -> int:
    """Return the memory of a problem's arrays, and of those that are kept with it."""
    arrays: dict[int, int] = {}
    _note_arrays(problem, arrays)
    return sum(arrays.values())


def _note_arrays(value: Any, sizes: dict[int, int]) -> None:
    """Note the bytes of each array that a value holds, by the array's identity."""
    if isinstance(value, np.ndarray):
        sizes[id(value)] = value.nbytes
    elif isinstance(value, (tuple, list)):
        if not (value and isinstance(value[0], (str, Lens))):  # of which there may be thousands
            for each in value:
                _note_arrays(each, sizes)
    elif isinstance(value, dict):
        _note_arrays(list(value.values()), sizes)
    elif is_dataclass(value):
        _note_arrays(vars(value), sizes)
        if isinstance(value, Problem) and (kept := _derived.get(value)):
            _note_arrays(dict(kept.found), sizes)


def _unlock() -> None:
    """Be usable in a forked process, whatever other threads did when it was forked."""
    for kept in _derived.values():
        kept.unlock()


if hasattr(os, "register_at_fork"):  # Windows has no forks
    os.register_at_fork(after_in_child=_unlock)
