# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Recorded runs of plans within a budget of pictures, replayed and planned otherwise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from focus_planner.cli import main as cli
from focus_planner.core import kernels
from focus_planner.core.planning.request import METHODS, PlanRequest
from focus_planner.recording.comparison import camera_changes, quantities
from focus_planner.recording.replay import differences, plan_run
from focus_planner.recording.run_reading import read_run
from focus_planner.recording.what_if import parse_changes, with_changes
from testing.clock import Clock
from testing.runs import beginning_with, record, solved

LIMITED = PlanRequest("k_view", 150, fresh_samples=100, shots=2, images=6)


def replayed(path):
    run = read_run(path)
    return run, plan_run(run)


@pytest.mark.parametrize("method", METHODS)
def test_a_plan_is_reproduced(tmp_path, method):
    path = record(tmp_path, replace(LIMITED, method=method), markers=True)
    run, again = replayed(path)
    assert run.beginning.request.images == 6
    assert run.ending.plan.pictures <= 6
    assert any(not camera.shots for camera in run.ending.plan.cameras)
    assert differences(run, again) == []


@pytest.mark.parametrize("seconds", [0.5, 2.0, 4.0])
def test_a_plan_that_was_ended_early_is_reproduced(tmp_path, seconds):
    request = replace(LIMITED, time_budget=seconds)
    path = record(tmp_path, request, clock=Clock(0.05))
    run, again = replayed(path)
    assert 1 <= run.ending.plan.pictures <= 6
    assert differences(run, again) == []


def test_a_warm_start_is_reproduced(tmp_path):
    first = solved(beginning_with(LIMITED))
    start = first.warm_start
    assert (start.focus_distances == kernels.UNTAKEN).any()
    path = record(tmp_path, replace(LIMITED, seed=5, images=8), warm_start=start)
    run, again = replayed(path)
    np.testing.assert_array_equal(run.beginning.warm_start.focus_distances, start.focus_distances)
    assert differences(run, again) == []


def test_a_budget_can_be_set_for_a_recorded_run_and_compared(tmp_path, capsys):
    path = record(tmp_path, replace(LIMITED, shots=1, images=0))
    run = read_run(path)
    changed = with_changes(run, parse_changes(["images=3"])).run
    plan = plan_run(changed, stop_as_recorded=False).plan
    assert (plan.images, plan.pictures) == (3, 3)
    told = {name: value for name, value, _ in quantities(plan)}
    assert told["pictures"] == 3
    assert {name: value for name, value, _ in quantities(run.ending.plan)}["pictures"] == 8
    # Where a lens rests without a picture is no change of focus.
    taken = {camera.name for camera in plan.cameras if camera.shots}
    assert {change.name for change in camera_changes(run.ending.plan, plan)} <= taken
    assert cli.main(["replay", str(path), "--set", "images=3"]) in {0, 1}
    out = capsys.readouterr().out
    assert "pictures" in out
    assert "do not compare" not in out
