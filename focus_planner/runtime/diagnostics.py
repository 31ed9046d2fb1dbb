# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The content of ``/diagnostics``: one status for each part that can fail by itself."""

from __future__ import annotations

import math
import os
import shutil
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from enum import IntEnum
from pathlib import Path

from focus_planner.core.text import printable
from focus_planner.core.validation import first_few
from focus_planner.lenses.driver import LensStatus
from focus_planner.messages.writing import Fields
from focus_planner.parameters.planner_settings import Replan, Settings
from focus_planner.runtime.inputs import InputState
from focus_planner.runtime.replanning import Replanned
from focus_planner.runtime.status import LastRun, LensSummary, PlannerReport, age_of

# As a part of all memory: near what is left when Linux begins to kill processes.
_LOW_MEMORY = 0.05
# Bytes: about one run of a large mesh.
_LOW_DISK = 100_000_000
# Runs that a flood of bad ones may add to every message.
_SKIPPED_SHOWN = 20


class Level(IntEnum):
    """Equal to the constants of ``DiagnosticStatus.msg``."""

    OK = 0
    WARN = 1
    ERROR = 2
    STALE = 3


@dataclass(frozen=True)
class Diagnosis:
    """One status of ``/diagnostics``.

    Attributes
    ----------
    name : str
        The part that it is about.
    level : Level
    message : str
    values : dict of str
    """

    name: str
    level: Level
    message: str
    values: dict[str, str]

    def to_fields(self, node: str) -> Fields:
        """Return a ``DiagnosticStatus`` message from the node with this full name.

        Reasons and names that peers gave are escaped and cut.
        """
        values = {printable(key): printable(value) for key, value in self.values.items()}
        return {
            "level": bytes([self.level]),
            "name": f"{node.removeprefix('/')}: {self.name}",
            "message": printable(self.message),
            "hardware_id": node,
            "values": [{"key": key, "value": value} for key, value in values.items()],
        }


def diagnose(
    report: PlannerReport, lenses: LensSummary, settings: Settings, now: datetime
) -> Iterator[Diagnosis]:
    """Yield what is published of a planner.

    Parameters
    ----------
    report : PlannerReport
    lenses : LensSummary
    settings : Settings
    now : datetime
    """
    snapshot, max_age = report.snapshot, settings.serving.max_input_age
    yield diagnose_planner(report.state, report.planning, report.waiting, report.compiling)
    yield diagnose_input(snapshot.surface, now, max_age)
    yield diagnose_input(snapshot.rig, now, max_age)
    yield diagnose_last_run(snapshot.last_run)
    yield diagnose_cameras(snapshot.last_run, lenses.counts)
    yield diagnose_lens_states(lenses)
    yield diagnose_recorder(
        settings.recording.directory,
        report.recording_failure,
        report.runs_to_write,
        report.skipped_runs,
    )
    yield diagnose_memory(report.planning_pid)
    yield diagnose_replanning(settings.replan, report.replanned)


def diagnose_planner(state: str, planning: str, waiting: int, compiling: str = "") -> Diagnosis:
    """Return the state of the life cycle, and what is being planned, or compiled before."""
    doing = f"planning {planning}" if planning else "idle"
    not_planning = compiling or "not planning"
    message = f"active, {doing}" if state == "active" else f"{state}: {not_planning}"
    level = Level.OK if state == "active" else Level.WARN
    values = {"state": state, "planning": planning, "waiting requests": str(waiting)}
    return Diagnosis("planner", level, message, values)


def diagnose_input(state: InputState, now: datetime, max_age: float) -> Diagnosis:
    """Return where an input came from, how old it is, and whether a newer one was refused."""
    age = age_of(state, now)
    values = {"topic": state.topic, "refused": state.refused, "not received": state.unheard}
    if state.received:
        seconds, nanoseconds = state.stamp
        values |= {
            "received": state.received.isoformat(),
            "age [s]": f"{age:.3f}",
            "stamp [s]": f"{seconds}.{nanoseconds:09}" if any(state.stamp) else "",
        }
    if not state.received:
        level, message = Level.WARN, "none that can be used" if state.refused else "none yet"
        message += f"; not received: {state.unheard}" if state.unheard else ""
    elif state.refused:
        level, message = Level.WARN, f"a newer one was refused: {state.refused}"
    elif state.unheard:
        level, message = Level.WARN, f"from {state.topic}; not received: {state.unheard}"
    elif age > max_age:
        level, message = Level.WARN, f"{age:.1f} s old, more than max_input_age ({max_age:g} s)"
    else:
        level, message = Level.OK, f"from {state.topic}, {age:.1f} s ago"
    return Diagnosis(state.name, level, message, values)


def diagnose_last_run(run: LastRun | None) -> Diagnosis:
    """Return how the last request ended, how long it took, and how good its plan is."""
    if run is None:
        return Diagnosis("last run", Level.OK, "none yet", {})
    values = {"plan_id": run.plan_id, "seconds": f"{run.seconds:.3f}"}
    if run.plan is None:
        return Diagnosis("last run", Level.WARN, f"no plan: {run.message}", values)
    plan = run.plan
    values |= {
        "method": plan.method,
        "cost": f"{plan.cost:.3f}",
        "gap": "" if plan.gap is None else f"{plan.gap:.6f}",
        "fresh cost": f"{plan.fresh_cost:.3f} ± {plan.fresh_standard_error:.3f}",
        "solve seconds": f"{plan.solve_seconds:.3f}",
        "converged": str(plan.converged).lower(),
        **{f"note: {note.code}": note.text for note in plan.notes},
    }
    return Diagnosis("last run", Level.OK, run.message, values)


