# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What a planner says of itself, as tables for people."""

from __future__ import annotations

import math
from collections.abc import Iterator
from datetime import datetime, timedelta, timezone
from typing import TYPE_CHECKING, Any, TextIO

from rich.table import Table

from focus_planner.cli.console import PlainConsole
from focus_planner.lenses.driver import LensStatus

if TYPE_CHECKING:
    from focus_planner.ros.reaching import Standing

# Seconds: a status that is older is not from a node that works as it should.
_OLD = 5.0
_MOST_LENSES = 10
# In the order of their worth.
_WORDS = {
    LensStatus.VERIFIED: "verified",
    LensStatus.ACCEPTED: "accepted",
    LensStatus.SENT: "sent",
    LensStatus.DIFFERS: "differs",
    LensStatus.FAILED: "failed",
    LensStatus.UNREPORTED: "unreported",
}
_TROUBLE = (LensStatus.FAILED, LensStatus.DIFFERS)

Row = tuple[str, str]


def show(standing: Standing, stream: TextIO, *, cameras: bool = False) -> None:
    """Print what a planner says of itself.

    Parameters
    ----------
    standing : Standing
    stream : file
    cameras : bool
        Whether to list all cameras, not only those whose lens failed or differs.
    """
    console = PlainConsole(stream)
    table = Table.grid(padding=(0, 2))
    for name, text in _rows(standing):
        table.add_row(name, text)
    console.print(table)
    status = standing.status
    shown = [lens for lens in status["lenses"] if cameras or LensStatus(lens["status"]) in _TROUBLE]
    if shown:
        console.print()
        console.print(_lens_table(shown if cameras else shown[:_MOST_LENSES]))
    if not cameras and len(shown) > _MOST_LENSES:
        console.print(f"and {len(shown) - _MOST_LENSES} more: --cameras lists all")


def _rows(standing: Standing) -> Iterator[Row]:
    status = standing.status
    yield "node", f"{standing.node}: {_doing(status)}"
    heard = datetime.now(timezone.utc) - timedelta(seconds=standing.age)
    late = f": it is {_span(standing.age)} old" if standing.age > _OLD else ""
    yield "status", f"of {heard:%H:%M:%S} UTC{late}"
    yield from _plan_rows(standing)
    yield from _lens_rows(status)
    for kind in ("surface", "rig"):
        yield from _input_rows(kind, status[kind])
        if kind == "surface" and len(status["subjects"]) > 1:
            oldest = status["subjects"][0]
            others = f"together with {len(status['subjects']) - 1} before it"
            yield "", f"{others}, the oldest on {oldest['topic']}, {_old(oldest['age'])}"


def _doing(status: dict[str, Any]) -> str:
    waiting = status["waiting"]
    planning = f"planning {status['planning']}" if status["planning"] else "planning nothing"
    waits = "1 request waits" if waiting == 1 else f"{waiting} requests wait"
    return f"{status['state']}, {planning}" + (f", {waits}" if waiting else "")


def _plan_rows(standing: Standing) -> Iterator[Row]:
    status, plan = standing.status, standing.plan
    if not status["plan_id"]:
        yield "plan", "none in force"
        return
    yield "plan", status["plan_id"]
    if plan is None:
        yield "", "its method and its cost were not heard"
    else:
        bound = plan["lower_bound"]
        best = "" if math.isnan(bound) else f", where none costs less than {bound:.1f}"
        yield "", f"{plan['method']}, cost {plan['cost']:.1f}{best}"
        if images := plan.get("images", 0):
            yield "", f"of at most {images} picture{'s' * (images > 1)} with all cameras together"
        subjects = plan.get("subjects", [])
        if subjects:
            worst = max(subjects, key=lambda each: float(each["fresh_cost"]))
            yield "", f"for {len(subjects)} subjects, the worst {worst['surface']}"
    made, now = _seconds(status["planned_at"]), _seconds(status["header"]["stamp"])
    restored = "; restored from its record since" if status["from_record"] else ""
    yield "", f"made {_clock(made)}, {_span(now - made)} before this status{restored}"
    for kind in ("surface", "rig"):
        told = status[f"plan_{kind}"]
        yield (
            "",
            f"on the {kind} of {told['topic'] or 'an unknown topic'}, {_old(told['age'])} then",
        )


def _lens_rows(status: dict[str, Any]) -> Iterator[Row]:
    lenses = status["lenses"]
    if not status["plan_id"]:
        return
    counts = dict.fromkeys(_WORDS, 0)
    for lens in lenses:
        counts[LensStatus(lens["status"])] += 1
    parts = [f"{n} {_counted(each, n)}" for each, n in counts.items() if n]
    yield "lenses", f"{len(lenses)} planned: {', '.join(parts)}"
    publishers = status["lens_state_publishers"]
    yield "", f"by {', '.join(publishers)}" if publishers else "nobody reports lenses"


def _counted(status: LensStatus, count: int) -> str:
    return "differ" if status is LensStatus.DIFFERS and count > 1 else _WORDS[status]


def _input_rows(kind: str, told: dict[str, Any]) -> Iterator[Row]:
    if told["topic"]:
        yield kind, f"{told['topic']}, {_old(told['age'])}, received {_clock_of(told['received'])}"
    else:
        yield kind, "none"
    if told["refused"]:
        yield (
            "",
            f"a newer one was refused: {told['refused']}"
            if told["topic"]
            else (f"one was refused: {told['refused']}"),
        )
    if told["unheard"]:
        yield "", f"not received: {told['unheard']}"


def _lens_table(lenses: list[dict[str, Any]]) -> Table:
    table = Table(box=None, padding=(0, 2, 0, 0), header_style="bold")
    table.add_column("camera", overflow="fold")
    table.add_column("lens")
    for name in ("planned", "read"):
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("as reported", overflow="fold")
    for lens in lenses:
        table.add_row(
            lens["name"],
            _WORDS[LensStatus(lens["status"])],
            _metres(lens["planned_distance"]),
            _metres(lens["read_distance"]),
            lens["message"],
        )
    return table


def _metres(distance: float) -> str:
    return "-" if math.isnan(distance) else f"{distance:.3f} m"


def _seconds(time: dict[str, int]) -> float:
    return time["sec"] + time["nanosec"] / 1e9


def _clock_of(time: dict[str, int]) -> str:
    return _clock(_seconds(time))


def _clock(seconds: float) -> str:
    return f"{datetime.fromtimestamp(seconds, timezone.utc):%Y-%m-%d %H:%M:%S} UTC"


def _old(age: float) -> str:
    return "of unknown age" if math.isnan(age) else f"{_span(age)} old"


def _span(seconds: float) -> str:
    """Return a length of time in the unit that suits it."""
    if seconds < 100:
        return f"{seconds:.1f} s"
    minutes, hours = seconds / 60, seconds / 3600
    if minutes < 100:
        return f"{minutes:.0f} min"
    return f"{hours:.0f} h" if hours < 48 else f"{hours / 24:.0f} days"
