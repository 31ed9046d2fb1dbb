# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Which pixels are in focus, against planes whose depth is known, and against brute force."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from focus_planner.core.imaging.blur import blur_diameters
from focus_planner.core.planning.plan_focus import plan_focus
from focus_planner.core.planning.request import PlanRequest
from focus_planner.core.planning.subject import PlannedSubject
from focus_planner.core.rig.camera import Camera, CameraIntrinsics
from focus_planner.core.rig.geometry import rotation_from_quaternion
from focus_planner.core.rig.lens import Lens
from focus_planner.core.rig.rig import Rig
from focus_planner.core.surface.scene import Scene
from focus_planner.core.surface.surface import Mesh
from focus_planner.masks.making import MaskedPicture, masked_pictures, sharp_elsewhere
from focus_planner.masks.programs import picture_names
from testing.problems import around, torus

IMAGE = CameraIntrinsics(60, 40, 60.0, 60.0, 29.5, 19.5)
EDGES = (0.9, 1.0, 1.1, 1.2, 1.3)


def steps() -> Mesh:
    """Strips side by side, each farther than the last, that fill the picture of a camera at 0."""
    vertices, triangles = [], []
    for i, depth in enumerate(EDGES):
        left, right = ((x - 29.5) / 60 * depth for x in (12 * i - 0.5, 12 * i + 11.5))
        corners = [(left, -1, depth), (right, -1, depth), (right, 1, depth), (left, 1, depth)]
        first = len(vertices)
        vertices += corners
        triangles += [(first, first + 2, first + 1), (first, first + 3, first + 2)]
    return Mesh(np.array(vertices), np.array(triangles))


def subject_of(surface: Mesh, rig: Rig, request: PlanRequest, **changes: Any) -> PlannedSubject:
    scene = Scene(surface)
    plan = plan_focus(scene, rig, request)
    cameras = tuple(
        replace(camera, shots=tuple(replace(shot, **changes) for shot in camera.shots))
        for camera in plan.cameras
    )
    return PlannedSubject(scene, rig, request, replace(plan, cameras=cameras))


def pictures(subject: PlannedSubject, **options: Any) -> list[MaskedPicture]:
    return list(masked_pictures(subject, picture_names(subject.plan), **options))


def stepped(tolerance: float = 0.0, intrinsics: CameraIntrinsics = IMAGE) -> PlannedSubject:
    camera = Camera("cam", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), intrinsics, Lens(0.05, 10.0))
    request = PlanRequest("closest", 500, fresh_samples=500, depth_tolerance=tolerance)
    limits = {"focus_distance": 1.1, "near_limit": 0.95, "far_limit": 1.25}
    return subject_of(steps(), Rig((camera,)), request, **limits)


@pytest.mark.parametrize(
    ("tolerance", "held"), [(0.0, (1.0, 1.1, 1.2)), (0.04, (1.0, 1.1, 1.2)), (0.06, (1.1,))]
)
def test_what_is_within_the_depth_of_field_is_white(
    tolerance: float, held: tuple[float, ...]
) -> None:
    (picture,) = pictures(stepped(tolerance))
    expected = np.repeat(np.isin(EDGES, held), 12)
    np.testing.assert_array_equal(picture.mask, np.tile(expected, (40, 1)))
    assert picture.subject_pixels == 2400
    assert picture.sharp_pixels == picture.mask.sum()


def test_what_is_imaged_more_coarsely_than_asked_is_black() -> None:
    subject = stepped()
    fx = subject.rig.cameras[0].intrinsics.fx
    most = 1000 * 1.15 / fx  # of the steps at 1, 1.1 and 1.2 m the last is imaged more coarsely
    plan, request = (
        replace(each, max_mm_per_pixel=most)  # type: ignore[type-var]
        for each in (subject.plan, subject.request)
    )
    (picture,) = pictures(replace(subject, plan=plan, request=request))
    middle = np.s_[5:-5, 6::12]
    expected = np.tile(np.isin(EDGES, (1.0, 1.1)), (picture.mask[middle].shape[0], 1))
    np.testing.assert_array_equal(picture.mask[middle], expected)
    assert picture.subject_pixels == 2400


def test_maps_tell_depth_and_blur() -> None:
    subject = stepped()
    (picture,) = pictures(subject, with_blur=True)
    np.testing.assert_allclose(picture.depths[0, ::12], EDGES, rtol=1e-6)
    expected = blur_diameters(np.array(EDGES), subject.rig.cameras[0], 1.1)
    assert picture.blur is not None
    np.testing.assert_allclose(picture.blur[0, ::12], expected, rtol=1e-4, atol=1e-6)
    (without,) = pictures(subject)
    assert without.blur is None


