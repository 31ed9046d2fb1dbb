# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Malformed messages over DDS: the node says so, and goes on with what it has."""

from __future__ import annotations

import numpy as np
import pytest

from focus_planner.core.planning.plan_focus import plan_focus
from focus_planner.core.planning.request import PlanRequest
from focus_planner.core.surface.scene import Scene
from focus_planner.messages.cdr import write_mesh
from focus_planner.messages.plan_reading import plan_from_message
from focus_planner.ros.client import PlannerClient
from testing.malformed import BALL, READ, RIG, Bench, absurd, broken

pytestmark = pytest.mark.processes

MESSAGES = 24
REQUEST = {"method": "em", "samples": 200}


@pytest.fixture(scope="module")
def planner(start_planner):
    return start_planner("-p", "fresh_samples:=256", "-p", "max_triangles:=1000")


@pytest.fixture(scope="module")
def client(planner):
    with PlannerClient(planner.name) as client:
        client.publish_rig(RIG)
        client.publish_mesh(BALL)
        # Both are in force before anything worse arrives: of what nobody has read yet, the newest
        # that is valid by itself counts.
        assert client.plan(**REQUEST).success
        yield client


@pytest.fixture(scope="module")
def expected():
    return plan_focus(Scene(BALL), RIG, PlanRequest(fresh_samples=256, **REQUEST)).cameras


def cameras_of(response):
    assert response.success, response.message
    return plan_from_message(response.plan).cameras


def malformed(topic):
    """Yield messages that the library refuses."""
    bench, random, sent = Bench(), np.random.default_rng(1), 0
    while sent < MESSAGES:
        payload = (absurd, broken)[sent % 2](topic, random)
        if bench.refuses(topic, payload):
            sent += 1
            yield payload


@pytest.mark.parametrize("topic", list(READ))
def test_a_node_goes_on_with_what_it_has(planner, client, expected, topic):
    for payload in malformed(topic):
        client.publish(topic, payload)
        told = client.plan(**REQUEST)
        assert not told.success
        assert "stays in force: call again to plan with that one" in told.message
    assert cameras_of(client.plan(**REQUEST)) == expected
    assert "Traceback" not in planner.log
    assert "internal error" not in planner.log


def test_a_mesh_above_the_limit_is_refused(client, expected):
    fine = write_mesh(np.tile(BALL.triangles, (10, 1)), BALL.vertices)
    client.publish("mesh", fine)
    told = client.plan(**REQUEST)
    assert told.message.startswith(
        f"mesh: expected at most 1,000 triangles (parameter max_triangles), got"
        f" {10 * len(BALL.triangles):,}; simplify the mesh, or raise the parameter"
    )
    assert cameras_of(client.plan(**REQUEST)) == expected
