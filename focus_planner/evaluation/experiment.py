# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What an experiment is: tasks that measure subjects, and what is written of the results."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    # They take a second each, and a command line that only lists experiments needs neither.
    from matplotlib.figure import Figure
    from pandas import DataFrame

    from focus_planner.evaluation.subject import Subject

#: What a cell of a table may hold.
Value = str | int | float | bool
Row = Mapping[str, Value]


@dataclass(frozen=True)
class Conditions:
    """What all experiments of an evaluation have in common.

    Attributes
    ----------
    samples : int
        To plan on, of each subject, where the experiment does not vary them.
    judged : int
        Further samples, which no solver sees, on which plans are judged.
    seed : int
        Of both samplings, and of whatever else is random.
    """

    samples: int = 1000
    judged: int = 65_536
    seed: int = 0


@dataclass(frozen=True)
class Task:
    """One measurement, independent of all others.

    Attributes
    ----------
    subjects : tuple of str
        Names of those that it takes.
    setting : mapping
        What it varies; the first columns of its results.
    """

    subjects: tuple[str, ...]
    setting: Row = field(default_factory=dict)


@dataclass(frozen=True)
class Measured:
    """What a task found.

    Attributes
    ----------
    rows : sequence of mapping
        The same for anybody who repeats it, bit for bit. All rows of an experiment have the same
        columns, none of which is called as one of the setting.
    seconds : mapping of str to float
        What took how long; differs from run to run.
    """

    rows: Sequence[Row]
    seconds: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Results:
    """All that an experiment has measured.

    Attributes
    ----------
    rows : DataFrame
        One per row that was measured: ``subject``, the setting's columns, what was measured.
    seconds : DataFrame
        One per task: ``subject``, the setting's columns, its seconds, and ``task_seconds`` in all.
    conditions : Conditions
    """

    rows: DataFrame
    seconds: DataFrame
    conditions: Conditions


@dataclass(frozen=True, eq=False)
class WriteUp:
    """What is written of an experiment's results.

    Attributes
    ----------
    text : str
        Markdown: a paragraph that says what was measured and what came of it, beside the paper's
        figures where it has some, and then the tables.
    draw : callable
        Draws the plot into an empty figure.
    """

    text: str
    draw: Callable[[Figure], None]


@dataclass(frozen=True)
class Experiment:
    """An experiment.

    Attributes
    ----------
    name : str
        As on the command line.
    title : str
        A heading.
    paper : str
        Where the paper has it; empty for what is not in the paper.
    tasks : callable
        Of the subjects' names; a subject that a task names is read once on every machine that
        needs it.
    measure : callable
        Runs a task, on any machine, given its subjects and its setting.
    write_up : callable
    most_subjects : int, optional
        How many subjects it takes unless it is told otherwise; the others would cost more time than
        they add.
    """

    name: str
    title: str
    paper: str
    tasks: Callable[[Sequence[str], Conditions], Sequence[Task]]
    measure: Callable[[Sequence[Subject], Row, Conditions], Measured]
    write_up: Callable[[Results], WriteUp]
    most_subjects: int | None = None


def each_subject(
    *settings: Row,
) -> Callable[[Sequence[str], Conditions], Sequence[Task]]:
    """Return the tasks of an experiment that measures every subject in every setting."""

    def tasks(names: Sequence[str], _: Conditions) -> Sequence[Task]:
        return [Task((name,), setting) for name, setting in product(names, settings or ({},))]

    return tasks
