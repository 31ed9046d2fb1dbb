# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What ``focus_planner replay`` prints: for people, and as JSON for programs."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

from focus_planner.cli.replayed import (
    DIFFERS,
    PLANNED,
    REFUSED,
    REPRODUCED,
    STATUS,
    UNREADABLE,
    ReplayedRun,
)
from focus_planner.cli.terminal import show_error

if TYPE_CHECKING:
    from focus_planner.cli.console import PlainConsole
    from focus_planner.core.planning.plan import FocusPlan
    from focus_planner.recording.comparison import Comparable

_COLOURS = {
    REPRODUCED: "green",
    PLANNED: "cyan",
    DIFFERS: "yellow",
    UNREADABLE: "red",
    REFUSED: "red",
}
_CAMERAS_SHOWN = 10
# Of plans on different samples, these say nothing of each other.
_ON_SAMPLES = ("cost", "lower_bound")
_COSTS = (*_ON_SAMPLES, "fresh_cost")


def show(replays: Sequence[ReplayedRun]) -> None:
    """Print what came of runs: each by itself where there is something to say, then a list."""
    from focus_planner.cli.tables import console_for, path_names

    console = console_for(sys.stdout)
    names = path_names(replay.path for replay in replays)
    for replay, name in zip(replays, names, strict=True):
        if replay.outcome in (UNREADABLE, REFUSED):
            whose = f"{replay.path}: " if replay.outcome == REFUSED and len(replays) > 1 else ""
            show_error(f"{whose}{replay.why}")
        elif (
            replay.outcome == PLANNED
            or len(replays) == 1
            or replay.differences
            or replay.recorded_as
        ):
            _show_one(console, replay, name)
    if len(replays) > 1:
        _show_all(console, replays, names)


def _show_one(console: PlainConsole, replay: ReplayedRun, name: str) -> None:
    say = partial(console.print, soft_wrap=True)
    assert replay.run is not None
    say(name, style="bold", end=" ")
    say(replay.outcome, style=_COLOURS[replay.outcome])
    for note in replay.notes:
        say(f"  note: {note}")
    if replay.outcome == PLANNED:
        _show_comparison(console, replay)
    elif replay.differences:
        for difference in replay.differences:
            say(f"  {difference.stage}", style="bold", end="")
            say(f": {difference.what}")
        for component, (then, now) in _software(replay).items():
            say(f"  {component}: {then} then, {now} now")
    elif replay.now is not None:
        say(f"  {replay.now.summary()}")
    else:
        say(f"  no plan, then as now: {replay.why}")
    for plan_note in replay.now.notes if replay.now else ():
        if plan_note.text not in replay.notes:
            say(f"  note: {plan_note.text}")
    if replay.recorded_as is not None:
        say(f"  recorded: {replay.recorded_as}")


def _show_comparison(console: PlainConsole, replay: ReplayedRun) -> None:
    from focus_planner.cli.tables import new_table
    from focus_planner.recording.comparison import quantities

    before, after = replay.plans
    assert after is not None
    same = _comparable(replay)
    table = new_table("", "recorded", "now", "change", right=(1, 2, 3))
    old = {name: (value, unit) for name, value, unit in quantities(before)} if before else {}
    for name, value, unit in quantities(after):
        then, unit_then = old.get(name, (None, ""))
        change = _change(then, value, share=unit != "s")
        if change and name in _COSTS and same is not None and not same.measure:
            change = "other measure"
        elif change and name in _ON_SAMPLES and same is not None and not same.samples:
            change = "other samples"
        # Older versions did not tell all that is told now.
        told = _text(then, unit_then) if not old or name in old else "not told"
        table.add_row(name.replace("_", " "), told, _text(value, unit), change)
    console.print(table)
    console.print()
    if before is not None:
        if same is not None and (told := same.sentence(before, after)):
            console.print(told)
        _show_cameras(console, before, after)


def _show_cameras(console: PlainConsole, before: FocusPlan, after: FocusPlan) -> None:
    from focus_planner.cli.tables import add_named_rows, new_table
    from focus_planner.recording.comparison import camera_changes, median_moved

    changes = camera_changes(before, after)
    text = f"{len(changes)} of {len(before.cameras)} cameras are focused at other distances"
    if not changes:
        console.print(f"{text}.")
        return
    console.print(f"{text}, by {1e3 * median_moved(changes):.3g} mm in the median.")
    headers = ("farthest", "recorded", "now", "from sensor", "change", "samples", "now")
    table = new_table(*headers, right=range(1, len(headers)))
    rows = []
    for change in changes[:_CAMERAS_SHOWN]:
        moved = 1e3 * (change.after - change.before)
        marked = "" if change.from_sensor_after is None else f"{change.from_sensor_after:.4f} m"
        distances = (f"{change.before:.4f} m", f"{change.after:.4f} m", marked, f"{moved:+.1f} mm")
        rows.append(
            (change.name, (*distances, str(change.samples_before), str(change.samples_after)))
        )
    add_named_rows(table, rows, console)
    console.print()
    console.print(table)


