# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Numba kernels: validated arrays in, arrays out, no Python objects, no GIL.

The kernels that ``X.py`` of another room calls are in ``kernels/X.py``, so that an algorithm and
its inner loops go by one name; ``arrays`` has the tuples of arrays that several of them take,
``pairs``, ``triples`` and ``joint_costs`` the search within ``k_view``, ``odd_cycles`` that within
``odd_holes``, ``above``, ``local_prices`` and ``stabbing`` those within ``branch_and_bound`` and
``lagrangian``, ``point_grid`` and ``local_fit`` the points near a place and the surface that fits
them, ``ranks`` the places of numbers among sorted ones, ``compiling`` the decorators, ``indexing``
what indexes are compiled to, ``kept`` where machine code is kept, and ``loading`` how it gets ready
to run.

Reductions run in a fixed order and without fast-math, so results repeat bit for bit whatever
the number of threads.
"""

from focus_planner.core.kernels.arrays import (
    BlurredViews,
    CameraTuples,
    CameraViews,
    GainsByCamera,
    GainsBySample,
    PairsByCamera,
    PairsBySample,
    PricedPairs,
)
from focus_planner.core.kernels.assigned import reassign
from focus_planner.core.kernels.branch_and_bound import (
    Cuts,
    Neighbourhoods,
    Nodes,
    confine,
    gains_by_sample,
)
from focus_planner.core.kernels.branch_and_cut import confine_with_cuts
from focus_planner.core.kernels.budget import gains_of_pictures, place
from focus_planner.core.kernels.camera_tuples import (
    NEVER,
    colour,
    count_common,
    count_of_pairs,
    count_shared,
    list_both_ways,
    list_common,
    list_shared,
    strongest,
)
from focus_planner.core.kernels.cells import (
    cell_ranges,
    costs_in_units,
    maximal_cells,
    put,
    take,
)
from focus_planner.core.kernels.closest import least_depths
from focus_planner.core.kernels.compiling import KERNELS, Kernel, listening, one_core, threads_for
from focus_planner.core.kernels.cut_prices import FractionalPlan, Steps, adapt_all
from focus_planner.core.kernels.distortion import (
    COEFFICIENTS,
    FISHEYE,
    POLYNOMIAL,
    PROJECTION,
    bound_view,
    distort,
    keep_imaged,
)
from focus_planner.core.kernels.em import held_weights, stab, stab_brackets
from focus_planner.core.kernels.gains import count_gains, list_gains, most_gains
from focus_planner.core.kernels.greedy import GreedyState, first_gains, take_cameras
from focus_planner.core.kernels.k_view import (
    DescentState,
    improve_in_turn,
    improve_tuples,
    move_cameras,
)
from focus_planner.core.kernels.kept import folders, kept_in
from focus_planner.core.kernels.lagrangian import (
    PriceDescent,
    activate,
    descend,
    most_frequent,
)
from focus_planner.core.kernels.local_cuts import CutNode, CutPool, Whole
from focus_planner.core.kernels.local_fit import Averages
from focus_planner.core.kernels.noise import residuals
from focus_planner.core.kernels.odd_cycles import (
    Graph,
    TornPairs,
    graph_of,
    list_edges,
    odd_cycles,
)
from focus_planner.core.kernels.odd_holes import Room, cuts_of_cycles
from focus_planner.core.kernels.orientation import agreement, join, refine
from focus_planner.core.kernels.pairs import best_pair
from focus_planner.core.kernels.point_grid import PointGrid
from focus_planner.core.kernels.problem import (
    UNSEEN,
    UNTAKEN,
    CostTerms,
    PairCosts,
    base_costs,
    best_cameras,
    focus_intervals,
    held_in_best,
    sort_by_camera,
    sort_by_sample,
)
from focus_planner.core.kernels.ranking import NO_PICTURE, VIEW_BITS, cost_of_rankings, rank_views
from focus_planner.core.kernels.ranks import ranks_among
from focus_planner.core.kernels.rasterize import (
    AFFINE,
    BLOCK,
    TILE,
    Tiles,
    Triangles,
    bound_tiles,
    bound_triangles,
    depths,
    farthest_off_focus,
    list_by_tile,
    undistort,
)
from focus_planner.core.kernels.rays import first_hits, occluded
from focus_planner.core.kernels.shading import (
    PATTERN,
    TEXTURE,
    VERTEX_COLOURS,
    Looks,
    expose,
    light_corners,
)
from focus_planner.core.kernels.smoothing import cell_areas, project, thin
from focus_planner.core.kernels.solution import assign, focus_room
from focus_planner.core.kernels.spatial_order import Pairs, list_by_camera, move_pairs
from focus_planner.core.kernels.visibility import (
    PER_BLOCK,
    PLACES,
    Blocks,
    Views,
    ascending,
    block_keys,
    blocks_of,
    count_seen,
    fill_rays,
    gather,
    list_in_view,
    list_seen,
    near_view,
)

__all__ = [
    "AFFINE",
    "BLOCK",
    "COEFFICIENTS",
    "FISHEYE",
    "KERNELS",
    "NEVER",
    "NO_PICTURE",
    "PATTERN",
    "PER_BLOCK",
    "PLACES",
    "POLYNOMIAL",
    "PROJECTION",
    "TEXTURE",
    "TILE",
    "UNSEEN",
    "UNTAKEN",
    "VERTEX_COLOURS",
    "VIEW_BITS",
    "Averages",
    "Blocks",
    "BlurredViews",
    "CameraTuples",
    "CameraViews",
    "CostTerms",
    "CutNode",
    "CutPool",
    "Cuts",
    "DescentState",
    "FractionalPlan",
    "GainsByCamera",
    "GainsBySample",
    "Graph",
    "GreedyState",
    "Kernel",
    "Looks",
    "Neighbourhoods",
    "Nodes",
    "PairCosts",
    "Pairs",
    "PairsByCamera",
    "PairsBySample",
    "PointGrid",
    "PriceDescent",
    "PricedPairs",
    "Room",
    "Steps",
    "Tiles",
    "TornPairs",
    "Triangles",
    "Views",
    "Whole",
    "activate",
    "adapt_all",
    "agreement",
    "ascending",
    "assign",
    "base_costs",
    "best_cameras",
    "best_pair",
    "block_keys",
    "blocks_of",
    "bound_tiles",
    "bound_triangles",
    "bound_view",
    "cell_areas",
    "cell_ranges",
    "colour",
    "confine",
    "confine_with_cuts",
    "cost_of_rankings",
    "costs_in_units",
    "count_common",
    "count_gains",
    "count_of_pairs",
    "count_seen",
    "count_shared",
    "cuts_of_cycles",
    "depths",
    "descend",
    "distort",
    "expose",
    "farthest_off_focus",
    "fill_rays",
    "first_gains",
    "first_hits",
    "focus_intervals",
    "focus_room",
    "folders",
    "gains_by_sample",
    "gains_of_pictures",
    "gather",
    "graph_of",
    "held_in_best",
    "held_weights",
    "improve_in_turn",
    "improve_tuples",
    "join",
    "keep_imaged",
    "kept_in",
    "least_depths",
    "light_corners",
    "list_both_ways",
    "list_by_camera",
    "list_by_tile",
    "list_common",
    "list_edges",
    "list_gains",
    "list_in_view",
    "list_seen",
    "list_shared",
    "listening",
    "maximal_cells",
    "most_frequent",
    "most_gains",
    "move_cameras",
    "move_pairs",
    "near_view",
    "occluded",
    "odd_cycles",
    "one_core",
    "place",
    "project",
    "put",
    "rank_views",
    "ranks_among",
    "reassign",
    "refine",
    "residuals",
    "sort_by_camera",
    "sort_by_sample",
    "stab",
    "stab_brackets",
    "strongest",
    "take",
    "take_cameras",
    "thin",
    "threads_for",
    "undistort",
]
