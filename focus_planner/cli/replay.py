"""``focus_planner replay``: planning recorded runs again, unchanged or with changes."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from focus_planner.cli.interrupts import ctrl_c
from focus_planner.cli.option_rules import check_beside
from focus_planner.cli.progress import Tell, show_progress, show_share, shown
from focus_planner.cli.recording import (
    NOT_RECORDED,
    PLANNER,
    CommandRecorder,
    add_recording_options,
    recorder_of,
)
from focus_planner.cli.replay_report import check_single, report_replay
from focus_planner.cli.reporting import (
    REPORT_HELP,
    ReportOptions,
    add_pictures_option,
    check_pictures,
    collect_steps,
)
from focus_planner.cli.terminal import show_error
from focus_planner.core.validation import InputError

if TYPE_CHECKING:
    from focus_planner.cli.console import PlainConsole
    from focus_planner.core.planning.plan import FocusPlan
    from focus_planner.parameters.declaration import Value
    from focus_planner.recording.replay import Difference
    from focus_planner.recording.run import Run

_REPRODUCED, _PLANNED, _DIFFERS = "reproduced", "planned", "differs"
_UNREADABLE, _REFUSED = "unreadable", "refused"
_STATUS = {_REPRODUCED: 0, _PLANNED: 0, _DIFFERS: 1, _UNREADABLE: 2, _REFUSED: 2}
_COLOURS = {
    _REPRODUCED: "green",
    _PLANNED: "cyan",
    _DIFFERS: "yellow",
    _UNREADABLE: "red",
    _REFUSED: "red",
}
_CAMERAS_SHOWN = 10
_WIDTH = 150  # of output that is not for a terminal


@dataclass
class _Replay:
    """One run, how it was planned again, and the outcome."""

    path: Path
    outcome: str
    why: str = ""
    run: Run | None = None
    now: FocusPlan | None = None
    differences: list[Difference] = field(default_factory=list)
    notes: tuple[str, ...] = ()
    recorded_as: Path | None = None
    again: Run | None = None


def add(commands: Any) -> None:
    """Add the command."""
    replay = commands.add_parser(
        "replay",
        help="plan recorded runs again, and compare",
        description="Plan recorded runs again from their inputs and requests, and compare the plans"
        " bit for bit, without ROS. Exit status 0: all runs were reproduced, or planned with the"
        " changes of --set; 1: a run differs; 2: a run cannot be read, or not be planned with the"
        " changes.",
    )
    replay.set_defaults(command=run)
    option = replay.add_argument
    option(
        "runs",
        type=Path,
        nargs="+",
        metavar="RUN",
        help="folder of a run, its .mcap file, or a folder of such folders",
    )
    option(
        "--set",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="plan with a changed parameter (method=optimal, samples=65536) or with other lenses"
        " on all cameras (f_number=8, lens.max_focus=2), and compare with the recorded plan; may be"
        " repeated",
    )
    add_recording_options(replay, "the new runs", "their plans")
    option(
        "--live",
        action="store_true",
        help="send the inputs to a running node, and compare its answer",
    )
    option(
        "--node",
        metavar="NAME",
        help=f"with --live: full name of the node (default: {PLANNER})",
    )
    option(
        "--report",
        type=Path,
        metavar="REPORT.HTML",
        help=f"of a single run: {REPORT_HELP}; with --set also beside the recorded plan",
    )
    add_pictures_option(replay)
    option("--json", action="store_true", help="print JSON")
    option("--quiet", action="store_true", help="show no progress")


def run(options: argparse.Namespace) -> int:
    """Replay the runs; return the exit status."""
    from focus_planner.recording.what_if import parse_changes

    if options.live and (options.set or options.record or options.report):
        raise InputError("--live", "neither --set, --record nor --report with it", "one of them")
    check_beside(options, "--node", "--live")
    check_beside(options, "--pictures", "--report")
    recorder = recorder_of(options)
    changes = parse_changes(options.set)
    paths = list(_runs(options.runs))
    if options.report is not None:
        check_single(options.report, paths)
        check_pictures(wanted=options.pictures)
    replays: list[_Replay] = []
    with shown(options.quiet) as tell:
        for number, path in enumerate(paths, 1):
            place = f"{number} of {len(paths)}: " if len(paths) > 1 else ""
            replays.append(_replay(path, changes, options, recorder, tell, place))
    if options.json:
        print(json.dumps([_as_json(replay) for replay in replays], indent=2, allow_nan=False))
    else:
        _show(replays)
    if options.report is not None:
        _report(options, replays[0])
    status = max(_STATUS[replay.outcome] for replay in replays)
    return max(status, NOT_RECORDED) if recorder.failed else status


def _runs(paths: list[Path]) -> Iterator[Path]:
    """Yield the runs; a folder of runs stands for all runs in it."""
    for path in paths:
        within = []
        with suppress(OSError):  # reported when the run is read
            if path.is_dir() and not list(path.glob("*.mcap")):
                within = sorted(each for each in path.iterdir() if _is_run(each))
        yield from within or [path]


def _is_run(folder: Path) -> bool:
    """Return whether there is a run in a folder; hidden ones are prepared for runs to come."""
    try:
        return not folder.name.startswith(".") and any(
            file.is_file() for file in folder.glob("*.mcap")
        )
    except OSError:
        return False


def _replay(
    path: Path,
    changes: dict[str, Value],
    options: argparse.Namespace,
    recorder: CommandRecorder,
    tell: Tell,
    place: str,
) -> _Replay:
    tell(f"{place}reading {path}")
    try:
        recorded = _read(path, whole=not (changes or options.record))
    except InputError as error:
        return _Replay(path, _UNREADABLE, " ".join(str(error).split()))
    try:
        if options.live:
            return _replay_live(recorded, options.node or PLANNER, tell)
        return _replay_here(recorded, changes, recorder, tell, place)
    except InputError as error:
        return _Replay(path, _REFUSED, " ".join(str(error).split()), recorded)


def _read(path: Path, whole: bool) -> Run:
    from focus_planner.recording.run_reading import read_run

    recorded = read_run(path)
    if whole and recorded.ending is None:
        raise InputError(
            str(path),
            "a complete run",
            f"a partial one: {recorded.fault}",
            "use --set or --record to plan from its inputs",
        )
    return recorded


def _replay_here(
    recorded: Run,
    changes: dict[str, Value],
    recorder: CommandRecorder,
    tell: Tell,
    place: str,
) -> _Replay:
    from dataclasses import replace

    from focus_planner.recording.naming import new_run_id
    from focus_planner.recording.replay import differences, plan_run
    from focus_planner.recording.software import software
    from focus_planner.recording.what_if import Changed, with_changes

    # Unchanged, a request that is out of range is left to the planner, to be refused as before.
    changed = with_changes(recorded, changes) if changes else Changed(recorded, ())
    again = changed.run
    beginning = replace(again.beginning, run_id=new_run_id(), software=software())
    as_it_was = not changes and recorded.ending is not None
    on_preparing = show_share(tell, f"{place}preparing the surface")
    steps = collect_steps(show_progress(tell, place, None if as_it_was else _time_budget(again)))
    on_progress, end = recorder.begin(lambda: (again.inputs, beginning), steps)
    tell(f"{place}finding what the cameras see")
    replayed = plan_run(again, on_progress, on_preparing, stop_as_recorded=as_it_was)
    ctrl_c.check()
    now = replayed.ending
    folder = end(now.success, now.message, replayed.plan, replayed.rig)
    if as_it_was:
        found = differences(recorded, replayed)
        outcome = _DIFFERS if found else _REPRODUCED
    else:
        found, outcome = [], _PLANNED if now.success else _REFUSED
    again = replace(
        again,
        beginning=beginning if folder else replace(beginning, run_id=recorded.beginning.run_id),
        progress=replayed.progress,
        elapsed=steps.elapsed,
        ending=now,
        fault="",
    )
    return _Replay(
        recorded.path, outcome, now.message, recorded, now.plan, found, changed.notes, folder, again
    )


def _time_budget(run: Run) -> float | None:
    """Return the time budget of a run; None if its request is one to be refused."""
    with suppress(InputError):
        return run.beginning.request.time_budget
    return None


def _replay_live(recorded: Run, node: str, tell: Tell) -> _Replay:
    try:
        from focus_planner.ros.live_replay import replay_live
    except ImportError as error:
        raise InputError("--live", "ROS 2 (rclpy) and focus_planner_msgs", str(error)) from None
    from focus_planner.recording.replay import outcome_differences

    with ctrl_c.immediate():
        ending = replay_live(recorded, node, tell)
    found = outcome_differences(recorded, ending)
    outcome = _DIFFERS if found else _REPRODUCED
    return _Replay(recorded.path, outcome, ending.message, recorded, ending.plan, found)


def _report(options: argparse.Namespace, replay: _Replay) -> None:
    """Write the report of a run that was planned again."""
    if replay.outcome in (_UNREADABLE, _REFUSED):
        return  # which has been said
    if replay.run is None or replay.again is None or replay.now is None:
        raise InputError("--report", "a run with a plan", f"one without: {replay.why}")
    beside = replay.outcome != _REPRODUCED
    with shown(options.quiet) as tell:
        changes, assumed = options.set, replay.notes
        wanted = ReportOptions(options.report, pictures=options.pictures)
        report_replay(wanted, replay.run, replay.again, changes, assumed, tell, beside=beside)


# --- showing -----------------------------------------------------------------------------------


def _show(replays: list[_Replay]) -> None:
    from focus_planner.cli.console import PlainConsole

    console = PlainConsole(sys.stdout, width=None if sys.stdout.isatty() else _WIDTH)
    for replay in replays:
        if replay.outcome in (_UNREADABLE, _REFUSED):
            whose = f"{replay.path}: " if replay.outcome == _REFUSED and len(replays) > 1 else ""
            show_error(f"{whose}{replay.why}")
        elif (
            replay.outcome == _PLANNED
            or len(replays) == 1
            or replay.differences
            or replay.recorded_as
        ):
            _show_one(console, replay)
    if len(replays) > 1:
        _show_all(console, replays)


def _show_one(console: PlainConsole, replay: _Replay) -> None:
    from functools import partial

    say = partial(console.print, soft_wrap=True)
    assert replay.run is not None
    say(_name(replay), style="bold", end=" ")
    say(replay.outcome, style=_COLOURS[replay.outcome])
    for note in replay.notes:
        say(f"  note: {note}")
    if replay.outcome == _PLANNED:
        _show_comparison(console, replay)
    elif replay.differences:
        for difference in replay.differences:
            say(f"  {difference.stage}", style="bold", end="")
            say(f": {difference.what}")
        for name, (then, now) in _software(replay).items():
            say(f"  {name}: {then} then, {now} now")
    elif replay.now is not None:
        say(f"  {replay.now.summary()}")
    else:
        say(f"  no plan, then as now: {replay.why}")
    for plan_note in replay.now.notes if replay.now else ():
        say(f"  note: {plan_note.text}")
    if replay.recorded_as is not None:
        say(f"  recorded: {replay.recorded_as}")


def _show_comparison(console: PlainConsole, replay: _Replay) -> None:
    from rich.table import Table

    from focus_planner.recording.comparison import quantities

    before, after = _plans(replay)
    assert after is not None
    table = Table("", "recorded", "", "now", "", "change")
    for column in (1, 3, 5):
        table.columns[column].justify = "right"
    old = {name: (value, unit) for name, value, unit in quantities(before)} if before else {}
    for name, value, unit in quantities(after):
        then, unit_then = old.get(name, (None, ""))
        row = (_text(then), unit_then if then is not None else "", _text(value), unit)
        change = _change(then, value, share=unit != "s")
        table.add_row(name.replace("_", " "), *row, change)
    console.print(table)
    if before is not None:
        _show_cameras(console, before, after)


def _show_cameras(console: PlainConsole, before: FocusPlan, after: FocusPlan) -> None:
    from rich.table import Table

    from focus_planner.recording.comparison import camera_changes, median_moved

    changes = camera_changes(before, after)
    console.print(
        f"{len(changes)} of {len(before.cameras)} cameras are focused at other distances", end=""
    )
    if not changes:
        console.print()
        return
    console.print(f", by {1e3 * median_moved(changes):.3g} mm in the median")
    table = Table("farthest", "recorded", "now", "from sensor", "change", "samples", "now")
    for column in table.columns[1:]:
        column.justify = "right"
    for change in changes[:_CAMERAS_SHOWN]:
        moved = 1e3 * (change.after - change.before)
        marked = "" if change.from_sensor_after is None else f"{change.from_sensor_after:.4f} m"
        distances = (f"{change.before:.4f} m", f"{change.after:.4f} m", marked, f"{moved:+.1f} mm")
        samples = (str(change.samples_before), str(change.samples_after))
        table.add_row(change.name, *distances, *samples)
    console.print(table)


def _show_all(console: PlainConsole, replays: list[_Replay]) -> None:
    from rich.table import Table
    from rich.text import Text

    table = Table("run", "outcome", "method", "samples", "cost", "now", "s", "")
    for column in (3, 4, 5, 6):
        table.columns[column].justify = "right"
    for replay in replays:
        before, after = _plans(replay)
        cost, cost_now = (_text(plan.cost) if plan else "" for plan in (before, after))
        plans = [plan for plan in (before, after) if plan]
        methods, samples = (
            " → ".join(dict.fromkeys(str(getattr(plan, name)) for plan in plans))
            for name in ("method", "samples")
        )
        what = replay.differences[0].stage if replay.differences else ""
        table.add_row(
            _name(replay),
            Text(replay.outcome, _COLOURS[replay.outcome]),
            methods,
            samples,
            cost,
            cost_now,
            f"{after.total_seconds:.2f}" if after else "",
            what or ("" if plans or not replay.run else "no plan"),
        )
    console.print(table)
    counts = {name: sum(r.outcome == name for r in replays) for name in _STATUS}
    console.print(", ".join(f"{count} {name}" for name, count in counts.items() if count))


def _name(replay: _Replay) -> str:
    """Return the name of the run's folder or file, also of one given as "."."""
    return replay.path.name or replay.path.resolve().name


