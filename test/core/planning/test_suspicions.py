# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Mistakes of axes and frames, made on purpose, and told by the plan."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from focus_planner import (
    Camera,
    InputError,
    Mesh,
    PointCloud,
    Rig,
    Scene,
    cylinder_rig,
    load_surface,
    plan_focus,
)
from focus_planner.core.planning.suspicions import seen_from_behind, suspect_frames
from focus_planner.core.rig.frames import BODY_FROM_OPTICAL
from focus_planner.core.surface.up_axis import TURNS, with_z_up
from focus_planner.io.bodies import bodies
from testing.problems import around, sphere

BODIES = {path.stem: load_surface(path) for path in bodies()}
RIG = cylinder_rig()
SMALL_RIG = cylinder_rig(4, 8, radius=1.2)


def lying(mesh: Mesh, up: str) -> Mesh:
    """Return a standing body so that its axis ``up`` is up: the inverse of the turn."""
    turned = replace(mesh, vertices=mesh.vertices @ TURNS[up].matrix())
    back = with_z_up(turned, up)
    assert isinstance(back, Mesh)
    np.testing.assert_array_equal(back.vertices, mesh.vertices)
    return turned


def posed(rig: Rig, wrong: Callable[[Camera], Camera]) -> Rig:
    return replace(rig, cameras=tuple(map(wrong, rig.cameras)))


def turned(turn: Rotation) -> Callable[[Camera], Camera]:
    def wrong(camera: Camera) -> Camera:
        quaternion = (Rotation.from_quat(camera.orientation) * turn).as_quat()
        return replace(camera, orientation=tuple(quaternion.tolist()))

    return wrong


def w_first(camera: Camera) -> Camera:
    x, y, z, w = camera.orientation
    return replace(camera, orientation=(w, x, y, z))


def inverted(camera: Camera) -> Camera:
    turn = Rotation.from_quat(camera.orientation).inv()
    return replace(
        camera,
        position=tuple((-turn.apply(camera.position)).tolist()),
        orientation=tuple(turn.as_quat().tolist()),
    )


WRONG = {
    "quaternion_order": (w_first, "quaternions read as w, x, y, z"),
    "opengl": (turned(Rotation.from_quat([1, 0, 0, 0])), "frames read as OpenGL's"),
    "body": (turned(BODY_FROM_OPTICAL.rotation.inv()), "frames read as body frames"),
    "inverted_poses": (inverted, "camera poses inverted"),
}


@pytest.mark.parametrize("rig", [RIG, SMALL_RIG], ids=["paper's rig", "32 cameras"])
@pytest.mark.parametrize("body", BODIES)
def test_nothing_is_suspected_of_what_is_right(body: str, rig: Rig) -> None:
    assert suspect_frames(Scene(BODIES[body]), rig) is None


@pytest.mark.parametrize("body", BODIES)
@pytest.mark.parametrize("up", [up for up in TURNS if up != "z"])
def test_the_axis_that_is_up_is_suspected(up: str, body: str) -> None:
    suspicion = suspect_frames(Scene(lying(BODIES[body], up)), RIG)
    assert suspicion is not None
    assert suspicion.code == "up_axis"
    assert f"the surface's {up} axis up" in str(suspicion)
    assert str(TURNS[up]) in str(suspicion)


@pytest.mark.parametrize("body", BODIES)
@pytest.mark.parametrize("mistake", WRONG)
def test_wrong_poses_are_suspected(mistake: str, body: str) -> None:
    wrong, telling = WRONG[mistake]
    suspicion = suspect_frames(Scene(BODIES[body]), posed(RIG, wrong))
    assert suspicion is not None
    assert telling in str(suspicion)
    assert suspicion.code == (mistake if "_" in mistake else "camera_axes")


def test_nothing_is_suspected_because_a_subject_is_small_or_flat() -> None:
    small = [
        replace(mesh, vertices=0.1 * mesh.vertices + place)
        for mesh in BODIES.values()
        for place in np.random.default_rng(1).uniform((-0.3, -0.3, 0.1), (0.3, 0.3, 1.5), (8, 3))
    ]
    x, y = (0.4 * (np.mgrid[:21, :21].reshape(2, -1) / 20 - 0.5)).round(6)
    plate = PointCloud(np.column_stack([x, y, np.full(len(x), 0.5)]))
    for surface in (*small, plate):
        suspicion = suspect_frames(Scene(surface), RIG)
        assert suspicion is None or suspicion.sight.surface > 1.1 * suspicion.now.surface
        assert suspicion is None or suspicion.code == "up_axis"


def test_no_plan_that_a_mistake_explains_says_which() -> None:
    rig = posed(around(4, 1.2), turned(Rotation.from_quat([1, 0, 0, 0])))
    with pytest.raises(InputError, match="none that does; with the cameras' frames read as OpenGL"):
        plan_focus(Scene(sphere(0.4)), rig)


def test_it_is_found_once_for_a_surface_and_a_rig() -> None:
    scene = Scene(lying(BODIES["arms_down"], "y"))
    first = suspect_frames(scene, RIG)
    assert suspect_frames(scene, RIG) is first
    assert suspect_frames(scene, SMALL_RIG) is not first


def test_what_is_seen_from_behind() -> None:
    mesh = BODIES["arms_down"]
    assert seen_from_behind(Scene(mesh), RIG) < 0.02
    wrong = np.random.default_rng(0).random(len(mesh.triangles)) < 0.3
    both = np.where(wrong[:, None], mesh.triangles[:, ::-1], mesh.triangles)
    areas = np.sqrt((mesh.cross_products**2).sum(axis=1))
    expected = areas[wrong].sum() / areas.sum()
    found = seen_from_behind(Scene(replace(mesh, triangles=both)), RIG)
    assert found == pytest.approx(expected, abs=0.08)  # of 300 samples
