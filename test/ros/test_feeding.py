# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""``focus_planner publish`` and ``status`` with a real node."""

from __future__ import annotations

import json
import signal

import numpy as np
import pytest

from focus_planner import save_rig
from focus_planner.cli import main as cli
from focus_planner.cli import publish, status
from focus_planner.io.bodies import body as body_path
from focus_planner.ros import feeding, status_watch
from focus_planner.ros.client import PlannerClient
from testing.ros.calls import FEW, until
from testing.ros.planner_process import PATIENCE, PlannerProcess

pytestmark = pytest.mark.processes

BODY = str(body_path("arms_down"))


@pytest.fixture(autouse=True)
def patience(monkeypatch):
    """Have commands wait as long as a busy machine may need."""
    monkeypatch.setattr(publish, "_TIMEOUT", float(PATIENCE))
    for module in (publish, status):
        monkeypatch.setattr(module, "PATIENCE", float(PATIENCE))


@pytest.fixture(scope="module")
def planner(start_planner):
    return start_planner(*FEW)


@pytest.fixture(scope="module")
def files(tmp_path_factory, rig):
    folder = tmp_path_factory.mktemp("files")
    save_rig(rig, folder / "rig.yaml")
    text = (folder / "rig.yaml").read_text()
    (folder / "mars.yaml").write_text(text.replace("frame_id: world", "frame_id: mars"))
    ball = np.random.default_rng(0).normal(size=(500, 3))
    ball *= 0.3 / np.linalg.norm(ball, axis=1)[:, None]
    np.savetxt(folder / "ball.xyz", ball + [0, 0, 0.9])
    return folder


@pytest.fixture
def command(planner, capsys):
    """Run a command on the node; return its exit status and what it printed and said."""

    def command(name, *words):
        ended = cli.main([name, "--node", planner.name, *map(str, words)])
        return ended, *capsys.readouterr()

    return command


def test_from_nothing_to_a_plan_without_python(command, planner, files):
    ended, out, _ = command("status")
    assert ended == 3
    assert "plan     none in force" in out
    ended, out, err = command("publish", BODY)
    assert (ended, out) == (
        0,
        f"{planner.name} has the surface arms_down.ply, a mesh of 27,420 triangles\n",
    )
    assert f"{planner.name} has no rig yet, and cannot plan without" in err
    ended, out, err = command("publish", "--rig", files / "rig.yaml", "--plan", "--method", "em")
    assert ended == 0, err
    has, planned = out.splitlines()
    assert has == f"{planner.name} has the rig rig.yaml of 32 cameras"
    plan_id = planned.partition(":")[0]
    assert ": em, cost " in planned
    ended, out, _ = command("status")
    assert ended == 5
    assert f"plan     {plan_id}" in out
    assert "em, cost" in out
    assert "32 planned: 32 unreported" in out
    ended, out, _ = command("status", "--json")
    told = json.loads(out)
    assert (told["plan_id"], told["method"], told["unreported"]) == (plan_id, "em", 32)
    assert told["plan_rig"]["topic"] == f"{planner.name}/rig"


def test_what_is_published_twice_is_found_again(command, files):
    """Nothing but the time of its arrival, or its stamp, tells the second from the first."""
    for words in ([BODY], [files / "ball.xyz"], ["--rig", files / "rig.yaml"]):
        assert [command("publish", *words)[0] for _ in range(2)] == [0, 0]


def test_a_cloud_takes_the_frame_of_the_rig_or_of_the_node(command, planner, files):
    ended, out, _ = command("publish", files / "ball.xyz", "--rig", files / "rig.yaml")
    assert ended == 0
    assert "the surface ball.xyz, a cloud of 500 points, and the rig rig.yaml of 32" in out
    assert command("publish", files / "ball.xyz", "--quiet")[:2] == (0, "")
    ended, out, err = command("publish", files / "ball.xyz", "--rig", files / "mars.yaml")
    assert (ended, out) == (1, "")
    assert f"{planner.name} refused the surface: header.frame_id: expected 'world'" in err
    assert f"{planner.name} refused the rig: header.frame_id: expected 'world'" in err


def test_a_refusal_that_was_there_before_is_told_as_well(command, files, monkeypatch):
    monkeypatch.setattr(feeding, "_SECONDS_TO_REPEAT", 0.0)
    for _ in range(2):
        ended, _, err = command("publish", "--rig", files / "mars.yaml")
        assert ended == 1
        assert "refused the rig: header.frame_id: expected 'world'" in err
    # And one that is good is not taken for the refused one.
    monkeypatch.undo()
    monkeypatch.setattr(publish, "_TIMEOUT", float(PATIENCE))
    assert command("publish", "--rig", files / "rig.yaml")[0] == 0


def test_a_node_that_asks_for_what_is_latched_hears_it_too(files, capsys):
    durability = "qos_overrides./asks/mesh.subscription.durability:=transient_local"
    planner = PlannerProcess("asks", "-p", durability)
    try:
        assert cli.main(["publish", BODY, "--node", "asks"]) == 0
    finally:
        assert planner.stop() == 0
    assert capsys.readouterr().out.startswith("/asks has the surface")


def test_one_that_is_not_active_says_what_to_do(start_planner, capsys, monkeypatch):
    monkeypatch.setattr(publish, "PATIENCE", 0.5)
    planner = start_planner("-p", "autostart:=false")
    with PlannerClient(planner.name) as client:
        client.status()
        said = until(lambda: inactive(planner, capsys))
        assert (
            f"{planner.name} is unconfigured, and reads nothing until it is active:"
            f" ros2 lifecycle set {planner.name} configure, then activate"
        ) in said
        assert client.change_state("configure")
        said = until(lambda: "is inactive" in (text := inactive(planner, capsys)) and text)
        assert f"ros2 lifecycle set {planner.name} activate" in said
        assert client.change_state("activate")
    monkeypatch.setattr(publish, "PATIENCE", float(PATIENCE))
    assert cli.main(["publish", BODY, "--node", planner.name]) == 0


def inactive(planner, capsys):
    """Return why it does not take a surface, once it was discovered in time."""
    assert cli.main(["publish", BODY, "--node", planner.name]) == 1
    said = capsys.readouterr().err
    return said if "reads nothing" in said else ""


@pytest.mark.parametrize("name", ["publish", "status"])
def test_planners_of_other_names_are_named(planner, capsys, monkeypatch, name):
    for module in (publish, status):
        monkeypatch.setattr(module, "PATIENCE", 0.5)

    def said():
        words = [BODY] if name == "publish" else []
        assert cli.main([name, *words, "--node", "/rig_9/nobody"]) == 1
        return capsys.readouterr().err

    text = until(lambda: planner.name in (text := said()) and text)
    assert "no planner /rig_9/nobody answered within 0.5 s on ROS domain" in text
    assert "(discovery range LOCALHOST), where there are: " in text
    assert "choose with --node" in text


@pytest.mark.parametrize("name", ["publish", "status"])
def test_ctrl_c_ends_the_wait(name, monkeypatch, capsys):
    wait = status_watch.wait_for_event

    def interrupted(*how):
        signal.raise_signal(signal.SIGINT)
        return wait(*how)

    monkeypatch.setattr(status_watch, "wait_for_event", interrupted)
    words = [BODY] if name == "publish" else []
    assert cli.main([name, *words, "--node", "/nobody"]) == 130
    assert capsys.readouterr() == ("", "")
