"""How far points lie from the surface that is fitted to their neighbours."""

from __future__ import annotations

import numpy as np
from numba import prange

from focus_planner.core.kernels.compiling import parallel_kernel
from focus_planner.core.kernels.local_fit import COUNT, FITTED, RESIDUAL, fit
from focus_planner.core.kernels.point_grid import RUNS


@parallel_kernel
def residuals(grid, averages, places, radius, few):
    """Return (n, 2) the residual around each place, and the number of points; NaN where few.

    The first fit moves a place, which is off the surface itself, onto it; the second counts.
    """
    found = np.full((len(places), 2), np.nan)
    for p in prange(len(places)):
        fitted, work, facing = np.zeros(FITTED), np.empty((RUNS, 2), dtype=np.int64), np.zeros(3)
        at = places[p].copy()
        for _ in range(2):
            fit(grid, averages, at, facing, radius, False, True, few, work, fitted)
            if fitted[COUNT] < few:
                break
            at[:] = fitted[:3]
        if fitted[COUNT] >= few:
            found[p, 0], found[p, 1] = fitted[RESIDUAL], fitted[COUNT]
    return found
