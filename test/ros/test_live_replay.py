# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Recorded runs played into a running node."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from focus_planner.cli.main import main
from focus_planner.core.validation import InputError
from focus_planner.messages.typestore import RIG, definition_of, fields_of, serialize
from focus_planner.parameters.planner import DECLARATIONS
from focus_planner.recording.bag import BagWriter
from focus_planner.recording.bag_reading import read_bag
from focus_planner.recording.replay import outcome_differences
from focus_planner.recording.run_reading import read_run
from focus_planner.ros.client import PlannerClient
from focus_planner.ros.live_replay import replay_live
from testing.ros.calls import FEW, having, until
from testing.ros.recorded import (
    assert_reproduced,
    cloud_payload,
    mesh_payload,
    moved,
    recorded,
    rig_payload,
    whole,
)

pytestmark = pytest.mark.processes

BAGS = Path(__file__).parents[2] / "bags"
NAMES = [d.name for d in DECLARATIONS]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("recorded")


@pytest.fixture(scope="module")
def planner(start_planner, folder):
    """The node that records."""
    return start_planner(*FEW, "-p", f"record_directory:={folder}")


@pytest.fixture(scope="module")
def live(start_planner):
    """Another, with parameters of its own, to play runs into."""
    own = {"samples": 50, "k": 3, "shots": 2, "lens.focus_distances": "[0.7,0.9]", "seed": 9}
    arguments = [part for n, v in own.items() for part in ("-p", f"{n}:={v}")]
    return start_planner(*arguments, "-p", "time_budget:=600.0", "-p", "warm_start:=true")


@pytest.fixture(scope="module")
def of_live(live):
    with PlannerClient(live.name) as client:
        yield client


@pytest.fixture(scope="module")
def runs(client, folder, body, rig):
    """Runs of every kind."""
    made = {"nothing yet": recorded(client, folder)[1]}
    client.publish_mesh(body)
    client.publish_rig(rig)
    for method in ("em", "k_view", "optimal"):
        made[method] = recorded(client, folder, method=method, seed=3)[1]
    made["of no method"] = recorded(client, folder, method="guess")[1]
    client.publish_rig(moved(rig, 1000))
    made["refused rig"] = recorded(client, folder)[1]
    made["after it"] = recorded(client, folder)[1]
    client.publish("mesh", mesh_payload(body, rig, False))
    client.publish_poses(rig)
    with having(client, lens__hyperfocal_distance=14.0, method="em", cost__focus_weight=0.2):
        made["poses"] = recorded(client, folder)[1]
    client.publish("cloud", cloud_payload(body, rig, False))
    client.publish("rig", rig_payload(body, rig, False))
    made["cloud"] = recorded(client, folder)[1]
    client.publish("rig", b"\x00\x01\x00\x00")
    made["no message"] = recorded(client, folder)[1]
    with having(client, warm_start=True):
        recorded(client, folder)
        made["warm"] = recorded(client, folder)[1]
    return made


@pytest.fixture
def impatient(monkeypatch):
    """A client that soon gives up."""
    monkeypatch.setattr("focus_planner.ros.client._TIMEOUT", 0.5)
    monkeypatch.setattr(PlannerClient.wait_for_node, "__defaults__", (0.5,))


def rewritten(run, folder, type_name, **changed):
    """Return the path of a copy of a run, with fields of one of its messages changed."""
    bag = BagWriter()
    bag.open(folder / run.path.name)
    for message in read_bag(run.path).messages:
        payload = message.payload
        if message.type_name.endswith(f"/{type_name}"):
            payload = serialize(message.type_name, fields_of(message.read()) | changed)
        bag.add(replace(message, payload=payload))
    return bag.close()


def command(*arguments):
    return main(["replay", "--live", "--quiet", *map(str, arguments)])


GOOD = ["k_view", "optimal", "poses", "cloud", "after it"]


@pytest.mark.parametrize("name", GOOD)
def test_a_run_is_reproduced_by_another_node(runs, live, of_live, name):
    own = of_live.get_parameters(NAMES)
    ending = replay_live(runs[name], live.name)
    assert outcome_differences(runs[name], ending) == []
    assert ending.success is runs[name].ending.success
    assert of_live.get_parameters(NAMES) == own


