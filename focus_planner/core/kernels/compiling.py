# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""How kernels are compiled, and what is told of it.

Programs that use this package may use Numba themselves, so nothing of Numba's settings is changed:
a kernel is a dispatcher of its own kind, which keeps machine code in folders of its own.
"""

from __future__ import annotations

import threading
import warnings
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from functools import cache
from importlib import import_module
from typing import Any

from numba import config, get_num_threads, set_num_threads, threading_layer
from numba.core.errors import NumbaWarning
from numba.core.registry import CPUDispatcher

from focus_planner.core.deferred import deferred
from focus_planner.core.kernels.indexing import KernelCompiler
from focus_planner.core.kernels.kept import KeptCode

# To learn whether there is a BLAS, Numba would import all of SciPy's linear algebra.
with deferred("scipy.linalg"):
    import_module("numba.np.arraymath")

_PARALLEL_PAIRS = 200_000
#: Numba's threading layers that several threads may enter at once.
_SAFE_LAYERS = frozenset({"omp", "tbb"})

Function = Callable[..., Any]
#: Every kernel there is.
KERNELS: list[Kernel] = []
#: Called with a kernel that is about to be compiled, and again when it has been.
Listener = Callable[["Kernel", bool], object]


def kernel(function: Function) -> Function:
    """Compile a function that runs in one thread and releases the GIL."""
    return _compiled(function, parallel=False)


def parallel_kernel(function: Function) -> Function:
    """Compile a function whose ``prange`` loops are spread over the cores."""
    return _compiled(function, parallel=True)


class Kernel(CPUDispatcher):
    """A function that is compiled, or loaded, for the types of the arguments it is called with.

    Numba's layer of threads for machines without OpenMP and TBB ends the process when two threads
    enter parallel kernels at once, so there kernels are called one after the other.
    """

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, pipeline_class=KernelCompiler, **options)

    def enable_caching(self) -> None:
        """Keep what is compiled."""
        self._cache = KeptCode(self.py_func, lambda: _tell(self, False))

    def __call__(self, *arguments: Any) -> Any:
        """Run the kernel."""
        with _turn():
            return super().__call__(*arguments)

    def compile(self, signature: Any) -> Any:
        """Compile or load the kernel, and tell the thread's listener."""
        before = len(self.overloads)
        entry = super().compile(signature)
        if len(self.overloads) > before:
            _tell(self, True)
        return entry

    def _compilation_chain_init_hook(self) -> None:
        """Look for nothing that extends Numba: compiling does, and kept code has no need of it."""

    @property
    def name(self) -> str:
        """The function's."""
        return str(self.py_func.__name__)

    @property
    def room(self) -> str:
        """The module's name within this package."""
        return str(self.py_func.__module__).rpartition(".")[2]

    @property
    def is_ready(self) -> bool:
        """Whether it has been compiled for some types, by this process or one before."""
        return bool(self.overloads) or self._cache.is_kept(self.targetctx.codegen())


def _compiled(function: Function, *, parallel: bool) -> Function:
    if config.DISABLE_JIT:
        return function
    options = {"nopython": True, "nogil": True, "parallel": parallel, "boundscheck": None}
    compiled = Kernel(function, targetoptions=options)
    compiled.enable_caching()
    KERNELS.append(compiled)
    return compiled


# --- telling -------------------------------------------------------------------------------------

_thread = threading.local()


@contextmanager
def listening(listener: Listener) -> Iterator[None]:
    """Tell of every kernel that this thread compiles, before and after, and loads, after."""
    before = getattr(_thread, "listener", None)
    _thread.listener = listener
    try:
        yield
    finally:
        _thread.listener = before


def _tell(what: Kernel, is_ready: bool) -> None:
    listener: Listener | None = getattr(_thread, "listener", None)
    if listener is not None:
        listener(what, is_ready)


# --- threads -------------------------------------------------------------------------------------

# Whoever is told that a kernel is compiled may run another.
_one_at_a_time = threading.RLock()
_any_time = nullcontext()


def _turn() -> AbstractContextManager[Any]:
    """Return what a kernel is called within."""
    return _any_time if _layer() in _SAFE_LAYERS else _one_at_a_time


@cache
def _layer() -> str:
    """Return Numba's layer of threads, which is whichever the program has set or Numba finds."""
    with warnings.catch_warnings():
        # Of layers that were found, but are too old: nobody has asked for these.
        warnings.simplefilter("ignore", NumbaWarning)
        get_num_threads()
    return str(threading_layer())


@contextmanager
def threads_for(pairs: int) -> Iterator[None]:
    """Let kernels use all cores on large problems, one on small ones.

    Threads synchronise after every batch. If another process holds a core, that costs a time slice
    of the scheduler: a hundred times as long as a small problem's batch. Results are the same.
    """
    _layer()
    before = get_num_threads()
    may_share = pairs >= _PARALLEL_PAIRS and not getattr(_thread, "beside", 0)
    set_num_threads(config.NUMBA_NUM_THREADS if may_share else 1)
    try:
        yield
    finally:
        set_num_threads(before)


@contextmanager
def one_core() -> Iterator[None]:
    """Have this thread's kernels take one core, however large problems are: others are at work.

    Such contexts may end in any order.
    """
    _thread.beside = getattr(_thread, "beside", 0) + 1
    try:
        yield
    finally:
        _thread.beside -= 1
