"""Numba kernels: validated arrays in, arrays out, no Python objects, no GIL.

Reductions run in a fixed order and without fast-math, so results repeat bit for bit whatever
the number of threads.
"""

from focus_planner.core.kernels.branching import confine
from focus_planner.core.kernels.cells import cell_ranges, maximal_cells
from focus_planner.core.kernels.compiling import threads_for
from focus_planner.core.kernels.cost import UNSEEN, base_costs, best_cameras, focus_room
from focus_planner.core.kernels.distortion import (
    COEFFICIENTS,
    FISHEYE,
    POLYNOMIAL,
    PROJECTION,
    bound_view,
    distort,
    keep_imaged,
)
from focus_planner.core.kernels.k_view import (
    CAMERA_BITS,
    NEVER,
    improve_tuples,
    rank_cameras,
    reassign,
)
from focus_planner.core.kernels.pairs import best_pair
from focus_planner.core.kernels.prices import (
    activate,
    count_gains,
    descend,
    gains_by_sample,
    list_gains,
    most_frequent,
    most_gains,
)
from focus_planner.core.kernels.stabbing import assign, stab
from focus_planner.core.kernels.tuples import (
    colour,
    count_common,
    count_shared,
    list_shared,
    strongest,
)
from focus_planner.core.kernels.visibility import (
    PLACES,
    block_keys,
    bound_blocks,
    by_camera,
    by_sample,
    count_near_view,
    fill_rays,
    gather,
    keep_seen,
    list_in_view,
)

__all__ = [
    "CAMERA_BITS",
    "COEFFICIENTS",
    "FISHEYE",
    "NEVER",
    "PLACES",
    "POLYNOMIAL",
    "PROJECTION",
    "UNSEEN",
    "activate",
    "assign",
    "base_costs",
    "best_cameras",
    "best_pair",
    "block_keys",
    "bound_blocks",
    "bound_view",
    "by_camera",
    "by_sample",
    "cell_ranges",
    "colour",
    "confine",
    "count_common",
    "count_gains",
    "count_near_view",
    "count_shared",
    "descend",
    "distort",
    "fill_rays",
    "focus_room",
    "gains_by_sample",
    "gather",
    "improve_tuples",
    "keep_imaged",
    "keep_seen",
    "list_gains",
    "list_in_view",
    "list_shared",
    "maximal_cells",
    "most_frequent",
    "most_gains",
    "rank_cameras",
    "reassign",
    "stab",
    "strongest",
    "threads_for",
]
