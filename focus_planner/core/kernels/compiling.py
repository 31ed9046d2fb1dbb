"""How kernels are compiled, and where the machine code is kept."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from numba import config, get_num_threads, njit, set_num_threads

# Numba's own default layer aborts the process when two threads enter parallel kernels at once.
config.THREADING_LAYER = "omp"
# For GNU's OpenMP, which reads it when the first parallel kernel runs. Threads that wait for the
# others sleep after some 50 µs. Longer waits hold the cores that the others need wherever there
# is other work on the machine; shorter ones would have them sleep between a plan's batches.
os.environ.setdefault("GOMP_SPINCOUNT", "1000")

_PARALLEL_PAIRS = 200_000


def _cache_folder() -> str:
    """Return a folder for the machine code of just these sources.

    Numba looks only at a kernel's own file for changes; kernels call those of other files.
    """
    here = Path(__file__).parent
    sources = b"".join(path.read_bytes() for path in sorted(here.glob("*.py")))
    kept = Path(config.CACHE_DIR) if config.CACHE_DIR else here / "__pycache__"
    return str(kept / f"kernels-{hashlib.sha256(sources).hexdigest()[:12]}")


Kernel = Callable[..., Any]
_CACHE = _cache_folder()


def kernel(function: Kernel) -> Kernel:
    """Compile a function that holds no lock and runs in one thread."""
    return _compile(function, parallel=False)


def parallel_kernel(function: Kernel) -> Kernel:
    """Compile a function whose ``prange`` loops share the cores."""
    return _compile(function, parallel=True)


def _compile(function: Kernel, *, parallel: bool) -> Kernel:
    before, config.CACHE_DIR = config.CACHE_DIR, _CACHE
    try:
        compiled: Kernel = njit(cache=True, nogil=True, parallel=parallel)(function)
    finally:
        config.CACHE_DIR = before
    return compiled


@contextmanager
def threads_for(pairs: int) -> Iterator[None]:
    """Let kernels use all cores on large problems, one on small ones.

    Threads meet at the end of every batch. Where another process holds a core that costs a time
    slice of the scheduler's, a hundred times the batch of a small problem. Results are the same.
    """
    before = get_num_threads()
    set_num_threads(config.NUMBA_NUM_THREADS if pairs >= _PARALLEL_PAIRS else 1)
    try:
        yield
    finally:
        set_num_threads(before)
