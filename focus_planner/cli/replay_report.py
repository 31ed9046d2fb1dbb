# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The report of a run that was planned again."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from focus_planner.cli.progress import Tell, show_share
from focus_planner.cli.reporting import ReportOptions, check_report_option, make_report
from focus_planner.core.validation import InputError

if TYPE_CHECKING:
    from focus_planner.core.planning.plan import FocusPlan
    from focus_planner.recording.run import Run
    from focus_planner.report.comparison import ComparedPlan


def check_single(report: Path, runs: Sequence[Path]) -> None:
    """Raise unless there is one run, and a report of it can be written.

    Raises
    ------
    InputError
        Says which of these is wrong.
    """
    if len(runs) != 1:
        raise InputError("--report", "a single run to report on", f"{len(runs)} runs", "name one")
    check_report_option(report, runs)


def report_replay(
    wanted: ReportOptions,
    recorded: Run,
    again: Run,
    changes: Sequence[str],
    assumed: Sequence[str],
    tell: Tell,
    *,
    beside: bool,
) -> None:
    """Write a report of a run's new plan.

    Parameters
    ----------
    wanted : ReportOptions
    recorded, again : Run
        As it was recorded, and as it was planned again.
    changes : sequence of str
        What was changed: ``f_number=8``.
    assumed : sequence of str
        What was assumed for that.
    tell : callable
    beside : bool
        Whether to show the recorded plan beside the new one, if there is one.

    Raises
    ------
    InputError
        As :func:`~focus_planner.cli.reporting.make_report`.
    """
    from dataclasses import replace
    from datetime import datetime

    from focus_planner.recording.provenance import provenance_of
    from focus_planner.recording.subject import subject_of

    worst = again.ending.plan.worst if again.ending and again.ending.plan else None
    name = worst.surface if worst else None
    subject = subject_of(again, show_share(tell, "preparing the surface again"), name)
    provenance = replace(
        provenance_of(again),
        planned=datetime.now().astimezone(),
        changed="; ".join([", ".join(changes), *assumed]),
    )
    also = list(_recorded(recorded, subject.plan, name)) if beside else []
    make_report(wanted, subject, provenance, tell, also)


def _recorded(run: Run, now: FocusPlan, name: str | None) -> Iterator[ComparedPlan]:
    """Yield the plan as it was recorded, with the rig that it was made for.

    Of a plan for several subjects, what it is for the one of this name.
    """
    from focus_planner.recording.comparison import measure_text, same_measure
    from focus_planner.recording.subject import subject_of
    from focus_planner.report.comparison import ComparedPlan, title_of

    if run.ending is None or run.ending.plan is None:
        return
    then = subject_of(run, name=name)
    measure = "" if same_measure([then.plan, now]) else f" {measure_text(then.plan)}"
    title = f"{title_of(then.plan)}, as recorded{measure}"
    yield ComparedPlan(title, "the recorded plan", then.plan, then.rig)
