# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""``focus_planner replay``: planning recorded runs again, unchanged or with changes."""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from focus_planner.cli.compiling import compile_first
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
from focus_planner.cli.replay_output import as_json, show
from focus_planner.cli.replay_report import check_single, report_replay
from focus_planner.cli.replayed import (
    DIFFERS,
    PLANNED,
    REFUSED,
    REPRODUCED,
    STATUS,
    UNREADABLE,
    ReplayedRun,
)
from focus_planner.cli.reporting import (
    REPORT_HELP,
    ReportOptions,
    add_pictures_option,
    check_pictures,
    collect_steps,
)
from focus_planner.core.validation import InputError

if TYPE_CHECKING:
    from focus_planner.parameters.declaration import Value
    from focus_planner.recording.run import Run


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
    replays: list[ReplayedRun] = []
    with shown(options.quiet) as tell:
        for number, path in enumerate(paths, 1):
            place = f"{number} of {len(paths)}: " if len(paths) > 1 else ""
            replays.append(_replay(path, changes, options, recorder, tell, place))
    if options.json:
        print(json.dumps([as_json(replay) for replay in replays], indent=2, allow_nan=False))
    else:
        show(replays)
    if options.report is not None:
        _report(options, replays[0])
    status = max(STATUS[replay.outcome] for replay in replays)
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
) -> ReplayedRun:
    tell(f"{place}reading {path}")
    try:
        recorded = _read(path, whole=not (changes or options.record))
    except InputError as error:
        return ReplayedRun(path, UNREADABLE, " ".join(str(error).split()))
    try:
        if options.live:
            return _replay_live(recorded, options.node or PLANNER, tell)
        return _replay_here(recorded, changes, recorder, tell, place)
    except InputError as error:
        return ReplayedRun(path, REFUSED, " ".join(str(error).split()), recorded)


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
) -> ReplayedRun:
    from dataclasses import replace

    from focus_planner.core.planning.precompile import works_for
    from focus_planner.recording.naming import new_run_id
    from focus_planner.recording.replay import differences, plan_run
    from focus_planner.recording.software import software
    from focus_planner.recording.what_if import Changed, with_changes

    # Unchanged, a request that is out of range is left to the planner, to be refused as before.
    changed = with_changes(recorded, changes) if changes else Changed(recorded, ())
    again = changed.run
    beginning = replace(again.beginning, run_id=new_run_id(), software=software())
    as_it_was = not changes and recorded.ending is not None
    with suppress(InputError):  # of a request that will be refused
        compile_first(tell, works_for(beginning.request, clouds=again.has_clouds), place)
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
        outcome = DIFFERS if found else REPRODUCED
    else:
        found, outcome = [], PLANNED if now.success else REFUSED
    again = replace(
        again,
        beginning=beginning if folder else replace(beginning, run_id=recorded.beginning.run_id),
        progress=replayed.progress,
        elapsed=steps.elapsed,
        ending=now,
        fault="",
    )
    return ReplayedRun(
        recorded.path, outcome, now.message, recorded, now.plan, found, changed.notes, folder, again
    )


def _time_budget(run: Run) -> float | None:
    """Return the time budget of a run; None if its request is one to be refused."""
    with suppress(InputError):
        return run.beginning.request.time_budget
    return None


def _replay_live(recorded: Run, node: str, tell: Tell) -> ReplayedRun:
    try:
        from focus_planner.ros.live_replay import replay_live
    except ImportError as error:
        raise InputError("--live", "ROS 2 (rclpy) and focus_planner_msgs", str(error)) from None
    from focus_planner.recording.replay import outcome_differences

    with ctrl_c.immediate():
        ending = replay_live(recorded, node, tell)
    found = outcome_differences(recorded, ending)
    outcome = DIFFERS if found else REPRODUCED
    return ReplayedRun(recorded.path, outcome, ending.message, recorded, ending.plan, found)


def _report(options: argparse.Namespace, replay: ReplayedRun) -> None:
    """Write the report of a run that was planned again."""
    if replay.outcome in (UNREADABLE, REFUSED):
        return  # which has been said
    if replay.run is None or replay.again is None or replay.now is None:
        raise InputError("--report", "a run with a plan", f"one without: {replay.why}")
    beside = replay.outcome != REPRODUCED
    with shown(options.quiet) as tell:
        changes, assumed = options.set, replay.notes
        wanted = ReportOptions(options.report, pictures=options.pictures)
        report_replay(wanted, replay.run, replay.again, changes, assumed, tell, beside=beside)
