# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Diagnostics: every level and every text."""

from __future__ import annotations

import os
import re
import shutil
from collections import Counter, namedtuple
from dataclasses import replace
from datetime import datetime, timedelta, timezone
from pathlib import Path

import pytest

from focus_planner.core.planning.plan import CameraStatus
from focus_planner.core.text import MAX_LINE
from focus_planner.lenses.driver import LensStatus
from focus_planner.messages.typestore import deserialize, serialize
from focus_planner.parameters.planner_settings import Replan, Settings
from focus_planner.runtime import diagnostics as module
from focus_planner.runtime.diagnostics import (
    Diagnosis,
    Level,
    diagnose,
    diagnose_cameras,
    diagnose_input,
    diagnose_last_run,
    diagnose_lens_states,
    diagnose_memory,
    diagnose_planner,
    diagnose_recorder,
    diagnose_replanning,
)
from focus_planner.runtime.inputs import InputState
from focus_planner.runtime.replanning import Replanned
from focus_planner.runtime.status import LastRun, LensSummary, PlannerReport, Snapshot
from testing.made_up_runs import ending

NOW = datetime(2025, 1, 1, 12, 0, 10, tzinfo=timezone.utc)
NOTHING = InputState("rig")
SURFACE = InputState("surface", "/planner/mesh", NOW - timedelta(seconds=2.5), (12, 34))
PLAN = ending().plan
NONE = Counter()


def run(plan=PLAN, message="em, cost 1.0"):
    return LastRun("a name", message, plan, 1.25)


def seeing_nothing(*places, cameras=3):
    """A plan whose cameras at these places see nothing."""
    status = dict.fromkeys(places, CameraStatus.SEES_NOTHING)
    camera = PLAN.cameras[0]
    return replace(
        PLAN,
        cameras=tuple(
            replace(camera, name=f"cam_{k}", status=status.get(k, CameraStatus.PLANNED))
            for k in range(cameras)
        ),
    )


def reported(diagnosis):
    return diagnosis.level, diagnosis.message


def test_it_is_a_status_of_the_node():
    diagnosis = Diagnosis("rig", Level.ERROR, "gone", {"age [s]": "1.000", "topic": ""})
    fields = diagnosis.to_fields("/left/planner")
    assert fields == {
        "level": b"\x02",
        "name": "left/planner: rig",
        "message": "gone",
        "hardware_id": "/left/planner",
        "values": [{"key": "age [s]", "value": "1.000"}, {"key": "topic", "value": ""}],
    }


# --- the planner -------------------------------------------------------------------------------


def test_a_planner_that_compiles_says_so():
    diagnosis = diagnose_planner("unconfigured", "", 0, "compiling, once, about 3 min, 25%, 41.0 s")
    assert diagnosis.message == "unconfigured: compiling, once, about 3 min, 25%, 41.0 s"
    assert diagnosis.level is Level.WARN


@pytest.mark.parametrize(
    ("state", "planning", "expected"),
    [
        ("active", "", (Level.OK, "active, idle")),
        ("active", "a name", (Level.OK, "active, planning a name")),
        ("inactive", "", (Level.WARN, "inactive: not planning")),
        ("unconfigured", "", (Level.WARN, "unconfigured: not planning")),
    ],
)
def test_the_planner(state, planning, expected):
    diagnosis = diagnose_planner(state, planning, 3)
    assert diagnosis.name == "planner"
    assert reported(diagnosis) == expected
    assert diagnosis.values == {"state": state, "planning": planning, "waiting requests": "3"}


