# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""``focus_planner evaluate``: the paper's experiments, and more, on one's own subjects."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from focus_planner.cli.compiling import compile_first
from focus_planner.cli.evaluate_options import add_conditions, add_subjects, add_workers
from focus_planner.cli.evaluate_setup import ALL, setup_of
from focus_planner.cli.progress import Shows, Tell, show_share, shown
from focus_planner.cli.terminal import show_error, show_note
from focus_planner.core.validation import InputError, check_choice

if TYPE_CHECKING:
    from focus_planner.core.rig.rig import Rig
    from focus_planner.evaluation.experiment import Conditions, Experiment
    from focus_planner.evaluation.finding.finding import Found
    from focus_planner.evaluation.finding.sources import Source
    from focus_planner.evaluation.running.running import Outcome, TasksDone, Workers

_FAILED = 1
_DESCRIPTION = """\
Run experiments on subjects: those of the paper, and what it could not do. DATA is a folder of
meshes or point clouds in any layout, such as 3DBodyTex as it is downloaded, or of recorded runs.
Every experiment writes its results, a plot and a paragraph to a folder of its own in DIR, and all
are on one page. What was done is kept: the same command goes on where it was stopped.

Exit status 0: done; 1: some tasks failed, which the same command tries again.
"""


class _Help(argparse.Action):
    """Shows the help, with the experiments, which take a second to load."""

    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> None:
        from focus_planner.evaluation.experiments import EXPERIMENTS

        width = max(map(len, EXPERIMENTS))
        lines = [
            f"  {each.name:<{width}}  {each.title} ({each.paper or 'not in the paper'})"
            for each in EXPERIMENTS.values()
        ]
        parser.epilog = "\n".join(["experiments:", *lines])
        parser.print_help()
        parser.exit()


def add(commands: Any) -> None:
    """Add the command."""
    evaluate = commands.add_parser(
        "evaluate",
        help="run the paper's experiments, and more, on a folder of meshes or recorded runs",
        description=_DESCRIPTION,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        add_help=False,
    )
    evaluate.set_defaults(command=run)
    option = evaluate.add_argument
    option("-h", "--help", action=_Help, nargs=0, help="show this help message and exit")
    option("data", type=Path, metavar="DATA", help="folder, or a single surface or run")
    names = option(
        "--experiment",
        nargs="+",
        required=True,
        metavar="NAME",
        help="which experiments to run: see below; all for all of them",
    )
    names.completer = _names
    option(
        *("-o", "--output"), type=Path, required=True, metavar="DIR", help="folder for the results"
    )
    add_conditions(evaluate.add_argument_group("conditions"))
    add_subjects(evaluate.add_argument_group("subjects"))
    add_workers(evaluate.add_argument_group("workers"))
    option(
        "--about",
        default="",
        metavar="TEXT",
        help="what the subjects are, for the page: Markdown, which may begin with its title",
    )
    option(
        "--page",
        type=Path,
        metavar="FILE.MD",
        help="the page of all experiments in Markdown (default: evaluation.md in DIR)",
    )
    option("--quiet", action="store_true", help="show no progress, and print no results")


def _names(**_: Any) -> list[str]:
    from focus_planner.evaluation.experiments import EXPERIMENTS

    return [ALL, *EXPERIMENTS]


# --- the command -------------------------------------------------------------------------------


def run(options: argparse.Namespace) -> int:
    """Run the experiments; return the exit status."""
    import distributed  # noqa: F401 - that it is missing is told before the work
    import matplotlib as mpl  # noqa: F401
    import pandas as pd  # noqa: F401

    with shown(options.quiet) as tell:
        tell("loading the experiments")
        experiments, conditions = _experiments(options.experiment), _conditions(options)
        page = _checked_page(options)
        found = _found(options, tell)
        if not options.quiet:
            for note in found.notes:
                show_note(note.text)
        experiments = [*_that_fit(experiments, options, conditions, found)]
        status = _evaluate(options, experiments, conditions, found, tell)
        tell(f"writing {page}")
        _write_page(options.output, page)
    if not options.quiet:
        print(f"The page: {page}")
    return status


def _experiments(names: Sequence[str]) -> list[Experiment]:
    """Return those that are asked for, in the order of the page."""
    from focus_planner.evaluation.experiments import EXPERIMENTS

    for name in names:
        check_choice("--experiment", name, (ALL, *EXPERIMENTS))
    return [each for each in EXPERIMENTS.values() if each.name in names or ALL in names]


def _conditions(options: argparse.Namespace) -> Conditions:
    from focus_planner.core.validation import check_whole
    from focus_planner.evaluation.experiment import Conditions

    return Conditions(
        check_whole("--samples", options.samples, at_least=1),
        check_whole("--judged", options.judged, at_least=1),
        check_whole("--seed", options.seed, at_least=0),
    )


def _checked_page(options: argparse.Namespace) -> Path:
    """Return where the page is to be; raise if nothing can be written there."""
    from focus_planner.evaluation.writing.page import PAGE
    from focus_planner.io.files import check_folder_writable

    page: Path = options.page or options.output / PAGE
    if page.suffix.lower() != ".md":
        raise InputError("--page", "a file name that ends in .md", str(page))
    if options.workers is not None and options.scheduler is not None:
        raise InputError("--workers and --scheduler", "one of them", "both")
    for folder in (options.output, page.parent):
        check_folder_writable(folder)
    return page


