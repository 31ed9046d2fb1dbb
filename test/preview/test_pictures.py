# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

import io
import math
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from focus_planner import Lens, PlanRequest, Rig, Scene, cylinder_rig, plan_focus
from focus_planner.core.imaging.exposure import BACKGROUND, PictureCamera
from focus_planner.core.imaging.resolution import fine_pixels
from focus_planner.core.planning.subject import PlannedSubject
from focus_planner.preview.figures import contact_sheets, figure
from focus_planner.preview.pictures import note_on_circles, previews, thumbnails
from testing.problems import sphere


@pytest.fixture(scope="module")
def subject():
    scene = Scene(sphere(0.2))
    rig = cylinder_rig(rows=2, columns=3, radius=0.7, bottom=-0.1, top=0.1)
    request = PlanRequest(samples=200, shots=2, fresh_samples=100)
    return PlannedSubject(scene, rig, request, plan_focus(scene, rig, request))


def test_every_shot_has_a_picture_that_tells_its_share_in_focus(subject):
    view, camera = PictureCamera(subject.scene), subject.rig.cameras[4]
    focus = subject.plan.cameras[4]
    tolerance = 0.004
    plan = replace(subject.plan, depth_tolerance=tolerance)
    shown = list(previews(view, camera, plan, 4, 0.25))
    assert [each.shot for each in shown] == [1, 2]
    depths = view.depths(camera, 0.25)
    for each, shot in zip(shown, focus.shots, strict=True):
        seen = depths[np.isfinite(depths)]
        sharp = (seen >= shot.near_limit + tolerance) & (seen <= shot.far_limit - tolerance)
        assert sharp.mean() < ((seen >= shot.near_limit) & (seen <= shot.far_limit)).mean()
        assert each.in_focus == pytest.approx(sharp.mean(), abs=1e-3)
        assert each.image.shape == (*depths.shape, 3)


def test_what_is_imaged_more_coarsely_than_asked_is_not_counted(subject):
    view, camera = PictureCamera(subject.scene), subject.rig.cameras[4]
    most = 0.8 * 1000 * 0.7 / camera.intrinsics.fx  # about as coarse as the nearest of it
    whole, part = (
        next(previews(view, camera, replace(subject.plan, max_mm_per_pixel=limit), 4, 0.25))
        for limit in (math.inf, most)
    )
    assert 0 < part.in_focus < whole.in_focus
    depths = view.depths(camera, 0.25)
    there = np.isfinite(depths)
    shot = subject.plan.cameras[4].shots[0]
    sharp = shot.holds(depths[there], 0.0) & fine_pixels(depths, camera, most, 0.25)[there]
    assert part.in_focus == pytest.approx(sharp.mean())


def test_a_camera_that_sees_nothing_has_a_picture_of_the_background(subject):
    away = replace(subject.rig.cameras[0], position=(50.0, 50.0, 50.0))
    shown = next(previews(PictureCamera(subject.scene), away, subject.plan, 0, 0.1))
    assert np.isnan(shown.in_focus)
    assert (shown.image == BACKGROUND).all()
    assert figure([shown]).width > shown.image.shape[1]
    assert len(contact_sheets([[shown]], "one")) == 1


def test_thumbnails_are_webp_in_the_rigs_order(subject):
    shares = []
    content = list(thumbnails(subject, subject.plan, 90, shares.append))
    assert len(content) == len(subject.rig)
    assert shares == sorted(shares)
    assert shares[-1] == 1
    pictures = [Image.open(io.BytesIO(each)) for each in content]
    assert {(picture.format, picture.size) for picture in pictures} == {("WEBP", (60, 90))}


def test_what_is_assumed_of_the_blur_is_told(subject):
    rig = subject.rig
    assert note_on_circles(rig).startswith(
        "nothing tells the circle of confusion of 6 of 6 cameras: "
    )
    known = replace(rig.cameras[0], lens=Lens(circle_of_confusion=2e-5))
    mixed = Rig((known, *rig.cameras[1:]))
    assert "of 5 of 6 cameras" in note_on_circles(mixed)
    assert note_on_circles(Rig((known,))) == ""


def test_many_cameras_are_on_several_pages(subject):
    view = PictureCamera(subject.scene)
    cell = list(previews(view, subject.rig.cameras[0], subject.plan, 0, 0.02))[:1]
    assert len(contact_sheets([cell] * 241, "many")) == 2
