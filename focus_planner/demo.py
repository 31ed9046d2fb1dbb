# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The demonstration: the node plans for a body and the paper's rig with every method."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from dataclasses import dataclass, replace
from datetime import datetime
from itertools import count
from pathlib import Path
from typing import TextIO

from rich import box
from rich.console import Console
from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn
from rich.table import Table
from rich.text import Text

from focus_planner.core.planning.plan import CameraFocus, CameraStatus, FocusPlan
from focus_planner.core.planning.request import METHODS
from focus_planner.core.planning.subject import PlannedSubject, requested
from focus_planner.core.rig.layouts import cylinder_rig
from focus_planner.core.rig.rig import Rig
from focus_planner.core.surface.scene import Scene
from focus_planner.core.surface.surface import Mesh
from focus_planner.core.text import printable
from focus_planner.core.validation import InputError
from focus_planner.io.bodies import body
from focus_planner.io.files import check_folder_writable, made_folder
from focus_planner.io.lens_sheet.content import lens_sheet
from focus_planner.io.lens_sheet.saving import save_lens_sheet
from focus_planner.io.picture import draw_plans
from focus_planner.io.plans import save_plan
from focus_planner.io.rigs import save_rig
from focus_planner.io.surfaces import load_surface
from focus_planner.messages.plan_reading import plan_from_message
from focus_planner.recording.provenance import provenance_of
from focus_planner.recording.run_reading import read_run
from focus_planner.report.assembly import Provenance, assemble
from focus_planner.report.comparison import ComparedPlan, called, title_of
from focus_planner.report.making import write_report
from focus_planner.report.opening import open_report
from focus_planner.report.thumbnails import camera_pictures
from focus_planner.ros.client import PlannerClient

_BODY = "arms_out"
_BEST = "k_view"
_DRAWN = ("closest", "average", "em", "k_view")  # the optimum looks like k_view's plan
_REPORT = "report.html"
_PLANS, _PLAN, _SHEET, _RIG, _LOG = "plans.png", "plan.json", "sheet.html", "rig.yaml", "node.log"
_RUNS = "runs"
_CELL = 5  # characters
_SECONDS_TO_START = 60.0
_SECONDS_TO_STOP = 30.0
_MARKS = {CameraStatus.UNASSIGNED: "~", CameraStatus.SEES_NOTHING: "x"}
_EXPLANATIONS = {
    CameraStatus.UNASSIGNED: "see the body, but other cameras image all of it better",
    CameraStatus.SEES_NOTHING: "see nothing of the body, and get a harmless default distance",
}
# From near to far, readable on dark and light backgrounds.
_COLOURS = ("red", "yellow", "green", "cyan", "blue", "magenta")


@dataclass(frozen=True)
class _Result:
    """A method's plan, and the time from request to response, seconds."""

    plan: FocusPlan
    waited: float


def run(
    output_directory: Path,
    computing: Callable[[], AbstractContextManager[object]] = nullcontext,
    *,
    show: bool = False,
) -> int:
    """Start the node, request a plan for a body by every method, and show the plans.

    Parameters
    ----------
    output_directory : Path
        For the report, the picture, the best plan, its lens sheet, the rig and the node's log,
        which replace those of an earlier demonstration, and for the recorded runs, which do not.
    computing : callable
        Makes the context in which this process computes, rather than waiting for the node.
    show : bool
        Whether to open the report in the browser, if there is a terminal and a screen.

    Returns
    -------
    int
        The exit status.

    Raises
    ------
    InputError
        If the folder cannot be made or written to, or has files of these names that are no
        demonstration's.
    """
    console = Console(highlight=False, markup=False, emoji=False)
    check_folder_writable(made_folder(output_directory))
    _check_own(output_directory)
    _keep_to_this_machine()
    path = body(_BODY)
    mesh, rig = load_surface(path), cylinder_rig()
    assert isinstance(mesh, Mesh)
    log, runs = output_directory / _LOG, _new_runs(output_directory)
    try:
        with _status(console) as tell:
            results = _run_node(log, mesh, rig, runs, tell)
    except _NodeFailed as error:
        console.print(printable(f"{error}; its log is {log} and ends with:"), style="red")
        for line in log.read_text(errors="replace").splitlines()[-5:]:
            console.print(printable(line))
        return 1
    _show(console, rig, results)
    with _status(console) as tell, computing():
        tell("drawing the plans")
        drawn = [results[method].plan for method in _DRAWN]
        plans, scene = {title_of(plan): plan for plan in drawn}, Scene(mesh)
        draw_plans(scene, rig, plans, output_directory / _PLANS)
        _write_report(scene, rig, results, output_directory / _REPORT, runs, path.name, tell)
    save_rig(rig, output_directory / _RIG)
    best = results[_BEST].plan
    save_plan(best, output_directory / _PLAN)
    sheet = lens_sheet(best, rig, surface=path.name, rig_file=_RIG)
    save_lens_sheet(sheet, output_directory / _SHEET)
    _show_next_steps(console, output_directory, runs, path)
    if show:
        open_report(output_directory / _REPORT)
    return 0