# --- inputs ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("state", "max_age", "expected"),
    [
        (NOTHING, 60.0, (Level.WARN, "none yet")),
        (replace(NOTHING, refused="bad"), 60.0, (Level.WARN, "none that can be used")),
        (SURFACE, 60.0, (Level.OK, "from /planner/mesh, 2.5 s ago")),
        (SURFACE, 2.5, (Level.OK, "from /planner/mesh, 2.5 s ago")),
        (SURFACE, 2.4, (Level.WARN, "2.5 s old, more than max_input_age (2.4 s)")),
        (
            replace(SURFACE, refused="mesh: bad"),
            2.4,
            (Level.WARN, "a newer one was refused: mesh: bad"),
        ),
    ],
)
def test_an_input(state, max_age, expected):
    diagnosis = diagnose_input(state, NOW, max_age)
    assert reported(diagnosis) == expected
    assert diagnosis.name == state.name
    assert diagnosis.values["refused"] == state.refused


def test_the_age_of_an_input():
    values = diagnose_input(SURFACE, NOW, 60.0).values
    assert values == {
        "topic": "/planner/mesh",
        "refused": "",
        "not received": "",
        "received": "2025-01-01T12:00:07.500000+00:00",
        "age [s]": "2.500",
        "stamp [s]": "12.000000034",
    }
    assert diagnose_input(replace(SURFACE, stamp=(0, 0)), NOW, 60.0).values["stamp [s]"] == ""
    without = {"topic": "", "refused": "", "not received": ""}
    assert diagnose_input(NOTHING, NOW, 60.0).values == without


def test_a_publisher_that_is_not_received():
    unheard = "/scanner publishes best effort"
    diagnosis = diagnose_input(replace(NOTHING, unheard=unheard), NOW, 60.0)
    assert reported(diagnosis) == (Level.WARN, f"none yet; not received: {unheard}")
    diagnosis = diagnose_input(replace(SURFACE, unheard=unheard), NOW, 60.0)
    assert reported(diagnosis) == (Level.WARN, f"from /planner/mesh; not received: {unheard}")


# --- the last run ------------------------------------------------------------------------------


def test_the_last_run():
    assert reported(diagnose_last_run(None)) == (Level.OK, "none yet")
    diagnosis = diagnose_last_run(run())
    assert reported(diagnosis) == (Level.OK, "em, cost 1.0")
    assert diagnosis.values["seconds"] == "1.250"
    assert diagnosis.values["cost"] == f"{PLAN.cost:.3f}"
    assert diagnosis.values["note: winding"] == "half of it"
    assert diagnosis.values["gap"] == ""
    assert diagnosis.values["converged"] == "true"
    near = replace(PLAN, cost=4.0, lower_bound=3.0, converged=False)
    values = diagnose_last_run(run(near)).values
    assert (values["gap"], values["converged"]) == ("0.250000", "false")


def test_a_run_without_a_plan():
    diagnosis = diagnose_last_run(run(None, "surface: none yet"))
    assert reported(diagnosis) == (Level.WARN, "no plan: surface: none yet")
    assert diagnosis.values == {"plan_id": "a name", "seconds": "1.250"}


# --- cameras -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("run_", "lenses", "expected"),
    [
        (None, NONE, (Level.OK, "no plan yet")),
        (run(None), NONE, (Level.OK, "no plan yet")),
        (run(), Counter({LensStatus.VERIFIED: 3}), (Level.OK, "all see the surface")),
        (
            run(),
            Counter({LensStatus.VERIFIED: 1, LensStatus.ACCEPTED: 2}),
            (
                Level.OK,
                "all see the surface; lenses whose drivers took the value, not seen there: 2",
            ),
        ),
        (run(seeing_nothing(1)), NONE, (Level.WARN, "see nothing: cam_1")),
        (
            run(seeing_nothing(1)),
            Counter({LensStatus.FAILED: 1}),
            (Level.ERROR, "lenses that failed: 1, that differ from the plan: 0"),
        ),
        (
            run(),
            Counter({LensStatus.DIFFERS: 2, LensStatus.SENT: 1}),
            (Level.ERROR, "lenses that failed: 0, that differ from the plan: 2"),
        ),
    ],
)
def test_cameras(run_, lenses, expected):
    assert reported(diagnose_cameras(run_, lenses)) == expected


