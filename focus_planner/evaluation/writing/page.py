# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The page of an evaluation: all that was found, and how to find it again.

It is made of nothing but the files in the evaluation's folder: who has them can make it again.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

from focus_planner.core.text import printable
from focus_planner.evaluation.experiment import Experiment, WriteUp
from focus_planner.evaluation.writing.evaluated import (
    FAILED,
    RESULTS,
    SECONDS,
    Evaluated,
    load_evaluated,
)
from focus_planner.evaluation.writing.plots import save_plot
from focus_planner.io.files import atomic_write, made_folder

PARAGRAPH = "paragraph.md"
#: Where the page is unless it is told otherwise, within the evaluation's folder.
PAGE = "evaluation.md"
_HEADING = "# "
# So many subjects are named.
_MOST_NAMES = 12
_VERSIONS = ("focus_planner", "python", "numba")


def write_up(evaluated: Evaluated, experiment: Experiment) -> WriteUp:
    """Write what came of an experiment beside its results: a paragraph and a plot.

    Returns
    -------
    WriteUp
        The paragraph, and what draws the plot.

    Raises
    ------
    InputError
        If there are no results, or they cannot be written.
    """
    folder = evaluated.folder / experiment.name
    written = experiment.write_up(evaluated.results(experiment))
    _write(folder / PARAGRAPH, written.text)
    save_plot(written.draw, folder / f"{experiment.name}.png")
    return written


def write_page(folder: Path, page: Path) -> None:
    """Write the page of an evaluation.

    Parameters
    ----------
    folder : Path
        The evaluation's.
    page : Path
        A Markdown file.

    Raises
    ------
    InputError
        If the folder holds no evaluation, or the page cannot be written.
    """
    made_folder(page.parent)
    _write(page, page_text(load_evaluated(folder), page.parent))


def page_text(evaluated: Evaluated, seen_from: Path) -> str:
    """Return the page of an evaluation.

    Parameters
    ----------
    evaluated : Evaluated
    seen_from : Path
        The page's folder, for its links.
    """
    experiments = list(evaluated.experiments())
    parts = [
        *_introduction(evaluated),
        *_contents(experiments),
        *(_section(evaluated, each, seen_from) for each in experiments),
    ]
    return "\n\n".join(part.strip() for part in parts) + "\n"


def _introduction(evaluated: Evaluated) -> Iterator[str]:
    setup, conditions = evaluated.setup, evaluated.conditions
    if not setup.about.startswith(_HEADING):
        yield f"{_HEADING}Evaluation"
    if setup.about:
        yield setup.about
    samples = (
        f"- **Planned** on {conditions.samples:,} samples of each, unless an experiment varies"
        f" them, and **judged** on {conditions.judged:,} others; seed {conditions.seed}"
    )
    yield "\n".join(
        [
            f"- **Subjects**: {_named(evaluated.subjects)}",
            *([f"- **Rig**: {setup.rig}"] if setup.rig else []),
            samples,
            f"- **Seconds** are those of {_machine(evaluated)}",
            *(f"- {_sentence(note)}" for note in setup.notes),
        ]
    )
    yield f"All of it again:\n\n```text\n{setup.command}\n```"


def _named(subjects: tuple[str, ...]) -> str:
    count = f"{len(subjects):,}"
    if len(subjects) > _MOST_NAMES:
        return f"{count}, from `{printable(subjects[0])}` to `{printable(subjects[-1])}`"
    return f"{count}: {', '.join(f'`{printable(name)}`' for name in subjects)}"


def _machine(evaluated: Evaluated) -> str:
    software, setup = evaluated.software, evaluated.setup
    versions = ", ".join(
        f"{name} {software[name]}"
        for name in ("focus_planner", "python", "numba")
        if name in software
    )
    if not setup.workers:
        return f"the workers of a scheduler, each task on one core; {versions}"
    cores = f"{setup.cores} {'core' if setup.cores == 1 else 'cores'}"
    processor = software.get("processor", "unknown")
    return f"a machine with {cores} ({processor}), {setup.workers}; {versions}"


def _sentence(text: str) -> str:
    return text[:1].upper() + text[1:]


def _contents(experiments: list[Experiment]) -> Iterator[str]:
    if experiments:
        yield "\n".join(
            f"- [{each.title}](#{_anchor(each.title)}) ({_place(each)})" for each in experiments
        )


def _anchor(title: str) -> str:
    """Return a heading's anchor, as GitHub and the site make it."""
    kept = "".join(c for c in title.lower() if c.isalnum() or c in " -_")
    return kept.replace(" ", "-")


def _place(experiment: Experiment) -> str:
    return f"paper: {experiment.paper}" if experiment.paper else "not in the paper"


def _section(evaluated: Evaluated, experiment: Experiment, seen_from: Path) -> str:
    results = evaluated.results(experiment)
    folder = Path(os.path.relpath(evaluated.folder / experiment.name, seen_from)).as_posix()
    count, seconds = len(results.seconds), results.seconds["task_seconds"].sum()
    tasks = f"{count:,} {'task' if count == 1 else 'tasks'}, {_took(seconds)} in all"
    failed = evaluated.failures(experiment)
    parts = [
        f"## {experiment.title}",
        f"`--experiment {experiment.name}` · {_place(experiment)}",
        experiment.write_up(results).text,
        f"![{experiment.title}]({folder}/{experiment.name}.png)",
        f"[{RESULTS}]({folder}/{RESULTS}), [{SECONDS}]({folder}/{SECONDS}): {tasks}.",
    ]
    if failed:
        what = "task failed and is" if failed == 1 else "tasks failed and are"
        parts.append(f"**{failed:,} {what} missing above**: [{FAILED}]({folder}/{FAILED}).")
    return "\n\n".join(part.strip() for part in parts)


def _took(seconds: float) -> str:
    return f"{seconds:.1f} s" if seconds < 120 else f"{seconds / 60:.1f} min"


def _write(path: Path, text: str) -> None:
    with atomic_write(path) as file:
        file.write(text.encode())
