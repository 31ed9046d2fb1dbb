"""Compile, or load from disk, every kernel that a plan or a picture may run, before the first."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from focus_planner.core.arrays import FloatArray
from focus_planner.core.bounds.branch_and_bound import Branching
from focus_planner.core.bounds.lagrangian import Prices
from focus_planner.core.imaging.exposure import PictureCamera
from focus_planner.core.planning.formulation import formulate_problem
from focus_planner.core.planning.plan_focus import plan_focus
from focus_planner.core.planning.request import METHODS, SCOPES, TUPLES, PlanRequest
from focus_planner.core.problem.gains import gains_of
from focus_planner.core.rig.camera import CameraIntrinsics
from focus_planner.core.rig.geometry import image_corners
from focus_planner.core.rig.layouts import cylinder_rig
from focus_planner.core.rig.rig import Rig
from focus_planner.core.surface.scene import Scene
from focus_planner.core.surface.surface import Mesh, PointCloud

_SAMPLES = 200
_SMALL = 64  # pixels
_MERIDIANS, _PARALLELS = 24, 12
# On the ball they are 8 mm apart, and scatter by as much.
_SCATTERED_POINTS, _SCATTER = 8_000, 0.008


def precompile(keep_going: Callable[[], bool] = lambda: True) -> None:
    """Plan for a small ball in every possible way, so that no request waits for a compiler.

    Kernels are compiled for the types of their arguments, which depend on the method, on the kind
    of surface and on whether the samples are a cloud's own points. This takes a minute or two the
    first time and less than a second from then on: Numba caches compiled kernels on disk.

    Parameters
    ----------
    keep_going : callable, optional
        Called before every plan; return False to stop.
    """
    intrinsics = CameraIntrinsics(distortion_model="plumb_bob", distortion=(0.01, 0.0, 0.0, 0.0))
    rig = cylinder_rig(rows=2, columns=6, radius=0.6, bottom=-0.1, top=0.1, intrinsics=intrinsics)
    image_corners(rig.cameras[0], 1.0)
    for scene, request in _plans():
        if not keep_going():
            return
        plan_focus(scene, rig, request)
    if keep_going():
        _branch(scene, rig)
    if keep_going():
        camera, pictures = rig.cameras[0], PictureCamera(scene)
        scale = _SMALL / camera.intrinsics.height
        pictures.depths(camera, scale)
        pictures.picture(camera, 0.6, scale)


def _branch(scene: Scene, rig: Rig) -> None:
    """Run branch and bound for one step: plans for the ball are proven optimal without it."""
    gains = gains_of(formulate_problem(scene, rig, PlanRequest(samples=_SAMPLES)))
    prices = Prices(gains)
    prices.descend(0)
    Branching(gains, prices.price, prices.bound, 0).step(0)


def _plans() -> Iterator[tuple[Scene, PlanRequest]]:
    for scene, samples in _scenes():
        yield scene, PlanRequest(method="closest", samples=samples)
    scene = Scene(_ball())
    for request in _requests():
        yield scene, request


def _scenes() -> Iterator[tuple[Scene, int]]:
    ball = _ball()
    points = ball.vertices
    yield Scene(Mesh(points, ball.triangles, points)), _SAMPLES
    for cloud in (PointCloud(points), PointCloud(points, points), _scattered_ball()):
        yield Scene(cloud), _SAMPLES
        yield Scene(cloud), 0


def _requests() -> Iterator[PlanRequest]:
    for method in METHODS:
        yield PlanRequest(method=method, samples=_SAMPLES)
    for scope in SCOPES:
        for tuples in TUPLES:
            for k in (2, 3):
                yield PlanRequest("k_view", _SAMPLES, k=k, scope=scope, tuples=tuples)


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