def _plans(replay: _Replay) -> tuple[FocusPlan | None, FocusPlan | None]:
    ending = replay.run.ending if replay.run else None
    return ending.plan if ending else None, replay.now


def _software(replay: _Replay) -> dict[str, tuple[str, str]]:
    """Return the versions that differ: recorded and present."""
    from focus_planner.recording.software import software

    assert replay.run is not None
    then, now = replay.run.beginning.software, software()
    return {
        name: (then.get(name, "none"), now.get(name, "none"))
        for name in {**then, **now}
        if then.get(name) != now.get(name)
    }


def _text(value: float | str | bool | None) -> str:
    if value is None:
        return "none"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.3f}" if isinstance(value, float) else str(value)


def _change(then: float | str | bool | None, now: float | str | bool | None, *, share: bool) -> str:
    if not (isinstance(then, float) and isinstance(now, float)):
        return ""
    percent = f" ({100 * (now - then) / then:+.2f} %)" if then and share else ""
    return f"{now - then:+.3f}{percent}"


def _as_json(replay: _Replay) -> dict[str, Any]:
    from focus_planner.io.plans import plan_to_json
    from focus_planner.recording.comparison import camera_changes

    before, after = _plans(replay)
    ending = replay.run.ending if replay.run else None
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
        "cameras": (
            [vars(change) for change in camera_changes(before, after)] if before and after else []
        ),
        "recorded_as": str(replay.recorded_as) if replay.recorded_as else None,
    }
