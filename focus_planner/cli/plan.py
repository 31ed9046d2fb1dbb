# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""``focus_planner plan``: planning for a surface and a rig given as files."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from focus_planner.cli.best_so_far import BestSoFar
from focus_planner.cli.compiling import compile_first
from focus_planner.cli.interrupts import INTERRUPTED, ctrl_c
from focus_planner.cli.many_surfaces import (
    STDOUT,
    add_subject_options,
    check_subjects,
    known_subjects,
    names_of,
    numbered,
    of_preset,
)
from focus_planner.cli.option_rules import check_beside
from focus_planner.cli.plan_table import print_summary
from focus_planner.cli.progress import Tell, show_progress, show_share, shown
from focus_planner.cli.recording import (
    NOT_RECORDED,
    PLANNER,
    CommandRecorder,
    add_recording_options,
    recorder_of,
)
from focus_planner.cli.reporting import (
    REPORT_HELP,
    ReportOptions,
    add_pictures_option,
    check_pictures,
    collect_steps,
    make_report,
)
from focus_planner.cli.request_options import add_request_options, request_from_options
from focus_planner.cli.surface_options import add_surface_options, read_surface
from focus_planner.cli.terminal import show_note
from focus_planner.core.validation import InputError

if TYPE_CHECKING:
    from focus_planner.core.planning.plan import SolvedPlan, WarmStart
    from focus_planner.core.planning.request import PlanRequest
    from focus_planner.core.planning.subject import PlannedSubject
    from focus_planner.core.planning.subjects import Subject
    from focus_planner.core.progress import ProgressCallback
    from focus_planner.core.rig.rig import Rig
    from focus_planner.io.lens_tables import LensTables
    from focus_planner.recording.bag import BagMessage
    from focus_planner.recording.run import Beginning
    from focus_planner.report.steps import StepCollector

# The first is that of /dev/stdout, of pipes, and of what a shell substitutes for a process.
_PLAN_SUFFIXES = ("", ".json")
_PICTURE_HELP = (
    "draw the plan's cost on the surface: .png, .jpg or .tif, or to enlarge .pdf or .svg"
)


def add(commands: Any) -> None:
    """Add the command."""
    plan = commands.add_parser(
        "plan",
        help="plan focus distances for a surface and a rig",
        description="Plan the focus distances of all cameras for a surface. On a terminal this"
        " prints a summary; when stdout is piped, plan.json.",
    )
    plan.set_defaults(command=run)
    _add_inputs(plan)
    add_request_options(plan.add_argument_group("how to plan"))
    _add_outputs(plan.add_argument_group("what to write"))


def _add_inputs(plan: Any) -> None:
    option = plan.add_argument
    add_subject_options(plan)
    option("--rig", type=Path, required=True, metavar="RIG.YAML", help="file of the cameras")
    add_surface_options(plan)
    option(
        "--lens-tables",
        type=Path,
        metavar="FILE",
        help="YAML file of lens tables by camera, which map focus distances to the values that lens"
        " drivers take; for lenses without a table in RIG.YAML",
    )
    option("--quiet", action="store_true", help="show no progress and no summary")


def _add_outputs(group: Any) -> None:
    option = group.add_argument
    option(
        *("-o", "--output"),
        type=_output,
        action="append",
        default=[],
        metavar="FILE",
        help="write the plan (.json, or no ending; - for stdout) or the lens sheet, a table of what"
        " to set on every lens, as one walks the rig or as one camera takes its pictures (.html to"
        " print or for a tablet, .pdf, .csv, which has the poses too); may be repeated",
    )
    option(
        "--problem",
        type=Path,
        metavar="PROBLEM.NPZ",
        help="write the discrete problem, for checking the plan",
    )
    option(
        "--subject",
        metavar="SURFACE",
        help="of several, the one that --picture and --report show (default: the one that costs"
        " most)",
    )
    add_recording_options(group, "the run", "the plan")
    option("--picture", type=Path, metavar="PLAN.PNG", help=_PICTURE_HELP)
    option("--report", type=Path, metavar="REPORT.HTML", help=REPORT_HELP)
    add_pictures_option(group)