def test_requests_that_failed_fail_alike_in_a_new_node(runs, start_planner):
    planner = start_planner()
    for name in ("nothing yet", "of no method", "refused rig", "no message", "em"):
        ending = replay_live(runs[name], planner.name)
        assert outcome_differences(runs[name], ending) == [], name


def test_a_node_that_has_planned_refuses_alike(runs, live):
    replay_live(runs["em"], live.name)
    for name in ("refused rig", "em", "no message"):
        ending = replay_live(runs[name], live.name)
        assert outcome_differences(runs[name], ending) == [], name


def test_the_command_tells_of_all_that_are_reproduced(runs, live, folder, capsys):
    paths = [runs[name].path for name in ("em", "poses")]
    assert command(*paths, "--node", live.name) == 0
    assert "2 reproduced" in capsys.readouterr().out
    assert command(paths[0], "--node", live.name, "--json") == 0
    (told,) = json.loads(capsys.readouterr().out)
    assert told["outcome"] == "reproduced"
    assert told["now"]["cost"] == told["recorded"]["cost"]


def test_a_node_that_answers_otherwise_is_told_of(runs, live, tmp_path, capsys):
    run = runs["k_view"]
    cameras = plan_message(run).cameras
    cameras[3] = replace(cameras[3], focus_distance=cameras[3].focus_distance + 0.01)
    tampered = rewritten(run, tmp_path, "FocusPlan", cost=run.ending.plan.cost + 1, cameras=cameras)
    assert command(tampered, "--node", live.name) == 1
    told = capsys.readouterr().out
    assert "differs" in told
    assert f"cost {run.ending.plan.cost + 1!r} then, {run.ending.plan.cost!r} now" in told
    assert f"1 of 32 cameras; the farthest, {cameras[3].name}, by 10 mm" in told
    assert command(run.path, tampered, "--node", live.name) == 1
    assert "1 reproduced, 1 differs" in capsys.readouterr().out


def plan_message(run):
    (message,) = [m for m in read_bag(run.path).messages if m.type_name.endswith("/FocusPlan")]
    return message.read()


def test_a_plan_where_there_was_none_is_told_of(runs, live, of_live, body, rig, capsys):
    of_live.publish_mesh(body)
    of_live.publish_rig(rig)
    assert command(runs["nothing yet"].path, "--node", live.name) == 1
    told = capsys.readouterr().out
    assert "recorded: surface: expected a mesh" in told
    assert "now: a plan of cost" in told


def test_the_nodes_parameters_are_those_recorded_while_it_plans(runs, live, of_live, monkeypatch):
    wanted = dict(runs["poses"].beginning.settings.values)
    own = of_live.get_parameters(NAMES)
    seen = []
    plan = PlannerClient.plan

    def looking(client, *arguments, **request):
        seen.append(client.get_parameters(NAMES))
        return plan(client, *arguments, **request)

    monkeypatch.setattr(PlannerClient, "plan", looking)
    replay_live(runs["poses"], live.name)
    differing = {name for name in NAMES if own[name] != seen[0][name]}
    assert {"samples", "k", "seed", "lens.focus_distances", "warm_start", "method"} <= differing
    for declaration in DECLARATIONS:
        name, expected = declaration.name, wanted if declaration.plans else own
        assert seen[0][name] == expected[name], name
    assert of_live.get_parameters(NAMES) == own


@pytest.mark.parametrize("method", ["publish", "plan"])
def test_the_nodes_parameters_are_put_back_when_it_fails(
    runs, live, of_live, monkeypatch, method, capsys
):
    own = of_live.get_parameters(NAMES)

    def failing(*_, **__):
        raise TimeoutError("too late")

    monkeypatch.setattr(PlannerClient, method, failing)
    assert command(runs["em"].path, "--node", live.name) == 2
    assert one_line(capsys) == (
        f"focus_planner: error: --node: expected a running planner, got {live.name}: too late"
    )
    assert of_live.get_parameters(NAMES) == own


def test_the_nodes_parameters_are_put_back_when_one_interrupts(runs, live, of_live, monkeypatch):
    own = of_live.get_parameters(NAMES)

    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(PlannerClient, "plan", interrupted)
    assert command(runs["em"].path, "--node", live.name) == 130
    assert of_live.get_parameters(NAMES) == own