# --- where to ----------------------------------------------------------------------------------


def _check_own(directory: Path) -> None:
    """Raise if a demonstration would replace what none has written: all leave a log."""
    if (directory / _LOG).exists():
        return
    for name in (_REPORT, _PLANS, _PLAN, _SHEET, _RIG):
        if (directory / name).exists():
            raise InputError(
                str(directory),
                "a new folder, or that of an earlier demonstration",
                f"one with a {name} that is no demonstration's",
                "name another with --output",
            )


def _new_runs(directory: Path) -> Path:
    """Make and return a folder for this demonstration's runs: earlier ones stay as they are."""
    for number in count(1):
        folder = directory / (_RUNS if number == 1 else f"{_RUNS}_{number}")
        with suppress(FileExistsError):
            folder.mkdir()
            return folder
    raise AssertionError


def _earlier_runs(directory: Path, runs: Path) -> list[Path]:
    """Return the folders of earlier demonstrations' runs."""
    own = re.compile(rf"{_RUNS}(_\d+)?")
    return [
        each
        for each in directory.iterdir()
        if own.fullmatch(each.name) and each.is_dir() and each != runs
    ]


# --- the node ----------------------------------------------------------------------------------


class _NodeFailed(Exception):  # noqa: N818
    """The node failed; the text says how."""


def _keep_to_this_machine() -> None:
    """Use a ROS graph of its own, unless the user chose one."""
    os.environ.setdefault("ROS_DOMAIN_ID", "87")
    os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")


@contextmanager
def _node(log: TextIO, runs: Path) -> Iterator[tuple[subprocess.Popen[bytes], str]]:
    """Run the node in a process of its own, stop it, and check that it exits cleanly."""
    # Keeps two demonstrations on one machine apart.
    namespace = f"/demo_{os.getpid()}"
    command = [sys.executable, "-m", "focus_planner.ros.node", "--ros-args"]
    record = ["-p", f"record_directory:={json.dumps(str(runs.resolve()))}"]
    keep = ["-p", f"record_max_runs:={len(METHODS)}"]
    process = subprocess.Popen(  # noqa: S603 - this very program
        [*command, "--remap", f"__ns:={namespace}", *record, *keep], stdout=log, stderr=log
    )
    try:
        yield process, f"{namespace}/focus_planner"
    except BaseException:
        _stop(process)
        raise
    status = _stop(process)
    if status != 0:
        raise _NodeFailed(f"the node exited with status {status}")


def _stop(process: subprocess.Popen[bytes]) -> int:
    process.send_signal(signal.SIGINT)
    try:
        return process.wait(_SECONDS_TO_STOP)
    except subprocess.TimeoutExpired:
        process.kill()
        return process.wait()


def _run_node(
    log: Path, mesh: Mesh, rig: Rig, runs: Path, tell: Callable[[str], object]
) -> dict[str, _Result]:
    """Start the node, publish the body and the rig, and request a plan by every method.

    The requests are recorded.
    """
    tell("starting the node")
    with (
        log.open("w") as stream,
        _node(stream, runs) as (process, name),
        PlannerClient(name) as client,
    ):
        _wait_for(client, process)
        client.publish_mesh(mesh)
        client.publish_rig(rig)
        # The first request also waits for the inputs to arrive, and is not timed.
        tell("sending the body and the rig")
        client.plan(method="closest", samples=100)
        results = {}
        for number, method in enumerate(METHODS, 1):
            tell(f"planning with {method}, {number} of {len(METHODS)}")
            results[method] = _plan(client, method)
        tell("stopping the node")
        return results


