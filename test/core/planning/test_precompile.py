# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

from __future__ import annotations

import importlib
import math
import pkgutil
import subprocess
import sys
import textwrap
from dataclasses import replace
from itertools import product
from pathlib import Path

import pytest
from numba import config

from focus_planner.core import kernels
from focus_planner.core.planning import precompile as planning
from focus_planner.core.planning import work
from focus_planner.core.planning.formulation import formulate_problem
from focus_planner.core.planning.plan_focus import plan_focus
from focus_planner.core.planning.precompile import precompile, works_for
from focus_planner.core.planning.request import METHODS, SCOPES, TUPLES, PlanRequest
from focus_planner.core.planning.solving import solve
from focus_planner.core.progress import Progress
from focus_planner.core.rig.layouts import cylinder_rig
from focus_planner.core.rig.lens import Lens
from focus_planner.core.rig.rig import Rig
from focus_planner.core.surface.scene import Scene
from focus_planner.core.surface.surface import Mesh, PointCloud
from focus_planner.io.bodies import body as body_path
from focus_planner.io.surfaces import load_surface
from testing.clock import Clock


def compiled():
    """Every kernel with the types of arguments that it is compiled for."""
    modules = [
        importlib.import_module(f"{kernels.__name__}.{module.name}")
        for module in pkgutil.iter_modules(kernels.__path__)
    ]
    return {
        f"{module.__name__}.{name}": len(kernel.signatures)
        for module in modules
        for name, kernel in vars(module).items()
        if isinstance(kernel, kernels.Kernel)
    }


@pytest.fixture(scope="module")
def body():
    return load_surface(body_path("arms_down"))


@pytest.fixture(scope="module")
def rig():
    return cylinder_rig(rows=4, columns=8, radius=1.2)


@pytest.fixture(scope="module")
def warm():
    precompile()
    return compiled()


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    "kind",
    [
        "mesh",
        "smooth mesh",
        "weighted mesh",
        "cloud",
        "cloud with normals",
        "weighted cloud",
    ],
)
def test_no_request_compiles_anything(warm, body, rig, method, kind):
    points = body.vertices[::10]
    surface = {
        "mesh": body,
        "smooth mesh": Mesh(body.vertices, body.triangles, body.vertices),
        "cloud": PointCloud(points),
        "cloud with normals": PointCloud(points, points),
        "weighted mesh": Mesh(body.vertices, body.triangles, vertex_importance=body.vertices[:, 2]),
        "weighted cloud": PointCloud(points, importance=points[:, 2]),
    }[kind]
    scene = Scene(surface)
    # A proof may take minutes, so it gets so many questions whether to go on.
    budget = 50.0 if method == "optimal" else math.inf
    for scope, tuples, k in product(SCOPES, TUPLES, (2, 3)):
        for samples in (150, 0) if "cloud" in kind else (150,):
            request = PlanRequest(
                method, samples, k=k, scope=scope, tuples=tuples, time_budget=budget
            )
            plan_focus(scene, rig, request, clock=Clock(1.0))
        if method != "k_view":
            break
    assert compiled() == warm
    # Formulation that may be stopped, after one question or after some; lists, brackets, a budget.
    for samples in (4000, 0) if "cloud" in kind else (4000,):
        for answers in ([False], [True, True, False]):
            formulate_problem(
                scene,
                rig,
                PlanRequest(samples=samples),
                keep_going=lambda _, left=answers: left.pop(0),
            )
    listed = Lens(focus_distances=(0.6, 0.8, 1.0, 1.2, 1.4))
    for lens in (rig.cameras[0].lens, listed):
        cameras = Rig(tuple(replace(camera, lens=lens) for camera in rig.cameras))
        request = PlanRequest(method, 150, shots=2, depth_tolerance=0.002, time_budget=50.0)
        plan_focus(scene, cameras, request, clock=Clock(1.0))
        for views in (1, 3):
            limited = replace(request, images=5, views=views)
            plan_focus(scene, cameras, limited, clock=Clock(1.0))
    assert compiled() == warm