def one_line(capsys):
    told = capsys.readouterr()
    assert told.out == ""
    (line,) = told.err.splitlines()
    return line


def test_a_node_in_another_frame_is_refused_with_the_remedy(runs, live, of_live, tmp_path, capsys):
    run = runs["em"]
    own = of_live.get_parameters(NAMES)
    (message,) = [m for m in read_bag(run.path).messages if m.type_name.endswith("/Run")]
    parameters = fields_of(message.read())["parameters"]
    for parameter in parameters:
        if parameter["name"] == "frame_id":
            parameter["value"]["string_value"] = "stage"
    other = rewritten(run, tmp_path, "Run", parameters=parameters)
    assert command(other, "--node", live.name) == 2
    assert one_line(capsys) == (
        "focus_planner: error: the node's frame_id: expected 'stage', got 'world';"
        " start it with -p frame_id:=stage"
    )
    assert of_live.get_parameters(NAMES) == own


def test_where_there_is_no_node_one_line_says_so(runs, capsys, impatient):
    assert command(runs["em"].path, "--node", "/nobody") == 2
    line = one_line(capsys)
    assert line.startswith("focus_planner: error: --node: expected a running planner, got /nobody")
    assert "is the node running?" in line


def test_lens_tables_reach_the_node_without_their_file(live, of_live, capsys):
    assert command(BAGS / "lens_tables", "--node", live.name) == 0
    assert "reproduced" in capsys.readouterr().out
    assert of_live.get_parameters(["lens_tables"]) == {"lens_tables": ""}


@pytest.mark.parametrize("bag", ["mesh_em", "mesh_optimal"])
def test_a_rig_of_an_older_definition_reaches_the_node(live, bag, capsys):
    (message,) = [m for m in read_bag(BAGS / bag).messages if m.type_name == RIG]
    assert message.definition != definition_of(RIG)
    assert command(BAGS / bag, "--node", live.name) == 0
    assert "reproduced" in capsys.readouterr().out


def test_what_no_message_can_say_is_refused_in_one_line(live, capsys):
    assert command(BAGS / "files_importance", "--node", live.name) == 2
    line = one_line(capsys)
    assert "one with normals or importance per vertex; replay it without --live" in line


def test_a_run_that_the_clock_ended_is_refused_in_one_line(live, capsys):
    assert command(BAGS / "mesh_budget", "--node", live.name) == 2
    assert "one that a time budget or its caller ended; replay it without --live" in one_line(
        capsys
    )


def test_a_run_that_started_from_another_is_refused_in_one_line(runs, live, capsys):
    assert_reproduced(runs["warm"])
    assert command(runs["warm"].path, "--node", live.name) == 2
    line = one_line(capsys)
    assert "one that started from the plan before it; replay it without --live" in line


def test_what_cannot_be_played_is_refused_before_a_node_is_looked_for(tmp_path, capsys):
    assert command(tmp_path / "none", "--node", "/nobody") == 2
    assert "no such folder or file" in one_line(capsys)
    assert command(tmp_path, "--set", "k=3") == 2
    assert "--live" in one_line(capsys)


def test_others_are_played_after_one_that_is_refused(runs, live, capsys):
    assert command(runs["warm"].path, runs["em"].path, "--node", live.name) == 2
    told = capsys.readouterr()
    assert "1 reproduced, 1 refused" in told.out
    assert len(told.err.splitlines()) == 1


def test_a_partial_run_is_refused(runs, live, tmp_path, capsys):
    cut = tmp_path / "cut.mcap"
    (file,) = runs["em"].path.glob("*.mcap")
    cut.write_bytes(file.read_bytes()[:-600])
    assert command(cut, "--node", live.name) == 2
    assert "partial" in one_line(capsys)
    with pytest.raises(InputError):
        read_run(file.parent / "none")


def test_the_node_records_what_is_played_into_it(runs, live, of_live, tmp_path):
    with having(of_live, record_directory=str(tmp_path)):
        replay_live(runs["poses"], live.name)
    (path,) = until(lambda: list(whole(tmp_path).values()))
    again = read_run(path)
    assert outcome_differences(runs["poses"], again.ending) == []
    assert [m.payload for m in again.inputs] == [m.payload for m in runs["poses"].inputs]
    assert_reproduced(again)
