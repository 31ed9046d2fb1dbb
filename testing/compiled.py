"""Kernels compiled before any test waits for them."""

from __future__ import annotations

import fcntl
import os
from pathlib import Path

from focus_planner.core import kernels
from focus_planner.core.planning.precompile import precompile


def compile_kernels() -> None:
    """Compile, or load, all that plans run.

    It takes minutes where nothing is compiled yet: no test's timeout is to contain them, and of
    several processes that begin at once one compiles, and the others load.
    """
    folder = os.open(Path(kernels.__path__[0]), os.O_RDONLY)
    try:
        fcntl.flock(folder, fcntl.LOCK_EX)
        precompile()
    finally:
        os.close(folder)