def test_every_kernel_that_a_plan_enters_is_compiled(warm):
    # best_pair runs within others, and on one core no tuples take their steps at once.
    left_out = {"best_pair"} | ({"improve_tuples"} if config.NUMBA_NUM_THREADS == 1 else set())
    entered = {
        f"{kernel.py_func.__module__}.{name}"
        for name, kernel in vars(kernels).items()
        if isinstance(kernel, kernels.Kernel) and name not in left_out
    }
    assert len(entered) > 20
    assert entered <= {name for name, count in warm.items() if count}


def test_what_is_there_is_not_told_of(warm):
    told = []
    assert precompile(on_progress=told.append).kernels == 0
    assert told == []


# --- the stage -----------------------------------------------------------------------------------


def test_every_kernel_belongs_to_one_kind_of_work():
    for each in kernels.KERNELS:
        assert len([kind for kind in work.ALL if each.room in kind.modules]) == 1
    rooms = {each.room for each in kernels.KERNELS}
    assert rooms == work.SECONDS.keys() == set().union(*(w.modules for w in work.ALL))


_OPTIMAL = [
    work.PLANNING,
    work.CLOUDS,
    work.TUPLES_OF_CAMERAS,
    work.PROOFS,
]


@pytest.mark.parametrize(
    ("method", "images", "clouds", "works"),
    [
        ("em", 0, False, [work.PLANNING]),
        ("em", 9, False, [work.PLANNING, work.BUDGETS]),
        ("greedy", 0, False, [work.PLANNING, work.GREEDY]),
        ("closest", 0, True, [work.PLANNING, work.CLOUDS]),
        ("k_view", 0, False, [work.PLANNING, work.TUPLES_OF_CAMERAS]),
        ("optimal", 0, True, _OPTIMAL),
        ("optimal", 9, True, [*_OPTIMAL, work.BUDGETS]),
    ],
)
def test_only_what_a_request_runs_is_compiled(method, images, clouds, works):
    assert list(works_for(PlanRequest(method, images=images), clouds=clouds)) == works


@pytest.mark.processes
def test_each_kind_of_work_covers_what_its_requests_run():
    # In a process of its own: here all of them have been loaded.
    program = """
        from focus_planner.core import kernels
        from focus_planner.core.planning.plan_focus import plan_focus
        from focus_planner.core.planning.precompile import precompile, works_for
        from focus_planner.core.planning.request import PlanRequest
        from focus_planner.core.rig.layouts import cylinder_rig
        from focus_planner.core.surface.scene import Scene
        from focus_planner.core.surface.surface import PointCloud
        from testing.problems import box

        rig = cylinder_rig(rows=2, columns=6, radius=1.0, bottom=-0.1, top=0.1)
        mesh = box((0.3, 0.3, 0.3))
        cloud = PointCloud(Scene(mesh).sample(3000, 0).points)
        for method, images, clouds in (
            ("em", 0, False),
            ("em", 5, False),
            ("greedy", 0, False),
            ("k_view", 0, False),
            ("em", 0, True),
            ("optimal", 0, True),
        ):
            request = PlanRequest(method, 300, images=images)
            precompile(works_for(request, clouds=clouds))
            loaded = []
            with kernels.listening(lambda kernel, _: loaded.append(kernel.name)):
                plan_focus(Scene(cloud if clouds else mesh), rig, request)
            assert not loaded, (method, images, clouds, loaded)
    """
    subprocess.run([sys.executable, "-c", textwrap.dedent(program)], check=True)


class FakeKernel:
    """A kernel that takes no time to compile."""

    def __init__(self, room, name, *, is_ready=False):
        self.room, self.name, self.is_ready = room, name, is_ready


@pytest.fixture
def cold(monkeypatch):
    """A machine on which two of the kernels of pictures are missing, and one is there."""
    fakes = [FakeKernel("shading", name) for name in ("outer", "inner")]
    others = [FakeKernel("shading", "there", is_ready=True), FakeKernel("k_view", "no matter")]
    monkeypatch.setattr(kernels, "KERNELS", [*fakes, *others])
    monkeypatch.setitem(work.SECONDS, "shading", 30.0)
    monkeypatch.setattr(kernels, "kept_in", lambda: Path("/kept"))
    return fakes


def stage(told, clock):
    return planning._Stage((work.DEPTHS, work.PICTURES), told.append, clock)


