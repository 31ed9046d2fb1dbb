# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A node that plans for the newest of several surfaces together."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from focus_planner import Scene, Subject, plan_focus
from focus_planner.messages.plan_reading import plan_from_message
from focus_planner.parameters.planner_settings import Settings
from focus_planner.recording.run_inputs import SURFACES
from focus_planner.recording.subject import subject_of
from focus_planner.ros.client import PlannerClient
from testing.ros.calls import FEW, having, until
from testing.ros.recorded import assert_reproduced, recorded

pytestmark = pytest.mark.processes

_NAMES = ["mesh 1", "mesh 2", "mesh 3"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Where the module's node records."""
    return tmp_path_factory.mktemp("recorded")


@pytest.fixture(scope="module")
def planner(start_planner, folder):
    return start_planner(*FEW, "-p", "subjects:=3", "-p", f"record_directory:={folder}")


@pytest.fixture
def bodies(body):
    """The body in four sizes, the largest last."""
    scales = 0.92, 0.95, 0.98, 1.01
    return [replace(body, vertices=scale * body.vertices) for scale in scales]


@pytest.fixture
def ready(client, bodies, rig):
    client.publish_rig(rig)
    for number, each in enumerate(bodies):
        client.publish_mesh(each)
        newest = min(number + 1, 3)
        until(lambda newest=newest: len(client.status().subjects) >= newest)
    return client


def test_the_newest_surfaces_are_planned_for_recorded_and_reproduced(ready, folder, bodies, rig):
    answer, run = recorded(ready, folder)
    plan = plan_from_message(answer.plan)
    assert [each.surface for each in plan.subjects] == _NAMES
    assert [each.input.topic[-5:] for each in answer.plan.subjects] == ["/mesh"] * 3
    ages = [each.input.age for each in answer.plan.subjects]
    assert ages == sorted(ages, reverse=True)
    assert answer.plan.surface == answer.plan.subjects[-1].input
    areas = [Scene(each).area for each in bodies[1:]]
    assert [each.surface_area for each in plan.subjects] == pytest.approx(areas)
    assert sum(message.type_name in SURFACES for message in run.inputs) == 3
    assert run.beginning.settings.subjects == 3
    assert_reproduced(run)


def test_the_plan_is_what_the_command_line_would_make(ready, folder, bodies, rig):
    _, run = recorded(ready, folder)
    subjects = [Subject(Scene(each), name) for each, name in zip(bodies[1:], _NAMES, strict=True)]
    request = run.beginning.request
    assert isinstance(run.beginning.settings, Settings)
    same = plan_focus(subjects, rig, request)
    told = run.ending.plan
    assert np.array_equal(same.focus_distances, told.focus_distances)
    assert same.subjects == told.subjects


def test_the_status_tells_which_are_in_force(ready):
    status = ready.status()
    assert len(status.subjects) == 3
    received = [(each.received.sec, each.received.nanosec) for each in status.subjects]
    assert received == sorted(received)
    assert received[-1] == (status.surface.received.sec, status.surface.received.nanosec)


def test_the_worst_may_be_asked_for(ready, folder):
    answer, run = recorded(ready, folder, worst=True)
    plan = plan_from_message(answer.plan)
    assert plan.is_for_worst
    assert plan.cost == max(each.cost for each in plan.subjects)
    assert_reproduced(run)


def test_one_of_a_runs_subjects_is_looked_at(ready, folder, bodies):
    _, run = recorded(ready, folder)
    subject = subject_of(run, name="mesh 2")
    assert np.array_equal(subject.scene.surface.vertices, bodies[2].vertices)
    assert subject.plan.surface_area == run.ending.plan.subjects[1].surface_area


def test_the_parameter_applies_from_the_next_request_on(ready, folder):
    with having(ready, subjects=1):
        answer, run = recorded(ready, folder)
        assert answer.plan.subjects == []
        assert_reproduced(run)


def test_fewer_than_wanted_are_planned_for_with_a_note(start_planner, body, rig):
    planner = start_planner(*FEW, "-p", "subjects:=2")
    with PlannerClient(planner.name) as client:
        client.publish_rig(rig)
        client.publish_mesh(body)
        answer = client.plan()
        assert answer.success
        assert [note.code for note in answer.plan.notes if note.code == "subjects"] == ["subjects"]
