# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What ``focus_planner evaluate`` notes of itself for the page."""

from __future__ import annotations

import argparse
import shlex
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from focus_planner.core.validation import first_few

if TYPE_CHECKING:
    from focus_planner.evaluation.experiment import Experiment
    from focus_planner.evaluation.finding.finding import Found
    from focus_planner.evaluation.finding.sources import Source
    from focus_planner.evaluation.writing.setup import Setup

#: Stands for every experiment.
ALL = "all"


def setup_of(options: argparse.Namespace, experiments: Sequence[Experiment], found: Found) -> Setup:
    """Return what was asked for, now and before, and where the evaluation began."""
    from focus_planner.evaluation.writing.setup import Setup

    begun = Setup.load(options.output) if Setup.is_in(options.output) else Setup()
    return replace(
        begun,
        command=_command(options, experiments),
        about=options.about or begun.about,
        rig=_rig_in_words(options, found.sources),
        notes=tuple(note.text for note in found.notes),
        workers=_workers_in_words(options) if begun == Setup() else begun.workers,
    )


def _workers_in_words(options: argparse.Namespace) -> str:
    if options.scheduler is not None:
        return ""
    if options.workers == 1:
        return "where one process did one task at a time, on all cores"
    from dask.system import CPU_COUNT

    return f"where {options.workers or CPU_COUNT} processes did a task each, on one core"


def _rig_in_words(options: argparse.Namespace, sources: Sequence[Source]) -> str:
    rigs = [source.rig for source in sources]
    cameras = sorted({len(rig.cameras) for rig in rigs if rig is not None})
    counts = first_few(map(str, cameras))
    if options.rig is not None:
        return f"`{options.rig}`, {counts} cameras"
    if None not in rigs:
        return f"the paper's, {counts} cameras on a cylinder"
    own = "each recorded run's own"
    return f"{own}; for the others the paper's, {counts} cameras on a cylinder" if cameras else own


def _command(options: argparse.Namespace, experiments: Sequence[Experiment]) -> str:
    """Return what to type to have all results in the folder again."""
    from focus_planner.evaluation.experiments import EXPERIMENTS

    asked = {each.name for each in experiments}
    names = [name for name in EXPERIMENTS if name in asked or (options.output / name).is_dir()]
    names = [ALL] if len(names) == len(EXPERIMENTS) else names
    words = ["focus_planner", "evaluate", str(options.data), "--experiment", *names]
    words += ["--output", str(options.output)]
    defaults = {"samples": 1000, "judged": 65_536, "seed": 0}
    others = ("rig", "subjects", "up", "unit", "place", "page")
    for name, default in (defaults | dict.fromkeys(others)).items():
        value = getattr(options, name)
        if value != default:
            words.append(f"--{name}={value}" if str(value).startswith("-") else f"--{name}")
            words += [] if str(value).startswith("-") else [str(value)]
    return shlex.join(words)
