# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What a plan is worth for each of several subjects, as a table."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from focus_planner.cli.tables import add_named_rows, new_table

if TYPE_CHECKING:
    from focus_planner.cli.console import PlainConsole
    from focus_planner.core.planning.subject_quality import SubjectQuality


def print_subjects(subjects: Sequence[SubjectQuality], console: PlainConsole) -> None:
    """Print a table of subjects, and their mean by weight."""
    table = new_table("subject", "weight", "cost", "fresh cost", "in focus", "", right=range(1, 5))
    worst = max(subjects, key=lambda each: each.fresh_cost)
    rows = [(each.surface, (*_cells(each), "worst" if each is worst else "")) for each in subjects]
    rows.append(("mean, by weight", (*_mean(subjects), "")))
    add_named_rows(table, rows, console)
    console.print(table)


def _cells(subject: SubjectQuality) -> tuple[str, str, str, str]:
    return (
        f"{subject.weight:g}",
        f"{subject.cost:.2f}",
        f"{subject.fresh_cost:.2f} ± {subject.fresh_standard_error:.2f}",
        _share(subject),
    )


def _mean(subjects: Sequence[SubjectQuality]) -> tuple[str, str, str, str]:
    total = sum(each.weight for each in subjects)
    shares = [each.weight / total for each in subjects]

    def mean(values: Sequence[float]) -> float:
        return sum(share * value for share, value in zip(shares, values, strict=True))

    error = sum(
        (share * each.fresh_standard_error) ** 2
        for share, each in zip(shares, subjects, strict=True)
    )
    return (
        "",
        f"{mean([each.cost for each in subjects]):.2f}",
        f"{mean([each.fresh_cost for each in subjects]):.2f} ± {error**0.5:.2f}",
        f"{mean([each.in_focus_area / each.surface_area for each in subjects]):.1%}",
    )


def _share(subject: SubjectQuality) -> str:
    return f"{subject.in_focus_area / subject.surface_area:.1%}"
