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
# GNU's OpenMP reads this when the first parallel kernel runs: idle threads spin for some 50 µs,
# then sleep. Spinning longer takes cores from other work on the machine; with less, threads would
# sleep between the batches of a plan.
os.environ.setdefault("GOMP_SPINCOUNT", "1000")

_PARALLEL_PAIRS = 200_000


def _cache_folder() -> str:
    """Return a folder for the machine code of exactly these sources.

    Numba checks only a kernel's own file for changes, but kernels call those of other files.
    """
    here = Path(__file__).parent
    sources = b"".join(path.read_bytes() for path in sorted(here.glob("*.py")))
    kept = Path(config.CACHE_DIR) if config.CACHE_DIR else here / "__pycache__"
    return str(kept / f"kernels-{hashlib.sha256(sources).hexdigest()[:12]}")


Kernel = Callable[..., Any]
_CACHE = _cache_folder()


def kernel(function: Kernel) -> Kernel:
    """Compile a function that runs in one thread and releases the GIL."""
    return _compile(function, parallel=False)


def parallel_kernel(function: Kernel) -> Kernel:
    """Compile a function whose ``prange`` loops are spread over the cores."""
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

    Threads synchronise after every batch. If another process holds a core, that costs a time slice
    of the scheduler: a hundred times as long as a small problem's batch. Results are the same.
    """
    before = get_num_threads()
    set_num_threads(config.NUMBA_NUM_THREADS if pairs >= _PARALLEL_PAIRS else 1)
    try:
        yield
    finally:
        set_num_threads(before)