def _wait_for(client: PlannerClient, process: subprocess.Popen[bytes]) -> None:
    deadline = time.monotonic() + _SECONDS_TO_START
    while process.poll() is None and time.monotonic() < deadline:
        with suppress(TimeoutError):
            return client.wait_for_node(timeout=1.0)
    raise _NodeFailed("the node did not start")


def _plan(client: PlannerClient, method: str) -> _Result:
    called = time.perf_counter()
    response = client.plan(method=method)
    waited = time.perf_counter() - called
    if not response.success:
        raise _NodeFailed(f"the node made no plan with method {method}: {response.message}")
    return _Result(plan_from_message(response.plan), waited)


# --- the report --------------------------------------------------------------------------------


def _write_report(
    scene: Scene,
    rig: Rig,
    results: Mapping[str, _Result],
    path: Path,
    runs: Path,
    surface: str,
    tell: Callable[[str], object],
) -> None:
    """Write a report of the best plan, beside those of all other methods."""
    best = results[_BEST].plan
    subject = PlannedSubject(scene, rig, requested(best, scene), best)
    others = [result.plan for method, result in results.items() if method != _BEST]
    compared = [ComparedPlan(title_of(plan), called(plan.method), plan, rig) for plan in others]
    provenance = replace(_provenance(runs, best), surface=surface, rig=_RIG)
    now = datetime.now().astimezone()
    pictures = camera_pictures(rig)
    content = assemble(subject, compared, provenance, pictures=pictures, made=now, tell=tell)
    tell("writing the report")
    write_report(content, path)


def _provenance(runs: Path, plan: FocusPlan) -> Provenance:
    """Return what the recorded run with this plan tells of it, if there is one."""
    folders = sorted(runs.iterdir()) if runs.is_dir() else []
    for folder in folders:
        with suppress(InputError):  # a disk that is full costs the record, not the demonstration
            run = read_run(folder)
            if run.ending and run.ending.plan == plan:
                return provenance_of(run)
    return Provenance()


# --- what is shown -----------------------------------------------------------------------------


@contextmanager
def _status(console: Console) -> Iterator[Callable[[str], object]]:
    """Yield what shows what is being done, on a terminal also for how long."""
    if not console.is_terminal:
        yield lambda doing: console.print(f"{doing} ...")
        return
    columns = SpinnerColumn(style="cyan"), TextColumn("{task.description}"), TimeElapsedColumn()
    with Progress(*columns, console=console, transient=True) as progress:
        task = progress.add_task("", total=None)

        def tell(doing: str) -> None:
            progress.reset(task, description=doing)

        yield tell


def _compare(results: Mapping[str, _Result]) -> Table:
    """Return a table that compares all methods, 80 characters wide at most."""
    autofocus = results["closest"].plan
    table = Table(
        title=f"One body, 168 cameras, {autofocus.samples} samples",
        box=box.SIMPLE_HEAD,
        collapse_padding=True,
        pad_edge=False,
    )
    table.add_column("method", no_wrap=True)
    for name in ("cost", "fresh cost", "change", "in focus", "solver", "answer"):
        table.add_column(name, justify="right", overflow="fold")
    for method, result in results.items():
        plan = result.plan
        table.add_row(
            title_of(plan),
            f"{plan.cost:.1f}",
            f"{plan.fresh_cost:.1f} ± {plan.fresh_standard_error:.1f}",
            f"{plan.fresh_cost / autofocus.fresh_cost - 1:+.1%}" if method != "closest" else "",
            f"{plan.in_focus_area:.2f} m² ({plan.in_focus_area / plan.surface_area:.0%})",
            f"{plan.solve_seconds * 1e3:.0f} ms",
            f"{result.waited * 1e3:.0f} ms",
        )
    return table


