# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What a recorded run tells of its plan."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from focus_planner.messages.typestore import CLOUD, RIG
from focus_planner.recording.bag import BagMessage
from focus_planner.recording.provenance import input_names
from focus_planner.recording.run import Run
from focus_planner.recording.run_reading import read_run
from testing.runs import record

MESH, OWN_RIG = "/focus_planner/mesh", "/focus_planner/rig"


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    return read_run(Path(record(tmp_path_factory.mktemp("runs"))))


def test_inputs_are_called_by_their_topics(run: Run) -> None:
    assert input_names(run) == (MESH, OWN_RIG)
    assert input_names(replace(run, inputs=())) == ("", "")


def test_what_was_refused_is_not_taken_for_what_was_planned_on(run: Run) -> None:
    refused = (
        BagMessage("/focus_planner/cloud", CLOUD, b"nothing", run.beginning.at),
        BagMessage("/focus_planner/rig", RIG, b"nothing", run.beginning.at),
    )
    surface, rig = input_names(replace(run, inputs=(*run.inputs, *refused)))
    assert surface == f"{MESH} (a newer one, on /focus_planner/cloud, was refused)"
    assert rig == f"{OWN_RIG} (a newer one, on /focus_planner/rig, was refused)"


def test_the_newest_of_several_is_what_was_planned_on(run: Run) -> None:
    older = replace(run.inputs[0], topic="/focus_planner/old")
    assert input_names(replace(run, inputs=(older, *run.inputs)))[0] == MESH
