# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Reports of plans within a budget of pictures, as a person reads them."""

from __future__ import annotations

import re

import pytest

from focus_planner import CameraStatus, PlanRequest, Rig, Scene, plan_focus
from focus_planner.core.planning.subject import PlannedSubject
from focus_planner.report.assembly import assemble
from focus_planner.report.comparison import ComparedPlan
from focus_planner.report.making import write_report
from testing.opened_report import Opened, chromium
from testing.plans import away
from testing.problems import around, merged, sphere

pytestmark = pytest.mark.processes

REQUEST = PlanRequest("em", samples=150, fresh_samples=250, shots=2, images=4)


@pytest.fixture(scope="module")
def subject():
    surface = merged(sphere(0.25, subdivisions=3), sphere(0.09, (0.0, -0.36, 0.05)))
    rig = Rig((*around(7, 1.0, height=0.35).cameras, away()))
    scene = Scene(surface)
    return PlannedSubject(scene, rig, REQUEST, plan_focus(scene, rig, REQUEST))


@pytest.fixture(scope="module")
def content(subject):
    """A report of the plan beside one with as many pictures as one likes."""
    whole = plan_focus(subject.scene, subject.rig, PlanRequest("em", 150, fresh_samples=250))
    beside = ComparedPlan("all cameras", "every camera takes one", whole, subject.rig)
    return assemble(subject, (beside,), samples=400)


@pytest.fixture(scope="module")
def opened(content, tmp_path_factory):
    path = tmp_path_factory.mktemp("report") / "report.html"
    write_report(content, path)
    with chromium() as browser, Opened(browser, path) as opened:
        yield opened


def idle(subject):
    return [c for c, camera in enumerate(subject.plan.cameras) if not camera.shots]


def test_points_are_explained_by_the_cameras_that_take_pictures(opened, content, subject):
    names = [camera.name for camera in subject.rig.cameras]
    surface, told_of_idle, unseen = content.surface, 0, 0
    for x in (0.18, 0.22, 0.26, 0.3, 0.34, 0.38):
        for y in (0.3, 0.4, 0.5, 0.6, 0.7):
            opened.click_picture(x, y)
            if opened.inspector.get_attribute("data-kind") != "point":
                continue
            p = int(opened.inspector.get_attribute("data-index"))
            part = slice(*surface.pair_offsets[p : p + 2])
            in_view = {names[c] for c in surface.pair_camera[part]}
            resting = in_view & {names[c] for c in idle(subject)}
            rows = opened.inspector.get_by_label("Cameras that see it").locator("tbody tr").all()
            listed = {row.locator("td, th").first.inner_text() for row in rows}
            assert listed == in_view - resting
            summaries = opened.inspector.locator("summary").all_inner_texts()
            said = [text for text in summaries if "takes no picture" in text]
            if resting:
                assert said == [f"it takes no picture, as pictures are limited: {len(resting)}"]
                told_of_idle += 1
            else:
                assert not said
            if resting and not listed:
                text = opened.inspector.inner_text()
                assert re.search(r"In view of \d+ cameras? that takes? no picture", text)
                assert "Allow more pictures, and take one with" in text
                unseen += 1
    assert told_of_idle > 3
    assert not opened.complaints


def test_a_camera_without_a_picture_is_said_to_take_none(opened, subject):
    for c in idle(subject):
        name = subject.rig.cameras[c].name
        opened.page.locator("#cameras th.name button", has_text=name).first.click()
        assert opened.selected("camera") == c
        text = opened.inspector.inner_text()
        nothing = subject.plan.cameras[c].status is CameraStatus.SEES_NOTHING
        expected = "Sees none of the samples" if nothing else "Takes no picture, as pictures are"
        assert expected in text
    assert not opened.complaints


def test_costs_and_the_verdict_tell_of_so_many_pictures(content, subject):
    assert len(idle(subject)) == 4
    told, beside = (each.plan for each in content.plans)
    assert (told.pictures, beside.pictures) == (4, 8)
    rows = {row.title: row for row in content.costs}
    assert rows["lower bound, 4 pictures"].cost <= told.cost
    # What costs less has more of them.
    assert rows["all cameras"].fresh_cost < rows["em"].fresh_cost
    assert "is in no picture" in content.verdict
    facts = dict(content.sheet.facts)
    assert facts["pictures"] == "4, of at most 4"
    assert len(content.sheet.rows) == 8
