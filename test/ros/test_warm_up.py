from __future__ import annotations

import importlib
import pkgutil
from itertools import product

import pytest

from focus_planner.core import kernels
from focus_planner.core.planning import METHODS, SCOPES, TUPLES, PlanRequest, plan_focus
from focus_planner.core.scene import Scene
from focus_planner.core.types import Mesh, PointCloud
from focus_planner.core.warm_up import warm_up


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
def warm():
    warm_up()
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
    for scope, tuples, k in product(SCOPES, TUPLES, (2, 3)):
        for samples in (150, 0) if "cloud" in kind else (150,):
            request = PlanRequest(method, samples, k=k, scope=scope, tuples=tuples)
            plan_focus(scene, rig, request)
        if method != "k_view":
            break
    assert compiled() == warm


def test_it_stops_when_told():
    asked = []
    warm_up(lambda: asked.append(1) or len(asked) < 3)
    assert len(asked) == 3
