# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Kinds of work, each of which can be done once on little: that compiles the kernels that it runs.

Kernels are compiled for the types of their arguments, and those depend on what is done.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np

from focus_planner.core.arrays import FloatArray
from focus_planner.core.bounds.branch_and_bound import Branching
from focus_planner.core.bounds.branch_and_cut import BranchingWithCuts
from focus_planner.core.bounds.cut_prices import CutPrices
from focus_planner.core.bounds.lagrangian import Prices
from focus_planner.core.imaging.exposure import PictureCamera
from focus_planner.core.planning.formulation import formulate_problem
from focus_planner.core.planning.request import SCOPES, TUPLES, PlanRequest
from focus_planner.core.planning.solving import solve
from focus_planner.core.problem.gains import gains_of
from focus_planner.core.problem.spatial_order import sort_by_place
from focus_planner.core.rig.camera import CameraIntrinsics
from focus_planner.core.rig.geometry import image_corners
from focus_planner.core.rig.layouts import cylinder_rig
from focus_planner.core.rig.rig import Rig
from focus_planner.core.solvers import Options
from focus_planner.core.solvers.k_view import Descent
from focus_planner.core.solvers.kicks import Kicks
from focus_planner.core.surface.scene import Scene
from focus_planner.core.surface.surface import Mesh, PointCloud

_SAMPLES = 200
_IMAGES = 4
_SMALL = 64  # pixels
_MERIDIANS, _PARALLELS = 24, 12
# On the ball they are 8 mm apart, and scatter by as much.
_SCATTERED_POINTS, _SCATTER = 8_000, 0.008

#: About how many seconds the kernels of a module take to compile, without those of others that they
#: call: the time of one core of a cloud server. "focus_planner warm-up --modules" measures them.
SECONDS = {
    "above": 2.0,
    "assigned": 3.0,
    "branch_and_bound": 13.0,
    "branch_and_cut": 20.0,
    "budget": 4.0,
    "camera_tuples": 7.0,
    "cells": 3.5,
    "closest": 0.5,
    "cut_prices": 15.0,
    "distortion": 2.5,
    "em": 2.0,
    "gains": 5.5,
    "greedy": 5.0,
    "joint_costs": 0.5,
    "k_view": 21.0,
    "lagrangian": 14.0,
    "local_cuts": 6.0,
    "local_fit": 7.5,
    "local_prices": 9.0,
    "noise": 5.0,
    "odd_cycles": 4.0,
    "odd_holes": 7.0,
    "orientation": 10.0,
    "pairs": 6.5,
    "point_grid": 1.0,
    "problem": 2.5,
    "ranking": 3.0,
    "ranks": 1.5,
    "rasterize": 14.0,
    "rays": 2.0,
    "shading": 25.0,
    "smoothing": 10.0,
    "solution": 2.0,
    "spatial_order": 3.0,
    "stabbing": 5.5,
    "triples": 3.0,
    "visibility": 12.0,
}


@dataclass(frozen=True)
class Work:
    """A kind of work.

    Attributes
    ----------
    modules : frozenset of str
        Those of its kernels.
    do : callable
        Does it once, on little.
    after : tuple of Work
        Whose kernels it calls besides: what these run is taken for compiled.
    """

    modules: frozenset[str]
    do: Callable[[], None]
    after: tuple[Work, ...] = ()

    @property
    def seconds(self) -> float:
        """About how long its kernels take to compile, on one core of a cloud server."""
        return sum(SECONDS[module] for module in self.modules)


def _plan() -> None:
    rig, ball = _rig(), _ball()
    image_corners(rig.cameras[0], 1.0)
    smooth = Mesh(ball.vertices, ball.triangles, ball.vertices)
    # What may be stopped finds in parts what cameras see, and puts these together.
    solve(Scene(smooth), rig, PlanRequest("closest", _SAMPLES), on_progress=lambda _: True)
    for method in ("closest", "average", "em"):
        solve(Scene(ball), rig, PlanRequest(method, _SAMPLES))
    solve(Scene(ball), rig, PlanRequest("em", _SAMPLES, views=2, shots=2))
    # Whether a camera is within the surface is asked of few.
    Scene(ball).first_hits(np.zeros((1, 3)), np.ones((1, 3)))
    # Only large problems are sorted.
    sort_by_place(formulate_problem(Scene(ball), rig, PlanRequest(samples=_SAMPLES)))


def plan_alike(request: PlanRequest) -> Work:
    """Return the work of a plan that runs the same as that of a request, on little."""
    little = PlanRequest(
        request.method,
        samples=_SAMPLES,
        k=request.k,
        scope=request.scope,
        tuples=request.tuples,
        shots=min(request.shots, 2),
        views=min(request.views, 2),
        fresh_samples=_SAMPLES,
        bound=request.bound,
    )
    return _plan_of(little)


@cache
def _plan_of(request: PlanRequest) -> Work:
    own = {"greedy": GREEDY.modules, "k_view": TUPLES_OF_CAMERAS.modules}
    modules = PLANNING.modules | own.get(request.method, frozenset())
    return Work(modules, lambda: _plan_on_ball(request))


def _plan_on_ball(request: PlanRequest) -> None:
    solve(Scene(_ball()), _rig(), request)


def _prepare_clouds() -> None:
    points = _ball().vertices
    for cloud in (PointCloud(points), PointCloud(points, points), _scattered_ball()):
        scene = Scene(cloud)
        for samples in (_SAMPLES, 0):
            scene.sample(samples, 0)