def test_the_most_blur_that_counts_can_be_less() -> None:
    subject = stepped()
    blur = blur_diameters(np.array(EDGES), subject.rig.cameras[0], 1.1)
    (picture,) = pictures(subject, max_blur=float(blur[1] + blur[2]) / 2)
    np.testing.assert_array_equal(picture.mask[0, ::12], np.array(EDGES) == 1.1)


def test_beside_the_subject_there_is_neither_depth_nor_blur() -> None:
    subject = stepped(intrinsics=replace(IMAGE, width=80))
    (picture,) = pictures(subject, with_blur=True)
    beside = np.s_[:, 61:]
    assert picture.blur is not None
    assert np.isposinf(picture.depths[beside]).all()
    assert np.isnan(picture.blur[beside]).all()
    assert not picture.mask[beside].any()


def test_pictures_are_those_of_the_pixels_that_are_read_out() -> None:
    image = replace(IMAGE, region=(12, 4, 31, 23), binning=(2, 5))
    (picture,) = pictures(stepped(intrinsics=image))
    assert picture.mask.shape == (4, 15)
    expected = np.repeat([1.0, 1.1, 1.2], [6, 6, 3])  # the strips from column 12 to 41
    np.testing.assert_allclose(picture.depths, np.tile(expected, (4, 1)), rtol=1e-6)
    assert picture.mask.all()


def test_each_shot_has_a_mask() -> None:
    request = PlanRequest("em", 300, fresh_samples=300, shots=2)
    rig = around(3, 2.5, intrinsics=IMAGE, lens=Lens(0.085, 60.0))
    subject = subject_of(torus(), rig, request)
    made = pictures(subject)
    assert [(p.name.camera, p.name.shot) for p in made] == [
        (c, s) for c in range(3) for s in (0, 1)
    ]
    for picture in made:
        shot = subject.plan.cameras[picture.name.camera].shots[picture.name.shot]
        held = (picture.depths >= shot.near_limit) & (picture.depths <= shot.far_limit)
        np.testing.assert_array_equal(picture.mask, held)
    assert (made[0].mask != made[1].mask).any()


@cache
def ring() -> PlannedSubject:
    image = CameraIntrinsics(120, 90, 100.0, 100.0, 59.5, 44.5)
    rig = around(8, 2.5, intrinsics=image, lens=Lens(0.085, 40.0))
    return subject_of(torus(), rig, PlanRequest("em", 1000, fresh_samples=1000))


def seen_sharp(subject: PlannedSubject, made: list[MaskedPicture], points: NDArray[Any]) -> Any:
    """Whether each point is shown in focus by a picture, by what is there in its depth map."""
    found = np.zeros(len(points), dtype=bool)
    for picture in made:
        camera = subject.rig.cameras[picture.name.camera]
        rotation = rotation_from_quaternion(np.array(camera.orientation))
        x, y, z = ((points - np.array(camera.position)) @ rotation).T
        image = camera.intrinsics
        u = np.rint(image.fx * x / z + image.cx).astype(int)
        v = np.rint(image.fy * y / z + image.cy).astype(int)
        within = (z > 0) & (u >= 0) & (u < image.width) & (v >= 0) & (v < image.height)
        u, v = np.where(within, u, 0), np.where(within, v, 0)
        found |= within & (np.abs(picture.depths[v, u] - z) < 0.02) & picture.mask[v, u]
    return found


@pytest.mark.parametrize("max_blur", [None, 0.5])
def test_what_is_sharp_elsewhere_agrees_with_pixels_themselves(max_blur: float | None) -> None:
    subject = ring()
    made = pictures(subject, max_blur=max_blur)
    blurred, elsewhere = 0, 0
    for picture in made:
        camera = subject.rig.cameras[picture.name.camera]
        v, u = np.nonzero(np.isfinite(picture.depths) & ~picture.mask)
        image, z = camera.intrinsics, picture.depths[v, u].astype(float)
        local = np.stack([(u - image.cx) / image.fx * z, (v - image.cy) / image.fy * z, z], axis=1)
        rotation = rotation_from_quaternion(np.array(camera.orientation))
        points = local @ rotation.T + np.array(camera.position)
        blurred += len(points)
        elsewhere += seen_sharp(subject, made, points).sum()
    assert 0.1 < elsewhere / blurred < 0.98
    estimate = sharp_elsewhere(subject, 20_000, max_blur)
    assert estimate == pytest.approx(elsewhere / blurred, abs=0.04)


def test_where_nothing_is_blurred_nothing_is_sharp_elsewhere() -> None:
    subject = ring()
    cameras = tuple(
        replace(
            camera, shots=tuple(replace(s, near_limit=0.0, far_limit=9.0) for s in camera.shots)
        )
        for camera in subject.plan.cameras
    )
    subject = replace(subject, plan=replace(subject.plan, cameras=cameras))
    assert sharp_elsewhere(subject, 500) is None
