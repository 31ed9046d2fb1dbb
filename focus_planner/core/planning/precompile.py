# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Compiling what plans and pictures run, before the first of them, as a stage of its own.

Kernels are compiled for the types of their arguments, and those depend on what is done. So each
kind of work is done once, on a small ball: that compiles what it runs, or loads what an earlier
process has compiled, which takes a second. Only if something turns out to be missing is there a
stage to show. What it will take is then known: the kernels of each kind of work are those of some
modules, and how long each of these takes to compile was measured. As kernels get done, the machine
itself tells how much slower or faster it is. Where nothing is missing, one plan of the same kind
loads what is needed.
"""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Callable, Collection
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from focus_planner.core import kernels
from focus_planner.core.arrays import FloatArray
from focus_planner.core.bounds.branch_and_bound import Branching
from focus_planner.core.bounds.branch_and_cut import BranchingWithCuts
from focus_planner.core.bounds.cut_prices import CutPrices
from focus_planner.core.bounds.lagrangian import Prices
from focus_planner.core.forks import refuse_forked_threads
from focus_planner.core.imaging.exposure import PictureCamera
from focus_planner.core.planning.formulation import formulate_problem
from focus_planner.core.planning.request import SCOPES, TUPLES, PlanRequest
from focus_planner.core.planning.solving import solve
from focus_planner.core.problem.gains import gains_of
from focus_planner.core.progress import COMPILING, COMPILING_IN_VAIN, Progress, time_spent
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
# Once so much of the work is done, its pace tells how long the rest will take.
_TELLING = 0.1

# About how many seconds the kernels of a module take to compile, without those of others that they
# call: the time of one core of a cloud server. "focus_planner warm-up --modules" measures them.
_SECONDS = {
    "assigned": 3.0,
    "branch_and_bound": 13.0,
    "branch_and_cut": 14.0,
    "budget": 4.0,
    "camera_tuples": 7.0,
    "cells": 3.5,
    "cut_prices": 20.0,
    "distortion": 2.5,
    "em": 2.0,
    "gains": 5.5,
    "greedy": 5.0,
    "k_view": 24.0,
    "lagrangian": 14.0,
    "local_cuts": 8.0,
    "local_fit": 7.5,
    "local_prices": 9.0,
    "noise": 5.0,
    "odd_holes": 14.0,
    "orientation": 10.0,
    "pairs": 6.5,
    "point_grid": 1.0,
    "problem": 2.5,
    "ranking": 3.0,
    "rasterize": 14.0,
    "shading": 25.0,
    "smoothing": 10.0,
    "solution": 2.0,
    "stabbing": 5.5,
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
        return sum(_SECONDS[module] for module in self.modules)


@dataclass(frozen=True)
class Compiled:
    """What has been compiled.

    Attributes
    ----------
    seconds : dict of str to float
        How long the kernels of each module took. Those that were found compiled took none.
    kernels : int
        How many kernels were compiled, counted for each set of types.
    elapsed : float
        Seconds that it took in all; 0 if nothing was compiled.
    folder : Path or None
        Where they are kept for other processes; None if there is no such place.
    """

    seconds: dict[str, float]
    kernels: int
    elapsed: float
    folder: Path | None

    def __str__(self) -> str:
        if not self.kernels:
            return "all kernels are compiled"
        kernel = "kernel" if self.kernels == 1 else "kernels"
        done = f"compiled {self.kernels} {kernel} in {time_spent(self.elapsed)}"
        return f"{done}; they are kept in {self.folder}" if self.folder else f"{done}; {NOT_KEPT}"


#: What to do about kernels that no other process will find.
NOT_KEPT = (
    "no other process will find them, since no folder for them can be written to: set"
    " NUMBA_CACHE_DIR to one that can"
)


def works_for(request: PlanRequest, *, clouds: bool) -> tuple[Work, ...]:
    """Return the kinds of work that a plan consists of.

    Where others have compiled all of it, what such a plan itself runs has yet to be loaded.

    Parameters
    ----------
    request : PlanRequest
    clouds : bool
        Whether it is for a cloud; a mesh takes less.
    """
    works = [PLANNING, CLOUDS] if clouds else [PLANNING]
    if request.method in {"k_view", "optimal"}:
        works.append(TUPLES_OF_CAMERAS)
    if request.method == "optimal":
        works.append(PROOFS)
    if request.method == "greedy":
        works.append(GREEDY)
    if request.images:
        works.append(BUDGETS)
    if clouds or request.method == "optimal" or request.images or _done.issuperset(works):
        return tuple(works)
    if not _found.issuperset(works):
        if missing_kernels(works):
            return tuple(works)
        _found.update(works)
    return (_plan_alike(_little(request)),)


def precompile(
    works: Collection[Work] | None = None,
    on_progress: Callable[[Progress], object] = lambda _: None,
) -> Compiled:
    """Compile, or load from disk, whatever kinds of work run, so that none waits for a compiler.

    It takes a second or two from the second time on, and none at all in a process that has done it
    before.

    Parameters
    ----------
    works : collection of Work, optional
        All by default.
    on_progress : callable, optional
        Called before and after each kernel that is compiled. What it raises ends the call.

    Raises
    ------
    RuntimeError
        If the process was forked from one in which threads of GNU OpenMP ran already: nothing can
        be planned there.
    """
    refuse_forked_threads()
    works = ALL if works is None else works
    stage = _Stage(works, on_progress)
    with kernels.listening(stage):
        for work in (*(each for each in works if each not in ALL), *ALL):
            if work in works and work not in _done:
                work.do()
                _done.add(work)
    return stage.compiled()


def missing_kernels(works: Collection[Work]) -> dict[kernels.Kernel, float]:
    """Return the kernels of some kinds of work that no process has compiled yet.

    Returns
    -------
    dict of Kernel to float
        About how many seconds each takes to compile, on one core of a cloud server.
    """
    modules = frozenset[str]().union(*(work.modules for work in works))
    relevant = [each for each in kernels.KERNELS if each.room in modules]
    alike = Counter(each.room for each in relevant)
    return {each: _SECONDS[each.room] / alike[each.room] for each in relevant if not each.is_ready}


def progress_of(
    stage: str, compiled: int, elapsed: float, *, whole: float, left: float
) -> Progress:
    """Return how far compiling is.

    Parameters
    ----------
    stage : str
    compiled : int
        How many kernels have been compiled.
    elapsed : float
        Since when, seconds.
    whole, left : float
        How many seconds the whole and what is left of it take on the machine that was measured.
    """
    share = 1 - left / whole if whole else 0.0
    slow = elapsed / (share * whole) if share > _TELLING else 1.0
    return Progress(stage, compiled, math.nan, share=share, expected=elapsed + slow * left)


# --- the stage -----------------------------------------------------------------------------------


class _Stage:
    """Follows what is compiled; hears of every kernel before and after."""

    def __init__(
        self,
        works: Collection[Work],
        on_progress: Callable[[Progress], object],
        clock: Callable[[], float] = time.perf_counter,
    ) -> None:
        self._works = works
        self._on_progress = on_progress
        self._clock = clock
        self._name = ""
        self._began = self._ended = math.nan
        self._count = 0
        # What is being compiled, the innermost last: when it began, and seconds of others within.
        self._open: list[tuple[kernels.Kernel, float, float]] = []
        self._seconds: dict[str, float] = {}
        self._missing: dict[kernels.Kernel, float] = {}
        self._whole = self._left = 0.0

    def __call__(self, kernel: kernels.Kernel, is_ready: bool) -> None:
        """Take note of a kernel that is about to be compiled, or ready."""
        now = self._clock()
        if not is_ready:
            if not self._name:
                self._begin(now)
            self._open.append((kernel, now, 0.0))
            self._tell(now)
        else:
            self._left -= self._missing.pop(kernel, 0.0)
            if self._open and self._open[-1][0] is kernel:
                self._end(now)
                self._tell(now)

    def compiled(self) -> Compiled:
        """Return what has been compiled."""
        elapsed = self._ended - self._began if self._count else 0.0
        return Compiled(self._seconds, self._count, elapsed, kernels.kept_in())

    def _begin(self, now: float) -> None:
        self._name = COMPILING if kernels.kept_in() else COMPILING_IN_VAIN
        self._began = now
        self._missing = missing_kernels(self._works)
        self._whole = self._left = sum(self._missing.values())

    def _end(self, now: float) -> None:
        kernel, began, within = self._open.pop()
        self._ended = now
        self._count += 1
        took = self._seconds.get(kernel.room, 0.0) + now - began - within
        self._seconds[kernel.room] = took
        if self._open:
            outer, its_beginning, before = self._open.pop()
            self._open.append((outer, its_beginning, before + now - began))

    def _tell(self, now: float) -> None:
        elapsed = now - self._began
        self._on_progress(
            progress_of(self._name, self._count, elapsed, whole=self._whole, left=self._left)
        )


# --- the work ------------------------------------------------------------------------------------


def _plan() -> None:
    rig, ball = _rig(), _ball()
    image_corners(rig.cameras[0], 1.0)
    smooth = Mesh(ball.vertices, ball.triangles, ball.vertices)
    # What may be stopped finds in parts what cameras see, and puts these together.
    solve(Scene(smooth), rig, PlanRequest("closest", _SAMPLES), on_progress=lambda _: True)
    for method in ("closest", "average", "em"):
        solve(Scene(ball), rig, PlanRequest(method, _SAMPLES))
    solve(Scene(ball), rig, PlanRequest("em", _SAMPLES, views=2, shots=2))


def _little(request: PlanRequest) -> PlanRequest:
    """Return a request that runs the same on little."""
    return PlanRequest(
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


@cache
def _plan_alike(request: PlanRequest) -> Work:
    """Return the work of a plan on little."""
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
    kicks = Kicks(Descent(problem, Options()), offsets)
    kicks.start(np.minimum(np.diff(offsets) - 1, 0).astype(np.int32))
    kicks.kick()


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


# --- kinds of work -------------------------------------------------------------------------------


def _work(do: Callable[[], None], *modules: str, after: tuple[Work, ...] = ()) -> Work:
    return Work(frozenset(modules), do, after)


#: Whatever is planned, by whatever method.
PLANNING = _work(
    _plan,
    *(
        "cells",
        "distortion",
        "em",
        "gains",
        "lagrangian",
        "problem",
        "solution",
        "stabbing",
        "visibility",
    ),
)
#: Finding the surface around a cloud's points.
CLOUDS = _work(_prepare_clouds, "local_fit", "noise", "orientation", "point_grid", "smoothing")
#: Solving with tuples of cameras.
TUPLES_OF_CAMERAS = _work(
    _plan_tuples,
    *("assigned", "camera_tuples", "k_view", "pairs", "ranking"),
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

# What this process has done, and what it has found that others compiled.
_done: set[Work] = set()
_found: set[Work] = set()