def test_of_many_cameras_that_see_nothing_some_are_named():
    diagnosis = diagnose_cameras(
        run(seeing_nothing(*range(20), cameras=30)), Counter({LensStatus.UNREPORTED: 30})
    )
    some = ", ".join(f"cam_{k}" for k in range(8))
    assert diagnosis.message == f"see nothing: {some} and 12 more"
    assert diagnosis.values["see nothing"].split() == [f"cam_{k}" for k in range(20)]
    assert (diagnosis.values["cameras"], diagnosis.values["unreported"]) == ("30", "30")
    assert (diagnosis.values["verified"], diagnosis.values["accepted"]) == ("0", "0")


# --- recorder, memory --------------------------------------------------------------------------

Usage = namedtuple("Usage", "total used free")  # noqa: PYI024 - as shutil has it


@pytest.fixture
def free(monkeypatch):
    def is_free(count):
        monkeypatch.setattr(shutil, "disk_usage", lambda _: Usage(10**12, 0, count))

    return is_free


def test_no_recorder():
    diagnosis = diagnose_recorder(None, "", 0)
    assert reported(diagnosis) == (Level.OK, "off (parameter record_directory)")


def test_a_recorder_that_works(free, tmp_path):
    free(10**9)
    diagnosis = diagnose_recorder(tmp_path / "not" / "yet", "", 2)
    assert reported(diagnosis) == (Level.OK, f"recording to {tmp_path}/not/yet")
    assert diagnosis.values["runs to write"] == "2"
    assert diagnosis.values["free bytes"] == str(10**9)


def test_a_recorder_that_fails(free, tmp_path):
    free(10)
    diagnosis = diagnose_recorder(tmp_path, "run a in b: No space", 0)
    assert reported(diagnosis) == (Level.ERROR, "not recorded: run a in b: No space")


def test_runs_that_were_skipped(free, tmp_path):
    free(10**9)
    skipped = [(f"run {k}", f"why {k}") for k in range(30)]
    diagnosis = diagnose_recorder(tmp_path, "", 0, skipped[:2])
    assert reported(diagnosis) == (
        Level.WARN,
        "runs that cannot be read, skipped in the search for the last plan: run 0, run 1",
    )
    assert diagnosis.values["skipped run 1"] == "why 1"
    assert len(diagnose_recorder(tmp_path, "", 0, skipped).values) < 25
    assert diagnose_recorder(tmp_path, "no space", 0, skipped).level == Level.ERROR


def test_a_disk_that_is_nearly_full(free, tmp_path):
    free(99_999_999)
    assert reported(diagnose_recorder(tmp_path, "", 0)) == (
        Level.WARN,
        "only 99999999 bytes of disk space left",
    )


def test_a_disk_of_unknown_free_space(monkeypatch, tmp_path):
    def fail(_):
        raise PermissionError

    monkeypatch.setattr(shutil, "disk_usage", fail)
    diagnosis = diagnose_recorder(tmp_path, "", 0)
    assert diagnosis.level is Level.OK
    assert "free bytes" not in diagnosis.values


@pytest.mark.parametrize("name", ["a" * 300, "null\0"])
def test_an_impossible_directory_does_no_harm(name):
    assert diagnose_recorder(Path("/", name), "", 0).level is Level.OK


@pytest.mark.skipif(not os.path.exists("/proc/meminfo"), reason="Linux tells of its memory")  # noqa: PTH110
def test_memory():
    diagnosis = diagnose_memory()
    assert re.match(r"\d+ MB", diagnosis.message)
    values = {name: int(value) for name, value in diagnosis.values.items()}
    assert 0 < values["VmRSS [MB]"] <= values["VmHWM [MB]"] < values["MemTotal [MB]"]


@pytest.mark.parametrize(
    ("available", "expected"),
    [
        (50_000, (Level.OK, "200 MB")),
        (49_000, (Level.WARN, "200 MB; only 48 MB are available on this machine")),
    ],
)
def test_little_memory(monkeypatch, available, expected):
    numbers = {"VmRSS": 204_800, "VmHWM": 300_000, "MemTotal": 10**6, "MemAvailable": available}
    monkeypatch.setattr(module, "_proc", lambda _, *names: {name: numbers[name] for name in names})
    assert reported(diagnose_memory()) == expected