def _output(text: str) -> Path:
    """Return the path, which is ``-`` for stdout only; ``./-`` is a file."""
    path = Path(text)
    return path.absolute() if path == STDOUT and text != "-" else path


def run(options: argparse.Namespace) -> int:
    """Plan, and write the files asked for."""
    from focus_planner.io.files import check_writable, resolved

    check_subjects(options)
    paths = [path for path in options.output if path != STDOUT]
    paths += filter(None, (options.problem, options.picture, options.report))
    if options.presets > 1:
        paths = [numbered(each, n) for each in paths for n in range(1, options.presets + 1)]
    for path in paths:
        check_writable(path)
    different = {resolved(path) for path in paths}
    if len(different) < len(paths) or options.output.count(STDOUT) > 1:
        names = "--output, --problem, --picture, --report"
        raise InputError(names, "different files", "the same twice")
    inputs = (*options.surfaces, options.rig, options.importance, options.lens_tables)
    read = {resolved(path) for path in inputs if path}
    for path in paths:
        if resolved(path) in read:
            raise InputError(str(path), "an output file that is not an input as well", "an input")
    _check_names(options)
    recorder = recorder_of(options)
    made: list[_Made] = []
    with shown(options.quiet) as tell:
        given = _read(options, tell)
        if options.presets == 1:
            made.append(_make(options, given, tell, recorder))
        else:
            made += _make_presets(options, given, tell, recorder)
        for each in made:
            _write(each.options, each.given, each.plan, tell)
            if each.options.report is not None:
                _write_report(each.options, each.given, each.plan, each.steps, tell)
    _show(options, made)
    if any(each.interrupted for each in made):
        return INTERRUPTED
    return NOT_RECORDED if recorder.failed else 0


@dataclass(frozen=True)
class _Made:
    """A plan, what Ctrl-C did to it, and the options that say what to write of it."""

    options: argparse.Namespace
    given: _Given
    plan: SolvedPlan
    interrupted: str
    steps: StepCollector


def _make(
    options: argparse.Namespace,
    given: _Given,
    tell: Tell,
    recorder: CommandRecorder,
    start: WarmStart | None = None,
) -> _Made:
    steps = collect_steps(show_progress(tell, "", given.request.time_budget))
    plan, interrupted = _solve(given, tell, recorder, steps, start)
    return _Made(options, given, plan, interrupted, steps)


def _make_presets(
    options: argparse.Namespace, given: _Given, tell: Tell, recorder: CommandRecorder
) -> list[_Made]:
    """Return the plan of each preset, each a run of its own."""
    from focus_planner.core.planning.presets import plan_presets

    made: list[_Made] = []

    def make(
        number: int, taking: Sequence[Subject], request: PlanRequest, start: WarmStart
    ) -> SolvedPlan:
        part = replace(given, subjects=tuple(taking), request=request)
        files = dict(zip(names_of(options), options.surfaces, strict=True))
        chosen = of_preset(options, number, [files[each.name] for each in taking])
        made.append(_make(chosen, part, tell, recorder, start))
        return made[-1].plan

    searching = show_progress(tell, "presets: ", given.request.time_budget)
    presets = plan_presets(
        given.subjects,
        given.rig,
        options.presets,
        given.request,
        on_progress=searching,
        make_plan=make,
    )
    return [replace(each, plan=plan) for each, plan in zip(made, presets.plans, strict=True)]


# --- planning ----------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Given:
    """What to plan for; ``file_rig`` is the rig before the lens tables are applied to it."""

    subjects: tuple[Subject, ...]
    rig: Rig
    file_rig: Rig
    tables: LensTables | None
    request: PlanRequest