def diagnose_replanning(replan: Replan, replanned: Replanned) -> Diagnosis:
    """Return what became of the surfaces that were to be planned for without being asked."""
    counts = {name: value for name, value in vars(replanned).items() if name != "failure"}
    values = {"replan": replan.mode, **{name: str(count) for name, count in counts.items()}}
    if not replan.is_on:
        return Diagnosis("replanning", Level.OK, "off (parameter replan)", values)
    if replanned.failure:
        bad = f"no plan for the newest surface: {replanned.failure}"
        return Diagnosis("replanning", Level.WARN, bad, values)
    told = ", ".join(f"{name} {count}" for name, count in counts.items())
    return Diagnosis("replanning", Level.OK, f"surfaces: {told}", values)


def diagnose_cameras(run: LastRun | None, lenses: Counter[int]) -> Diagnosis:
    """Return which cameras see nothing, and how many lenses are in which status."""
    plan, seeing_nothing = (run.plan, run.cameras_seeing_nothing) if run else (None, [])
    values = {state.name.lower(): str(lenses[state]) for state in LensStatus}
    values |= {"see nothing": " ".join(seeing_nothing)}
    if plan is not None:
        values["cameras"] = str(len(plan.cameras))
    if lenses[LensStatus.FAILED] or lenses[LensStatus.DIFFERS]:
        failed, differ = lenses[LensStatus.FAILED], lenses[LensStatus.DIFFERS]
        bad = f"lenses that failed: {failed}, that differ from the plan: {differ}"
        return Diagnosis("cameras", Level.ERROR, bad, values)
    # That a driver took a value is no word of the lens.
    accepted = lenses[LensStatus.ACCEPTED]
    rest = f"; lenses whose drivers took the value, not seen there: {accepted}" if accepted else ""
    if seeing_nothing:
        bad = f"see nothing: {first_few(seeing_nothing, 8)}"
        return Diagnosis("cameras", Level.WARN, bad + rest, values)
    good = "all see the surface" if plan else "no plan yet"
    return Diagnosis("cameras", Level.OK, good + rest, values)


def diagnose_lens_states(lenses: LensSummary) -> Diagnosis:
    """Return who publishes states of lenses, and whether some were refused."""
    values = {
        "published by": lenses.publishers,
        "refused": str(lenses.refused),
        "last refused": lenses.refusal,
    }
    by = f"published by {lenses.publishers}" if lenses.publishers else "nobody publishes any"
    if lenses.refused:
        bad = f"refused since the plan: {lenses.refused}, the last: {lenses.refusal}; {by}"
        return Diagnosis("lens states", Level.WARN, bad, values)
    return Diagnosis("lens states", Level.OK, by, values)


def diagnose_recorder(
    directory: Path | None,
    failure: str,
    jobs: int,
    skipped: Sequence[tuple[str, str]] = (),
) -> Diagnosis:
    """Return where runs are recorded, and whether the last one that ended was.

    Also how much space is left, and which runs were skipped when the last plan was looked for.
    """
    values = {f"skipped {run}": why for run, why in skipped[:_SKIPPED_SHOWN]}
    if directory is None:
        return Diagnosis("recorder", Level.OK, "off (parameter record_directory)", values)
    values |= {"record_directory": str(directory), "runs to write": str(jobs)}
    free = _free_bytes(directory)
    if free is not None:
        values["free bytes"] = str(free)
    if failure:
        return Diagnosis("recorder", Level.ERROR, f"not recorded: {failure}", values)
    if free is not None and free < _LOW_DISK:
        return Diagnosis("recorder", Level.WARN, f"only {free} bytes of disk space left", values)
    if skipped:
        names = first_few((run for run, _ in skipped), 3)
        bad = f"runs that cannot be read, skipped in the search for the last plan: {names}"
        return Diagnosis("recorder", Level.WARN, bad, values)
    return Diagnosis("recorder", Level.OK, f"recording to {directory}", values)


def diagnose_memory(planning_pid: int | None = None) -> Diagnosis:
    """Return the memory that node and planning process use, and what the machine has left (Linux).

    Parameters
    ----------
    planning_pid : int, optional
        The planning process.
    """
    kilobytes = _proc("/proc/self/status", "VmRSS", "VmHWM")
    planning = _proc(f"/proc/{planning_pid}/status", "VmRSS", "VmHWM") if planning_pid else {}
    kilobytes |= {f"planning {name}": size for name, size in planning.items()}
    kilobytes |= _proc("/proc/meminfo", "MemTotal", "MemAvailable")
    values = {f"{name} [MB]": f"{size / 1024:.0f}" for name, size in kilobytes.items()}
    used = [kilobytes[name] / 1024 for name in ("VmRSS", "planning VmRSS") if name in kilobytes]
    message = " + ".join(f"{size:.0f} MB" for size in used) or "not known"
    available = kilobytes.get("MemAvailable", math.inf)
    if available < _LOW_MEMORY * kilobytes.get("MemTotal", 0):
        message += f"; only {available / 1024:.0f} MB are available on this machine"
        return Diagnosis("memory", Level.WARN, message, values)
    return Diagnosis("memory", Level.OK, message, values)


def _free_bytes(directory: Path) -> int | None:
    try:
        there = next((each for each in (directory, *directory.parents) if each.exists()), None)
        return shutil.disk_usage(there).free if there else None
    except OSError:
        return None


def _proc(path: str | os.PathLike[str], *names: str) -> dict[str, int]:
    """Return some values from a file of Linux's ``/proc``, kB; none where it does not exist."""
    try:
        lines = Path(path).read_text(encoding="utf-8").splitlines()
    except OSError:
        return {}
    values = dict(line.split(":", 1) for line in lines if ":" in line)
    return {name: int(values[name].split()[0]) for name in names if name in values}