def test_without_proc_memory_is_unknown(monkeypatch):
    monkeypatch.setattr(module, "_proc", lambda *_: {})
    assert reported(diagnose_memory()) == (Level.OK, "not known")


def test_nobody_publishes_states_of_lenses():
    diagnosis = diagnose_lens_states(LensSummary(NONE))
    assert reported(diagnosis) == (Level.OK, "nobody publishes any")
    named = diagnose_lens_states(LensSummary(NONE, publishers="/a"))
    assert reported(named) == (Level.OK, "published by /a")


def test_what_became_of_surfaces_is_told_once_they_are_to_be_planned_for():
    replanned = Replanned(planned=3, stale=2, refused=1, waiting=1)
    off = diagnose_replanning(Replan(), replanned)
    assert reported(off) == (Level.OK, "off (parameter replan)")
    on = diagnose_replanning(Replan("rate", 5.0), replanned)
    told = "surfaces: planned 3, stale 2, refused 1, failed 0, waiting 1"
    assert reported(on) == (Level.OK, told)
    assert on.values["replan"] == "rate"
    assert on.values["stale"] == "2"
    failing = replace(replanned, failed=1, failure="too many samples")
    bad = diagnose_replanning(Replan("on_surface"), failing)
    assert reported(bad) == (Level.WARN, "no plan for the newest surface: too many samples")


def test_a_diagnosis_fits_the_message():
    diagnosis = diagnose_cameras(run(seeing_nothing(0)), NONE)
    fields = diagnosis.to_fields("/planner") | {"level": diagnosis.level}
    kind = "diagnostic_msgs/msg/DiagnosticStatus"
    message = deserialize(kind, serialize(kind, fields))
    assert {each.key: each.value for each in message.values} == diagnosis.values


def test_every_part_of_a_planner_is_diagnosed(tmp_path):
    settings = Settings.from_values({"max_input_age": 2.0, "record_directory": str(tmp_path)})
    report = PlannerReport(
        "active", "a name", 1, Snapshot(SURFACE, NOTHING, run()), "run a: No space", 3
    )
    lenses = LensSummary(Counter({LensStatus.SENT: 3}), 2, "read_value: bad", "/a, /b")
    found = list(diagnose(report, lenses, settings, NOW))
    assert [diagnosis.name for diagnosis in found] == [
        "planner",
        "surface",
        "rig",
        "last run",
        "cameras",
        "lens states",
        "recorder",
        "memory",
        "replanning",
    ]
    messages = [reported(diagnosis) for diagnosis in found]
    assert messages[:7] == [
        (Level.OK, "active, planning a name"),
        (Level.WARN, "2.5 s old, more than max_input_age (2 s)"),
        (Level.WARN, "none yet"),
        (Level.OK, "em, cost 1.0"),
        (Level.OK, "all see the surface"),
        (
            Level.WARN,
            "refused since the plan: 2, the last: read_value: bad; published by /a, /b",
        ),
        (Level.ERROR, "not recorded: run a: No space"),
    ]
    assert found[4].values["sent"] == "3"
    assert found[6].values["runs to write"] == "3"


def test_what_peers_gave_is_reported_escaped_and_cut():
    hostile = "\x1b[2J\u202e\n[ERROR] forged\x9b"
    told = r"\x1b[2J\u202e [ERROR] forged\x9b"
    state = replace(SURFACE, refused=hostile, unheard="x" * 5_000_000)
    fields = diagnose_input(state, NOW, 5.0).to_fields("/planner")
    assert fields["message"] == f"a newer one was refused: {told}"
    values = {each["key"]: each["value"] for each in fields["values"]}
    assert values["refused"] == told
    assert len(values["not received"]) <= MAX_LINE