def _read(options: argparse.Namespace, tell: Tell) -> _Given:
    tell("loading the planner")
    from focus_planner.core.planning.precompile import works_for
    from focus_planner.core.planning.subjects import Subject
    from focus_planner.core.surface.scene import Scene
    from focus_planner.core.surface.surface import PointCloud
    from focus_planner.io.lens_sheet.saving import sheet_writer
    from focus_planner.io.lens_tables import load_lens_tables
    from focus_planner.io.rigs import load_rig

    # What pictures and lens sheets lack is told before anything is planned.
    if options.picture is not None:
        import focus_planner.io.picture  # noqa: F401
    for path in _sheets(options):
        sheet_writer(path)

    request = request_from_options(options)
    tell(f"reading {options.rig}")
    file_rig = load_rig(options.rig)
    tables = load_lens_tables(options.lens_tables) if options.lens_tables else None
    rig = tables.apply(file_rig) if tables else file_rig
    surfaces = [read_surface(options, tell, path) for path in options.surfaces]
    clouds = any(isinstance(surface, PointCloud) for surface in surfaces)
    compile_first(tell, works_for(request, clouds=clouds))
    weights = options.subject_weights or [1.0] * len(surfaces)
    subjects = tuple(
        Subject(Scene(surface, show_share(tell, f"preparing {path}")), name, weight)
        for path, surface, name, weight in zip(
            options.surfaces, surfaces, names_of(options), weights, strict=True
        )
    )
    return _Given(subjects, rig, file_rig, tables, request)


def _solve(
    given: _Given,
    tell: Tell,
    recorder: CommandRecorder,
    callback: ProgressCallback,
    start: WarmStart | None,
) -> tuple[SolvedPlan, str]:
    """Return the plan, and what Ctrl-C did to it if it was typed."""
    from focus_planner.core.planning.plan_focus import plan_focus

    subjects, rig, request = given.subjects, given.rig, given.request

    def beginning() -> tuple[list[BagMessage], Beginning]:
        from focus_planner.recording.naming import new_run_id
        from focus_planner.recording.run_writing import beginning_of, inputs_of
        from focus_planner.recording.software import software

        run_id, frame_id = new_run_id(), rig.frame_id
        surfaces = [subject.scene.surface for subject in subjects]
        notes, known = given.file_rig.notes, known_subjects(subjects)
        if not known:
            notes = (*surfaces[0].notes, *notes)
        begun = beginning_of(
            run_id, PLANNER, request, frame_id, software(), given.tables, notes, known
        )
        begun = replace(begun, warm_start=start)
        return inputs_of(begun, surfaces, given.file_rig), begun

    tell(f"finding what {len(rig)} cameras see")
    best = BestSoFar(tell, callback)
    on_progress, end = recorder.begin(beginning, best)
    try:
        plan = plan_focus(subjects, rig, request, on_progress=on_progress, warm_start=start)
    except InputError as error:
        ctrl_c.check()  # what it was stopped at need not be what is wrong
        end(False, str(error))
        raise
    interrupted = best.end()
    end(True, "; ".join(filter(None, (interrupted, plan.summary()))), plan, rig)
    return plan, interrupted


def _shown(options: argparse.Namespace, given: _Given, plan: SolvedPlan) -> PlannedSubject:
    """Return what pictures and reports are about."""
    from focus_planner.core.planning.subject import PlannedSubject, one_of

    subject = PlannedSubject(given.subjects[0].scene, given.rig, given.request, plan)
    return one_of(given.subjects, subject, options.subject) if plan.subjects else subject


def _check_names(options: argparse.Namespace) -> None:
    """Raise unless the names of what to write say what that is."""
    from focus_planner.io.endings import DRAWINGS, check_ending
    from focus_planner.io.lens_sheet import SUFFIXES
    from focus_planner.report.naming import check_report

    for option in ("problem", "record", "picture", "report"):
        if getattr(options, option) == STDOUT:
            got = "-, which stands for stdout"
            raise InputError(f"--{option}", "a name", got, "only --output may go there")
    for path in options.output:
        what = (
            f"a name that ends in .json for the plan, or in {', '.join(SUFFIXES)} for the lens"
            " sheet"
        )
        check_ending("--output", path, (*_PLAN_SUFFIXES, *SUFFIXES), what)
    if options.problem is not None:
        check_ending("--problem", options.problem, ("", ".npz"))
    if options.picture is not None:
        check_ending("--picture", options.picture, DRAWINGS)
    if options.report is not None:
        check_report(options.report)
        check_pictures(wanted=options.pictures)
    check_beside(options, "--pictures", "--report")


