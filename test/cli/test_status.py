# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""``focus_planner status``: what a planner says, as people and programs read it."""

from __future__ import annotations

import io
import json
import math
import sys
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest

from focus_planner.cli import main as cli
from focus_planner.cli.status import exit_status
from focus_planner.cli.status_text import show
from focus_planner.lenses.driver import LensStatus
from focus_planner.messages.typestore import fields_of, message_of

NOW = 1_800_000_000  # 2027-01-15 08:00:00 UTC
STATUS = "focus_planner_msgs/msg/PlannerStatus"
COUNTS = {
    LensStatus.UNREPORTED: "unreported",
    LensStatus.SENT: "sent",
    LensStatus.VERIFIED: "verified",
    LensStatus.DIFFERS: "differ",
    LensStatus.FAILED: "failed",
    LensStatus.ACCEPTED: "accepted",
}


def at(seconds: float) -> dict[str, int]:
    return {"sec": NOW + int(seconds), "nanosec": 0}


def lens(name: str, status: LensStatus, message: str = "", read: float = math.nan) -> Any:
    return {
        "name": name,
        "status": int(status),
        "planned_distance": 0.5,
        "read_distance": read,
        "message": message,
    }


def planner_status(*lenses: Any, **fields: Any) -> dict[str, Any]:
    counts = {
        name: sum(each["status"] == status for each in lenses) for status, name in COUNTS.items()
    }
    plan = {
        "plan_id": "20270115T075900Z-1a2b",
        "planned_at": at(-60),
        "plan_surface": {"topic": "/focus_planner/mesh", "age": 2.5},
        "plan_rig": {"topic": "/focus_planner/rig", "age": 300.0},
        "lenses": list(lenses),
    }
    told = {
        "header": {"stamp": at(0)},
        "state": "active",
        "surface": {"topic": "/focus_planner/mesh", "received": at(-62.5), "age": 62.5},
        "rig": {"age": math.nan},
        **(plan if lenses else {}),
    }
    return fields_of(message_of(STATUS, told | counts | fields))


def standing(status: dict[str, Any], age: float = 0.5) -> Any:
    plan = {"method": "k_view", "cost": 231.94, "lower_bound": 231.21}
    return SimpleNamespace(node="/focus_planner", status=status, age=age, plan=plan)


def shown(status: dict[str, Any], age: float = 0.5, *, cameras: bool = False) -> str:
    stream = io.StringIO()
    show(standing(status, age), stream, cameras=cameras)
    lines = [line.rstrip() for line in stream.getvalue().splitlines()]
    assert max(map(len, lines)) <= 80
    return "\n".join(lines)


def test_of_a_planner_that_has_nothing_it_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    text = shown(planner_status(state="inactive", surface={"age": math.nan}))
    assert "node     /focus_planner: inactive, planning nothing" in text
    assert "plan     none in force" in text
    assert "surface  none" in text
    assert "rig      none" in text
    assert "lenses" not in text
    assert "nan" not in text


def test_plan_lenses_and_inputs_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    lenses = [
        lens("a", LensStatus.VERIFIED, read=0.5),
        lens("b", LensStatus.VERIFIED, read=0.5),
        lens("c", LensStatus.ACCEPTED, read=0.5),
        lens("d", LensStatus.FAILED, "the driver /d/camera does not answer"),
        lens("e", LensStatus.UNREPORTED),
    ]
    text = shown(
        planner_status(
            *lenses,
            planning="20270115T080000Z-3c4d",
            waiting=2,
            from_record=True,
            lens_state_publishers=["/lens_adapter"],
            rig={"age": math.nan, "refused": "cameras: expected some, got none"},
        )
    )
    assert "active, planning 20270115T080000Z-3c4d, 2 requests wait" in text
    assert "plan     20270115T075900Z-1a2b" in text
    assert "k_view, cost 231.9, where none costs less than 231.2" in text
    assert "2027-01-15 07:59:00 UTC, 60.0 s before this status; restored" in text
    assert "on the surface of /focus_planner/mesh, 2.5 s old then" in text
    assert "on the rig of /focus_planner/rig, 5 min old then" in text
    assert "5 planned: 2 verified, 1 accepted, 1 failed, 1 unreported" in text
    assert "by /lens_adapter" in text
    assert "surface  /focus_planner/mesh, 62.5 s old" in text
    assert "one was refused: cameras: expected some, got none" in text
    table = text.partition("camera  ")[2]
    assert "d " in table
    assert "does not answer" in table
    assert "\ne " not in table