def _found(options: argparse.Namespace, tell: Tell) -> Found:
    from dask.system import CPU_COUNT

    from focus_planner.core.validation import check_whole
    from focus_planner.evaluation.finding.finding import Options, find_sources

    if options.subjects is not None:
        check_whole("--subjects", options.subjects, at_least=1)
    show = show_share(tell, f"reading {options.data}")
    told = (options.up, options.unit, options.place, options.subjects)
    wanted = Options(_rig(options), *told, processes=options.workers or CPU_COUNT)
    return find_sources(options.data, wanted, lambda done, total: show(done / total))


def _that_fit(
    experiments: Sequence[Experiment],
    options: argparse.Namespace,
    conditions: Conditions,
    found: Found,
) -> Iterator[Experiment]:
    """Yield the experiments that these subjects suffice for; raise if one is asked for by name."""
    for experiment in experiments:
        names = [source.name for source in _taken(experiment, options, found)]
        try:
            experiment.tasks(names, conditions)
        except InputError as error:
            if experiment.name in options.experiment:
                raise
            show_note(f"{experiment.name} is left out; {error}")
        else:
            yield experiment


def _taken(experiment: Experiment, options: argparse.Namespace, found: Found) -> Sequence[Source]:
    """Return the subjects that an experiment takes."""
    from focus_planner.evaluation.finding.finding import spread

    return spread(found.sources, None if options.subjects else experiment.most_subjects)


def _rig(options: argparse.Namespace) -> Rig | None:
    from focus_planner.io.rigs import load_rig

    return None if options.rig is None else load_rig(options.rig)


def _evaluate(
    options: argparse.Namespace,
    experiments: Sequence[Experiment],
    conditions: Conditions,
    found: Found,
    tell: Tell,
) -> int:
    """Run experiments one after the other, and print what came of each; return the exit status."""
    from focus_planner.evaluation.results.store import opened
    from focus_planner.evaluation.running.running import WorkersLostError, run

    status = 0
    with opened(options.output, conditions, found.sources) as store, _workers(options, tell) as who:
        setup_of(options, experiments, found).save(options.output)
        for experiment in experiments:
            sources = _taken(experiment, options, found)
            try:
                outcome = run(experiment, sources, conditions, store, who, _show(tell, experiment))
            except WorkersLostError as error:
                show_error(str(error))
                return _FAILED
            _print_outcome(options, experiment, outcome, tell)
            status = _FAILED if outcome.failures else status
    return status


@contextmanager
def _workers(options: argparse.Namespace, tell: Tell) -> Iterator[Workers]:
    """Yield those who do the work."""
    if options.scheduler is not None:
        from focus_planner.evaluation.running.connecting import connected

        tell(f"connecting to {options.scheduler}")
        with connected(options.scheduler) as cluster:
            yield cluster
        return
    from focus_planner.core.planning.work import PLANS

    compile_first(tell, PLANS)
    if options.workers == 1:
        from focus_planner.evaluation.running.here import Here

        yield Here()
        return
    from focus_planner.evaluation.running.connecting import local_cluster

    tell("starting workers")
    with local_cluster(options.workers) as cluster:
        yield cluster


def _show(tell: Tell, experiment: Experiment) -> Callable[[TasksDone], None]:
    """Return a callback that shows how far an experiment is."""
    from focus_planner.core.progress import time_spent

    def show(standing: TasksDone) -> None:
        tried = standing.done + standing.failed
        figures = [f"{standing.failed} failed"] if standing.failed else []
        if standing.seconds_left is not None:
            figures.append(f"{time_spent(standing.seconds_left)} left")
        what = f"{experiment.name}: {standing.total:,} tasks"
        if not standing.workers:
            tell(f"{experiment.name}: waiting for workers")
        elif isinstance(tell, Shows):
            tell.show_share(what, tried / max(standing.total, 1), *figures)
        else:
            tell(what)

    return show


def _print_outcome(
    options: argparse.Namespace, experiment: Experiment, outcome: Outcome, tell: Tell
) -> None:
    """Write an experiment's plot and paragraph, and print the latter."""
    from focus_planner.evaluation.writing.evaluated import load_evaluated
    from focus_planner.evaluation.writing.page import write_up

    for task, reason in outcome.failures[:3]:
        show_error(f"{experiment.name}, {task}: {reason}")
    if len(outcome.failures) > 3:
        show_error(f"{experiment.name}: {len(outcome.failures):,} tasks failed in all")
    if not outcome.done:
        return
    tell(f"writing {options.output / experiment.name}")
    written = write_up(load_evaluated(options.output), experiment)
    if not options.quiet:
        _print_markdown(f"# {experiment.title}\n\n{written.text}")


def _print_markdown(text: str) -> None:
    """Print Markdown: for people on a terminal, as it is elsewhere."""
    from rich.markdown import Markdown

    from focus_planner.cli.tables import console_for

    if sys.stdout.isatty():
        console_for(sys.stdout).print(Markdown(text))
    else:
        print(text)


def _write_page(folder: Path, page: Path) -> None:
    from focus_planner.evaluation.writing.page import write_page

    write_page(folder, page)
