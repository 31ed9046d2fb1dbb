# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Writing reports: what the commands that can do so have in common."""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from focus_planner.cli.compiling import compile_first
from focus_planner.cli.interrupts import ctrl_c
from focus_planner.cli.progress import Tell, show_progress, show_share
from focus_planner.cli.terminal import show_note
from focus_planner.core.validation import InputError

if TYPE_CHECKING:
    from focus_planner.core.planning.subject import PlannedSubject
    from focus_planner.core.progress import ProgressCallback
    from focus_planner.core.rig.rig import Rig
    from focus_planner.report.assembly import Provenance
    from focus_planner.report.comparison import ComparedPlan
    from focus_planner.report.pictures import Pictures
    from focus_planner.report.steps import StepCollector

#: What a report is for, for the help of options.
REPORT_HELP = (
    "write a report of the plan, one page for a browser that needs nothing else (.html): the"
    " surface in 3D, every camera, the plan beside autofocus"
)


@dataclass(frozen=True)
class ReportOptions:
    """How to make a report.

    Attributes
    ----------
    path : Path
    compare : sequence of str or None
        Methods to compare the plan with; None for the usual ones.
    samples : int or None
        Of the surface; None for as many as a page has room for.
    pictures : bool or None
        Whether to show what each camera will see; None if that can be done here.
    """

    path: Path
    compare: Sequence[str] | None = None
    samples: int | None = None
    pictures: bool | None = None


def add_pictures_option(parser: Any) -> None:
    """Add the option that says whether a report shows pictures."""
    parser.add_argument(
        "--pictures",
        action=argparse.BooleanOptionalAction,
        help="in the report, show what each camera will see (default: if Pillow is installed)",
    )


def check_report_option(path: Path, inputs: Iterable[Path | None]) -> None:
    """Raise unless a report can be written at ``path``, and is none of the inputs.

    Raises
    ------
    InputError
        Says what is wrong with it.
    """
    from focus_planner.io.files import resolved
    from focus_planner.report.naming import check_report

    check_report(path)
    if resolved(path) in {resolved(each) for each in inputs if each is not None}:
        raise InputError(str(path), "an output file that is not an input as well", "an input")


def check_pictures(*, wanted: bool | None) -> None:
    """Raise if pictures are wanted, and cannot be made here.

    Raises
    ------
    InputError
        Says what is missing.
    """
    if wanted:
        import focus_planner.report.thumbnails  # noqa: F401


def _pictures(options: ReportOptions, rig: Rig, tell: Tell) -> Pictures | None:
    if options.pictures is False:
        return None
    from focus_planner.core.planning.work import DEPTHS, PICTURES

    try:
        from focus_planner.report.thumbnails import camera_pictures
    except InputError as error:
        show_note(f"the report shows no pictures of what cameras will see: {error}")
        return None
    compile_first(tell, (DEPTHS, PICTURES))
    return camera_pictures(
        rig, lambda method: show_share(tell, f"picturing what cameras will see with {method}")
    )


def collect_steps(on_progress: ProgressCallback) -> StepCollector:
    """Return a callback that keeps all steps, for a report."""
    from focus_planner.report.steps import StepCollector

    return StepCollector(on_progress)


def make_report(
    options: ReportOptions,
    subject: PlannedSubject,
    provenance: Provenance,
    tell: Tell,
    also: Sequence[ComparedPlan] = (),
) -> str:
    """Write a report; return its verdict.

    Parameters
    ----------
    options : ReportOptions
    subject : PlannedSubject
    provenance : Provenance
    tell : callable
    also : sequence of ComparedPlan
        Plans to show beside the plan, before those of other methods.

    Raises
    ------
    InputError
        If other methods cannot plan for the subject, or the file cannot be written.
    """
    from focus_planner.core.planning.work import PLANNING
    from focus_planner.report.assembly import assemble
    from focus_planner.report.comparison import plans_to_compare
    from focus_planner.report.making import write_report

    def on_progress(method: str) -> ProgressCallback:
        return show_progress(tell, f"{method}, to compare with: ")

    compared = list(also)
    for each in plans_to_compare(subject, options.compare, on_progress, "--compare"):
        ctrl_c.check()  # a plan that was stopped is none to compare with
        compared.append(each)
    compile_first(tell, (PLANNING,))
    content = assemble(
        subject,
        compared,
        provenance,
        pictures=_pictures(options, subject.rig, tell),
        samples=options.samples,
        made=datetime.now().astimezone(),
        tell=tell,
    )
    tell(f"writing {options.path}")
    write_report(content, options.path)
    return content.verdict