def test_several_subjects_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    surfaces = [{"topic": "/focus_planner/mesh", "age": age} for age in (90.0, 70.0, 62.5)]
    told = standing(planner_status(lens("a", LensStatus.VERIFIED), subjects=surfaces))
    told.plan["subjects"] = [
        {"surface": "mesh 1", "fresh_cost": 320.0},
        {"surface": "mesh 2", "fresh_cost": 330.0},
    ]
    stream = io.StringIO()
    show(told, stream)
    assert "for 2 subjects, the worst mesh 2" in stream.getvalue()
    assert "picture" not in stream.getvalue()
    text = " ".join(stream.getvalue().split())
    assert "together with 2 before it, the oldest on /focus_planner/mesh, 90.0 s old" in text


def test_a_budget_of_pictures_is_told() -> None:
    told = standing(planner_status(lens("a", LensStatus.VERIFIED)))
    told.plan["images"] = 60
    stream = io.StringIO()
    show(told, stream)
    assert "of at most 60 pictures with all cameras together" in stream.getvalue()


def test_a_lens_that_nobody_reports_is_not_called_anything_better() -> None:
    text = shown(planner_status(lens("a", LensStatus.UNREPORTED)))
    assert "1 planned: 1 unreported" in text
    assert "nobody reports lenses" in text
    assert "verified" not in text


def test_an_old_status_says_how_old_it_is() -> None:
    status = planner_status(lens("a", LensStatus.VERIFIED))
    assert "it is" not in shown(status, 1.0)
    assert "it is 37.0 s old" in shown(status, 37.0)


def test_many_failures_are_counted_and_all_cameras_listed_on_request() -> None:
    lenses = [lens(f"cam_{i:03}", LensStatus.FAILED, "gone") for i in range(12)]
    text = shown(planner_status(*lenses, lens("fine", LensStatus.SENT)))
    assert "cam_009" in text
    assert "cam_010" not in text
    assert "and 2 more: --cameras lists all" in text
    text = shown(planner_status(*lenses, lens("fine", LensStatus.SENT)), cameras=True)
    assert "cam_011" in text
    assert "fine" in text


def test_what_peers_say_cannot_move_the_cursor() -> None:
    text = shown(planner_status(lens("a", LensStatus.FAILED, "\x1b[2J[red]x[/red]")))
    assert r"\x1b[2J[red]x[/red]" in text


@pytest.mark.parametrize(
    ("lenses", "status"),
    [
        ((), 3),
        ((LensStatus.VERIFIED, LensStatus.ACCEPTED), 0),
        ((LensStatus.VERIFIED, LensStatus.UNREPORTED), 5),
        ((LensStatus.VERIFIED, LensStatus.SENT), 5),
        ((LensStatus.FAILED, LensStatus.UNREPORTED), 4),
        ((LensStatus.VERIFIED, LensStatus.DIFFERS), 4),
    ],
)
def test_the_exit_status_tells_whether_lenses_are_set(
    lenses: tuple[LensStatus, ...], status: int
) -> None:
    told = [lens(f"cam_{i}", each) for i, each in enumerate(lenses)]
    assert exit_status(planner_status(*told)) == status


def test_as_json_it_has_every_field(monkeypatch: pytest.MonkeyPatch, capsys: Any) -> None:
    lenses = [lens("a", LensStatus.VERIFIED, read=math.inf)]
    stand_in = ModuleType("focus_planner.ros.reaching")
    answer = standing(planner_status(*lenses))
    vars(stand_in).update(standing_of=lambda *_: answer, NotReached=OSError)
    monkeypatch.setitem(sys.modules, stand_in.__name__, stand_in)
    assert cli.main(["status", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told.items() >= {"node": "/focus_planner", "method": "k_view", "verified": 1}.items()
    assert told["rig"]["age"] is None
    assert told["lenses"][0]["read_distance"] == "inf"
    assert set(told) >= set(planner_status())


@pytest.mark.parametrize(
    ("words", "telling"),
    [
        (["--timeout", "0"], "--timeout: expected seconds, above 0, got 0"),
        (["--node", "a b"], "--node: expected letters, digits and underscores"),
        (["--node", "/rig_1/"], "--node: expected a node's name"),
    ],
)
def test_bad_options_are_refused(words: list[str], telling: str, capsys: Any) -> None:
    assert cli.main(["status", *words]) == 2
    assert telling in capsys.readouterr().err