def _plans(options: argparse.Namespace) -> list[Path]:
    return [path for path in options.output if path.suffix.lower() in _PLAN_SUFFIXES]


def _sheets(options: argparse.Namespace) -> list[Path]:
    return [path for path in options.output if path.suffix.lower() not in _PLAN_SUFFIXES]


def _write(options: argparse.Namespace, given: _Given, plan: SolvedPlan, tell: Tell) -> None:
    from focus_planner.io.plans import save_plan
    from focus_planner.io.problems import save_problem

    for path in _plans(options):
        if path != STDOUT:
            save_plan(plan, path)
    if _sheets(options):
        _write_sheets(options, given, plan)
    if options.problem is not None:
        tell(f"writing {options.problem}")
        save_problem(plan.problem, options.problem)
    if options.picture is not None:
        tell(f"drawing {options.picture}")
        from focus_planner.io.picture import draw_plans

        shown = _shown(options, given, plan)
        draw_plans(shown.scene, shown.rig, {plan.method: shown.plan}, options.picture)


def _write_sheets(options: argparse.Namespace, given: _Given, plan: SolvedPlan) -> None:
    from datetime import datetime

    from focus_planner.io.lens_sheet.content import lens_sheet
    from focus_planner.io.lens_sheet.saving import save_lens_sheet

    sheet = lens_sheet(
        plan,
        given.rig,
        surface=_surfaces(options),
        rig_file=options.rig.name,
        made=datetime.now().astimezone(),
    )
    for path in _sheets(options):
        save_lens_sheet(sheet, path)


def _write_report(
    options: argparse.Namespace, given: _Given, plan: SolvedPlan, steps: StepCollector, tell: Tell
) -> None:
    from datetime import datetime

    from focus_planner.recording.provenance import parameters_of
    from focus_planner.recording.software import software
    from focus_planner.report.assembly import Provenance

    provenance = Provenance(
        surface=options.subject or (plan.worst.surface if plan.worst else _surfaces(options)),
        rig=options.rig.name,
        planned=datetime.now().astimezone(),
        steps=steps.steps,
        parameters=parameters_of(given.request),
        software=tuple(software().items()),
    )
    report = ReportOptions(options.report, pictures=options.pictures)
    make_report(report, _shown(options, given, plan), provenance, tell)


def _surfaces(options: argparse.Namespace) -> str:
    """Return what the plan was made for, in words."""
    first, *others = names_of(options)
    return f"{first} and {len(others)} more" if others else first


def _show(options: argparse.Namespace, made: Sequence[_Made]) -> None:
    """Print the summary on a terminal; print the plan on stdout if it is in no file."""
    stream: TextIO = sys.stderr if _plans(options) else sys.stdout
    with_summary = stream.isatty() and not options.quiet
    if with_summary:
        for number, each in enumerate(made, 1):
            title = f"preset {number} of {len(made)}: " if len(made) > 1 else ""
            print_summary(title, each.plan, stream, each.interrupted)
    if STDOUT in options.output or not (_plans(options) or with_summary):
        from focus_planner.io.plans import plan_to_json

        texts = [plan_to_json(each.plan) for each in made]
        sys.stdout.write(texts[0] if len(texts) == 1 else f"[\n{','.join(texts)}]\n")
    if not options.quiet:
        told = [each.interrupted for each in made if each.interrupted]
        told += [note.text for each in made for note in each.plan.notes]
        for text in dict.fromkeys(told):
            show_note(text)
