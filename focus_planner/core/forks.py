# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Refusing to plan in a process that Numba would end.

Where Numba's threads are those of GNU OpenMP, as on Linux, a process that is forked once they run
must not enter parallel code: Numba ends it there by a signal, and a pool of such processes waits
for ever. What can be told before is an error.
"""

from __future__ import annotations

import os
from importlib import import_module

import numba

_forked_beside_threads = False


def refuse_forked_threads() -> None:
    """Raise ``RuntimeError`` if parallel kernels cannot run here since the process was forked."""
    if _forked_beside_threads:
        raise RuntimeError(
            "this process was forked from one in which threads of GNU OpenMP ran already, those of"
            " an earlier plan or of other Numba code, and there Numba ends it: start processes with"
            " multiprocessing.get_context('spawn'), or fork before the first plan, or set"
            " NUMBA_THREADING_LAYER=workqueue before Numba is imported"
        )


def _note_fork() -> None:
    global _forked_beside_threads  # noqa: PLW0603
    _forked_beside_threads = _has_threads_of_gnu_openmp()


def _has_threads_of_gnu_openmp() -> bool:
    try:
        if numba.threading_layer() != "omp":
            return False
        # Not everywhere, and without types.
        pool = import_module("numba.np.ufunc.omppool")
    except (ValueError, ImportError):  # no threads yet
        return False
    return bool(pool.openmp_vendor == "GNU")


if hasattr(os, "register_at_fork"):  # Windows has no forks
    os.register_at_fork(after_in_child=_note_fork)