def test_the_stage_tells_what_is_done_and_what_the_whole_takes(cold):
    told, clock = [], Clock()
    of = stage(told, clock)
    outer, inner = cold
    of(outer, False)
    clock.now += 1.0
    of(inner, False)
    assert [(p.stage, p.iteration, p.share, p.expected) for p in told] == [
        ("compiling", 0, 0.0, 20.0),
        ("compiling", 0, 0.0, 21.0),
    ]
    # This machine is twice as slow as the one that was measured.
    clock.now += 19.0
    of(inner, True)
    assert (told[-1].iteration, told[-1].share, told[-1].expected) == (1, 0.5, 40.0)
    clock.now += 20.0
    of(outer, True)
    assert (told[-1].iteration, told[-1].share, told[-1].expected) == (2, 1.0, 40.0)
    done = of.compiled()
    assert (done.kernels, done.elapsed, done.folder) == (2, 40.0, Path("/kept"))
    assert done.seconds == {"shading": pytest.approx(40.0)}
    assert str(done) == "compiled 2 kernels in 40.0 s; they are kept in /kept"


def test_what_was_loaded_counts_as_done_and_not_as_compiled(cold):
    told, clock = [], Clock()
    of = stage(told, clock)
    outer, inner = cold
    of(outer, False)
    of(outer, True)
    of(inner, True)
    assert of.compiled().kernels == 1
    of(outer, False)
    assert told[-1].share == 1.0


def test_it_claims_no_more_than_it_knows(cold, monkeypatch):
    # Kernels that cannot be kept are not compiled once, and what to do about it is said.
    monkeypatch.setattr(kernels, "kept_in", lambda: None)
    told = []
    of = stage(told, Clock())
    of(cold[0], False)
    of(cold[0], True)
    assert {p.stage for p in told} == {"compiling, not kept"}
    assert str(of.compiled()) == (
        "compiled 1 kernel in 0.0 s; no other process will find them, since no folder for them"
        " can be written to: set NUMBA_CACHE_DIR to one that can"
    )
    assert str(stage(told, Clock()).compiled()) == "all kernels are compiled"


def test_each_kind_of_work_is_done_once(monkeypatch):
    done = []
    one, other = (work.Work(frozenset(), lambda n=n: done.append(n)) for n in (1, 2))
    monkeypatch.setattr(planning, "ALL", (one, other))
    monkeypatch.setattr(planning, "_done", set())
    precompile((other,))
    precompile((other, one))
    precompile()
    assert done == [2, 1]


# --- a plan on a machine without kernels ---------------------------------------------------------

COMPILING = Progress("compiling", 1, math.nan)


@pytest.fixture
def slow(monkeypatch):
    """Compiling takes a hundred seconds."""
    clock = Clock()

    def compile_slowly(works, on_progress):
        clock.now += 100.0
        on_progress(COMPILING)
        on_progress(COMPILING)

    monkeypatch.setattr("focus_planner.core.planning.plan_focus.precompile", compile_slowly)
    return clock


@pytest.mark.parametrize("time_budget", [50.0, math.inf])
def test_compiling_is_no_part_of_a_plan(slow, body, rig, time_budget):
    stages, request = [], PlanRequest("em", 150, time_budget=time_budget)
    scene = Scene(body)
    plan = plan_focus(
        scene, rig, request, on_progress=lambda p: stages.append(p.stage) or True, clock=slow
    )
    assert stages[:2] == ["compiling", "compiling"]
    assert "compiling" not in stages[2:]
    assert (plan.solve_seconds, plan.total_seconds, plan.converged) == (0.0, 0.0, True)
    warm = solve(scene, rig, request, clock=Clock())
    assert (plan.cameras, plan.cost) == (warm.cameras, warm.cost)


def test_a_stop_waits_for_it(slow, body, rig):
    told = []
    plan = plan_focus(
        Scene(body),
        rig,
        PlanRequest("em", 9000),
        on_progress=told.append,  # which returns None: stop
        clock=slow,
    )
    assert told == [COMPILING]
    assert not plan.converged
    assert plan.samples < 9000


def test_an_exception_ends_it(slow, body, rig):
    def interrupt(_):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        plan_focus(Scene(body), rig, on_progress=interrupt)
