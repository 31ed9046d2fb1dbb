from __future__ import annotations

import importlib
import math
import pkgutil
from dataclasses import replace
from itertools import product

import pytest

from focus_planner.core import kernels
from focus_planner.core.planning.formulation import formulate_problem
from focus_planner.core.planning.plan_focus import plan_focus
from focus_planner.core.planning.precompile import precompile
from focus_planner.core.planning.request import METHODS, SCOPES, TUPLES, PlanRequest
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
        if hasattr(kernel, "signatures")
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
    assert compiled() == warm


def test_every_kernel_that_a_plan_enters_is_compiled(warm):
    # best_pair runs within improve_tuples.
    entered = {
        f"{kernel.py_func.__module__}.{name}"
        for name, kernel in vars(kernels).items()
        if hasattr(kernel, "signatures") and name != "best_pair"
    }
    assert len(entered) > 20
    assert entered <= {name for name, count in warm.items() if count}


def test_it_stops_when_told():
    asked = []
    precompile(lambda: asked.append(1) or len(asked) < 3)
    assert len(asked) == 3
