"""Numba kernels: validated arrays in, arrays out, no Python objects, no GIL.

Reductions run in a fixed order and without fast-math, so results repeat bit for bit whatever
the number of threads.
"""

from collections.abc import Iterator
from contextlib import contextmanager

from numba import config, get_num_threads, set_num_threads

from focus_planner.core.kernels.cells import cell_ranges, maximal_cells
from focus_planner.core.kernels.cost import UNSEEN, base_costs, best_cameras, focus_room
from focus_planner.core.kernels.k_view import (
    CAMERA_BITS,
    NEVER,
    improve_tuples,
    rank_cameras,
    reassign,
)
from focus_planner.core.kernels.pairs import best_pair
from focus_planner.core.kernels.stabbing import assign, stab
from focus_planner.core.kernels.tuples import colour, count_common, count_shared, list_shared
from focus_planner.core.kernels.visibility import by_sample, count_in_view, list_in_view

# Numba's own default layer aborts the process when two threads enter parallel kernels at once.
config.THREADING_LAYER = "omp"

__all__ = [
    "CAMERA_BITS",
    "NEVER",
    "UNSEEN",
    "assign",
    "base_costs",
    "best_cameras",
    "best_pair",
    "by_sample",
    "cell_ranges",
    "colour",
    "count_common",
    "count_in_view",
    "count_shared",
    "focus_room",
    "improve_tuples",
    "list_in_view",
    "list_shared",
    "maximal_cells",
    "rank_cameras",
    "reassign",
    "stab",
    "threads_for",
]


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


_PARALLEL_PAIRS = 200_000