def _show_all(console: PlainConsole, replays: Sequence[ReplayedRun], names: Sequence[str]) -> None:
    """Print a list of the runs, with costs that can be compared: fresh ones of changed runs."""
    from rich.text import Text

    from focus_planner.cli.tables import add_named_rows, new_table

    fresh = any(replay.outcome == PLANNED for replay in replays)
    costs = "fresh cost" if fresh else "cost"
    table = new_table("run", "outcome", "method", "samples", costs, "s", right=(3, 4, 5))
    rows = []
    for replay, name in zip(replays, names, strict=True):
        before, after = replay.plans
        plans = [plan for plan in (before, after) if plan]
        outcome = Text(replay.outcome, _COLOURS[replay.outcome])
        if replay.differences:
            outcome.append(f": {replay.differences[0].stage}")
        elif replay.run and not plans:
            outcome.append(", no plan")
        cells = (
            outcome,
            _then_now(plan.method for plan in plans),
            _then_now(plan.samples for plan in plans),
            _then_now(_costs(plans, fresh=fresh)),
            f"{after.total_seconds:.2f}" if after else "",
        )
        rows.append((name, cells))
    add_named_rows(table, rows, console)
    console.print(table)
    console.print()
    counts = {name: sum(r.outcome == name for r in replays) for name in STATUS}
    console.print(", ".join(f"{count} {name}" for name, count in counts.items() if count))


def _costs(plans: Sequence[FocusPlan], *, fresh: bool) -> Iterator[str]:
    """Yield plans' costs, and what they are for where that differs."""
    from focus_planner.recording.comparison import measure_text, same_measure

    alike = same_measure(plans)
    for plan in plans:
        cost = f"{plan.fresh_cost if fresh else plan.cost:.2f}"
        yield cost if alike else f"{cost} {measure_text(plan)}"


def _then_now(values: Any) -> str:
    """Return what was and what is, once if they are the same."""
    return " → ".join(dict.fromkeys(map(str, values)))


def _comparable(replay: ReplayedRun) -> Comparable | None:
    """Return what of the two plans can be compared; None if there are no two."""
    from focus_planner.recording.comparison import comparable

    if None in replay.plans or replay.run is None or replay.again is None:
        return None
    return comparable(replay.run, replay.again)


def _software(replay: ReplayedRun) -> dict[str, tuple[str, str]]:
    """Return the versions that differ: recorded and present."""
    from focus_planner.recording.software import software

    assert replay.run is not None
    then, now = replay.run.beginning.software, software()
    return {
        name: (then.get(name, "none"), now.get(name, "none"))
        for name in {**then, **now}
        if then.get(name) != now.get(name)
    }


def _text(value: float | str | bool | None, unit: str = "") -> str:
    if value is None:
        return "none"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.3f} {unit}".rstrip() if isinstance(value, float) else str(value)


def _change(then: float | str | bool | None, now: float | str | bool | None, *, share: bool) -> str:
    if not (isinstance(then, float) and isinstance(now, float)):
        return ""
    percent = f" ({100 * (now - then) / then:+.2f} %)" if then and share else ""
    return f"{now - then:+.3f}{percent}"


# --- for programs ------------------------------------------------------------------------------


def as_json(replay: ReplayedRun) -> dict[str, Any]:
    """Return all that there is to say of a run."""
    from focus_planner.io.plans import plan_to_json
    from focus_planner.recording.comparison import camera_changes

    before, after = replay.plans
    ending = replay.run.ending if replay.run else None
    same = _comparable(replay)
    return {
        "run": replay.run.beginning.run_id if replay.run else None,
        "path": str(replay.path),
        "outcome": replay.outcome,
        "message": replay.why,
        "recorded_message": ending.message if ending else None,
        "differences": [vars(difference) for difference in replay.differences],
        "notes": list(replay.notes),
        "software": (
            {
                name: {"recorded": then, "now": now}
                for name, (then, now) in _software(replay).items()
            }
            if replay.run
            else {}
        ),
        "recorded": json.loads(plan_to_json(before)) if before else None,
        "now": json.loads(plan_to_json(after)) if after else None,
        "same_samples": same.samples if same else None,
        "same_fresh_samples": same.fresh_samples if same else None,
        "same_measure": same.measure if same else None,
        "cameras": (
            [vars(change) for change in camera_changes(before, after)] if before and after else []
        ),
        "recorded_as": str(replay.recorded_as) if replay.recorded_as else None,
    }