def _distances(rig: Rig, cameras: Sequence[CameraFocus], width: int) -> Text:
    """Return the focus distances in centimetres on the unrolled grid of the rig.

    The columns are split into parts that fit into ``width`` characters.
    """
    assert rig.grid is not None
    columns = rig.grid.columns
    parts = -(-columns * _CELL // (width - _CELL * 2))
    length = -(-columns // parts)
    text = Text()
    for left in range(0, columns, length):
        shown = range(left, min(left + length, columns))
        text.append("\ncolumn " + "".join(f"{c:>{_CELL}}" for c in shown) + "\n", style="dim")
        for row in reversed(range(rig.grid.rows)):
            first = row * columns
            text.append(f"{rig.cameras[first].position[2]:5.2f} m", style="dim")
            for c in shown:
                text.append(*_distance(cameras, first + c))
            text.append("\n")
    return text


def _distance(cameras: Sequence[CameraFocus], index: int) -> tuple[str, str]:
    """Return a camera's focus distance with its mark, and its style."""
    camera = cameras[index]
    distances = [camera.focus_distance for camera in cameras]
    near, far = min(distances), max(distances)
    share = (camera.focus_distance - near) / ((far - near) or 1.0)
    colour = _COLOURS[min(int(share * len(_COLOURS)), len(_COLOURS) - 1)]
    marked = f"{_MARKS.get(camera.status, '')}{100 * camera.focus_distance:.0f}"
    return f"{marked:>{_CELL}}", "dim" if camera.status in _MARKS else colour


def _show(console: Console, rig: Rig, results: Mapping[str, _Result]) -> None:
    console.print(_compare(results))
    console.print(
        "cost: 0 if all of the body is large, centred and sharp in some picture, 1000 if no camera"
        " sees any of it. fresh cost: on samples that the solver has not seen, an unbiased estimate"
        " of the plan's quality, ± its standard error. change: of the fresh cost, relative to"
        " autofocus. optimal: proven to cost at most 0.01 % more than the best plan for its"
        " samples. answer: the time from request to response.\n"
    )
    cameras = results[_BEST].plan.cameras
    console.print(
        f"Focus distances of {_BEST} in cm: each line is a ring of cameras at one height."
        f" {_measured(results[_BEST].plan)}"
    )
    console.print(_distances(rig, cameras, console.width))
    counts = Counter(camera.status for camera in cameras)
    for status, mark in _MARKS.items():
        if counts[status]:
            console.print(f"  {mark} {counts[status]:3} {_EXPLANATIONS[status]}")


def _measured(plan: FocusPlan) -> str:
    text = "They are from the centre of projection"
    if plan.sensor_offsets is None:
        return f"{text}."
    least, most = (f"{100 * offset:.1f}" for offset in plan.sensor_offsets)
    return f"{text}; from the sensor, as focus rings are marked, they are {least} to {most} more."


def _show_next_steps(console: Console, directory: Path, runs: Path, path: Path) -> None:
    program = Path(sys.argv[0])
    earlier = len(_earlier_runs(directory, runs))
    kept = f"; those of {earlier} earlier demonstration{'s' * (earlier > 1)} are kept beside them"
    directory, runs = Path(printable(str(directory))), Path(printable(str(runs)))
    command = os.path.relpath(program) if program.name == "focus_planner" else "focus_planner"
    console.print(
        f"\nThe report:  {directory / _REPORT}, for your browser: the body in 3D, every camera"
        f"\nThe picture: {directory / _PLANS}"
        f"\nThe plan:    {directory / _PLAN}, for the rig {directory / _RIG}"
        f"\nThe sheet:   {directory / _SHEET}, to set the lenses by hand"
        f"\nThe runs:    {runs}{kept if earlier else ''}"
        "\n\nNext, without ROS:"
        f"\n  {command} plan {os.path.relpath(path)} --rig {directory / _RIG} --method k_view"
        f"\n  {command} replay {runs}"
        f"\n  {command} replay {runs} --set f_number=8"
        "\nor start the node, give it the same from another terminal, and ask how it is:"
        f"\n  {command} node"
        f"\n  {command} publish {os.path.relpath(path)} --rig {directory / _RIG} --plan"
        f"\n  {command} status"
        "\nWhat it publishes and answers: docs/interfaces.md.",
        soft_wrap=True,
    )