def _plan_tuples() -> None:
    scene = Scene(_ball())
    for scope in SCOPES:
        for tuples in TUPLES:
            for k in (2, 3):
                request = PlanRequest("k_view", _SAMPLES, k=k, scope=scope, tuples=tuples)
                solve(scene, _rig(), request)
    problem = formulate_problem(scene, _rig(), PlanRequest(samples=_SAMPLES))
    offsets = problem.cells.offsets
    cell = np.minimum(np.diff(offsets) - 1, 0).astype(np.int32)
    descent = Descent(problem, Options())
    kicks = Kicks(descent, offsets)
    kicks.start(cell)
    kicks.kick()
    # Only in large problems do tuples take their steps at once.
    descent.in_turn = False
    descent.run(cell, lambda _: True)


def _prove() -> None:
    # Not by a plan: that runs tuples too, and for the ball is proven optimal without branching.
    gains = gains_of(formulate_problem(Scene(_ball()), _rig(), PlanRequest(samples=_SAMPLES)))
    prices = Prices(gains)
    prices.descend(0)
    prices.frequent_cells()
    Branching(gains, prices.price, prices.bound, 0).step(0)
    cuts = CutPrices(gains, prices.price, prices.bound)
    cuts.descend(0)
    BranchingWithCuts(gains, cuts, 0).step(0)


def _plan_greedily() -> None:
    solve(Scene(_ball()), _rig(), PlanRequest("greedy", _SAMPLES))


def _plan_within_budget() -> None:
    solve(Scene(_ball()), _rig(), PlanRequest("em", _SAMPLES, images=_IMAGES))


def _see_depths() -> None:
    camera = _rig().cameras[0]
    PictureCamera(Scene(_ball())).depths(camera, _SMALL / camera.intrinsics.height)


def _take_pictures() -> None:
    camera = _rig().cameras[0]
    PictureCamera(Scene(_ball())).picture(camera, 0.6, _SMALL / camera.intrinsics.height)


def _rig() -> Rig:
    intrinsics = CameraIntrinsics(distortion_model="plumb_bob", distortion=(0.01, 0.0, 0.0, 0.0))
    return cylinder_rig(rows=2, columns=6, radius=0.6, bottom=-0.1, top=0.1, intrinsics=intrinsics)


def _scattered_ball() -> PointCloud:
    """Return points that are averaged before they are planned on."""
    random = np.random.default_rng(0)
    directions = random.standard_normal((_SCATTERED_POINTS, 3))
    directions /= np.sqrt((directions**2).sum(axis=1))[:, None]
    return PointCloud((0.2 + _SCATTER * random.standard_normal((len(directions), 1))) * directions)


def _ball() -> Mesh:
    """Return a ball of 0.2 m radius around the origin, open at its poles."""
    turn, rise = np.meshgrid(
        np.arange(_MERIDIANS) * 2 * np.pi / _MERIDIANS,
        np.linspace(-0.9, 0.9, _PARALLELS) * np.pi / 2,
    )
    directions: FloatArray = np.stack(
        [np.cos(rise) * np.cos(turn), np.cos(rise) * np.sin(turn), np.sin(rise)], axis=-1
    ).reshape(-1, 3)
    here = np.arange(_MERIDIANS * (_PARALLELS - 1))
    beside = here - here % _MERIDIANS + (here + 1) % _MERIDIANS
    lower = np.stack([here, beside, beside + _MERIDIANS], axis=1)
    upper = np.stack([here, beside + _MERIDIANS, here + _MERIDIANS], axis=1)
    return Mesh(0.2 * directions, np.concatenate([lower, upper]))


# --- all kinds ----------------------------------------------------------------------------------


def _work(do: Callable[[], None], *modules: str, after: tuple[Work, ...] = ()) -> Work:
    return Work(frozenset(modules), do, after)


#: Whatever is planned, by whatever method.
PLANNING = _work(
    _plan,
    *(
        "above",
        "cells",
        "closest",
        "distortion",
        "em",
        "gains",
        "lagrangian",
        "problem",
        "ranks",
        "rays",
        "solution",
        "spatial_order",
        "stabbing",
        "visibility",
    ),
)
#: Finding the surface around a cloud's points.
CLOUDS = _work(_prepare_clouds, "local_fit", "noise", "orientation", "point_grid", "smoothing")
#: Solving with tuples of cameras.
TUPLES_OF_CAMERAS = _work(
    _plan_tuples,
    *("assigned", "camera_tuples", "joint_costs", "k_view", "pairs", "ranking", "triples"),
    after=(PLANNING,),
)
#: Taking camera after camera.
GREEDY = _work(_plan_greedily, "greedy", after=(PLANNING, TUPLES_OF_CAMERAS))
#: Proving that a plan is the best.
PROOFS = _work(
    _prove,
    *(
        "branch_and_bound",
        "branch_and_cut",
        "cut_prices",
        "local_cuts",
        "local_prices",
        "odd_cycles",
        "odd_holes",
    ),
    after=(PLANNING,),
)
#: Choosing pictures within a budget of them.
BUDGETS = _work(_plan_within_budget, "budget", after=(PLANNING, TUPLES_OF_CAMERAS))
#: How far away is what a camera sees.
DEPTHS = _work(_see_depths, "rasterize", after=(PLANNING,))
#: What it looks like.
PICTURES = _work(_take_pictures, "shading", after=(PLANNING, DEPTHS))

#: All that plans may consist of.
PLANS = (PLANNING, CLOUDS, TUPLES_OF_CAMERAS, GREEDY, PROOFS, BUDGETS)
ALL = (*PLANS, DEPTHS, PICTURES)
