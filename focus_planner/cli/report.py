# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""``focus_planner report``: a page that shows a plan."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from focus_planner.cli.progress import shown
from focus_planner.cli.reporting import (
    ReportOptions,
    add_pictures_option,
    check_pictures,
    check_report_option,
    make_report,
)
from focus_planner.cli.subjects import NamedSubject, add_subject_options, load_subject

if TYPE_CHECKING:
    from focus_planner.report.assembly import Provenance


def add(commands: Any) -> None:
    """Add the command."""
    report = commands.add_parser(
        "report",
        help="show a plan as a page: the surface in 3D, every camera, beside the baselines",
        description="Write a report of a recorded run, or of a plan.json with its surface and rig:"
        " one page that a browser opens without a network. It shows the surface in 3D with what is"
        " sharp, blurred and unseen, every camera with what it holds, and the plan beside those of"
        " other methods, which are made anew for the same request.",
    )
    report.set_defaults(command=run)
    add_subject_options(report)
    option = report.add_argument
    option(
        *("-o", "--output"),
        type=Path,
        default=Path("report.html"),
        metavar="REPORT.HTML",
        help="file to write (default: %(default)s)",
    )
    compare = option(
        "--compare",
        action="append",
        metavar="METHOD",
        help="another method to compare the plan with; may be repeated; the first is shown beside"
        " the plan (default: closest, which is autofocus, or k_view beside a plan by closest, then"
        " average and em)",
    )
    compare.completer = _methods
    option(
        "--samples",
        type=int,
        metavar="N",
        help="number of samples of the surface to show, none of which a plan was made on (default:"
        " 16384, fewer where many cameras see each)",
    )
    add_pictures_option(report)
    option("--quiet", action="store_true", help="show no progress and no summary")


def run(options: argparse.Namespace) -> int:
    """Write the report."""
    inputs = (options.plan, options.surface, options.rig, options.lens_tables, options.importance)
    check_report_option(options.output, inputs)
    with shown(options.quiet) as tell:
        tell("loading the planner")
        _check(options)
        named = load_subject(options, tell)
        wanted = ReportOptions(options.output, options.compare, options.samples, options.pictures)
        verdict = make_report(wanted, named.subject, _provenance(named), tell)
    if not options.quiet:
        print(verdict)
        print(f"The report: {options.output}")
    return 0


def _check(options: argparse.Namespace) -> None:
    from focus_planner.report.assembly import check_samples
    from focus_planner.report.comparison import check_methods

    check_pictures(wanted=options.pictures)
    check_methods("--compare", options.compare)
    if options.samples is not None:
        check_samples("--samples", options.samples)


def _provenance(named: NamedSubject) -> Provenance:
    from focus_planner.recording.provenance import parameters_of, provenance_of
    from focus_planner.report.assembly import Provenance

    if named.run is not None:
        return provenance_of(named.run)

    parameters = parameters_of(named.subject.request)
    asked = ("method", "samples", "seed", "shots", "views", "images", "depth_tolerance")
    told = (*asked, "max_mm_per_pixel", "fresh_samples")
    return Provenance(
        named.surface,
        named.rig,
        parameters=tuple((name, value) for name, value in parameters if name in told),
        certain=False,
    )


def _methods(**_: Any) -> tuple[str, ...]:
    from focus_planner.core.planning.request import METHODS

    return METHODS
