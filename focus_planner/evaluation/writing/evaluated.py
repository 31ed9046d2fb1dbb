# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A finished evaluation, read from its folder alone."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pandas import DataFrame

from focus_planner.core.validation import InputError
from focus_planner.evaluation.experiment import Conditions, Experiment, Results
from focus_planner.evaluation.experiments import EXPERIMENTS
from focus_planner.evaluation.results.cells import value_of
from focus_planner.evaluation.writing.setup import Setup
from focus_planner.io.files import read_text

RESULTS, SECONDS, FAILED = "results.csv", "seconds.csv", "failed.csv"
_KEY = "task"


@dataclass(frozen=True)
class Evaluated:
    """An evaluation's folder.

    Attributes
    ----------
    folder : Path
    conditions : Conditions
    subjects : tuple of str
        Their names.
    software : mapping of str to str
        Versions, and the processor, of where it was begun.
    setup : Setup
    """

    folder: Path
    conditions: Conditions
    subjects: tuple[str, ...]
    software: dict[str, str]
    setup: Setup

    def experiments(self) -> Iterator[Experiment]:
        """Yield those of which there are results, in the order of the page."""
        for experiment in EXPERIMENTS.values():
            if (self.folder / experiment.name / RESULTS).is_file():
                yield experiment

    def results(self, experiment: Experiment) -> Results:
        """Return the results of an experiment.

        Raises
        ------
        InputError
            If they cannot be read.
        """
        folder = self.folder / experiment.name
        seconds = _frame(folder / SECONDS).drop(columns=_KEY, errors="ignore")
        return Results(_frame(folder / RESULTS), seconds, self.conditions)

    def failures(self, experiment: Experiment) -> int:
        """Return how many tasks of an experiment failed."""
        path = self.folder / experiment.name / FAILED
        return len(_frame(path)) if path.is_file() else 0


def load_evaluated(folder: Path) -> Evaluated:
    """Read what an evaluation's folder says of it.

    Raises
    ------
    InputError
        If it is none.
    """
    path = folder / "evaluation.json"
    try:
        noted: dict[str, Any] = json.loads(read_text(path, "an evaluation"))
        conditions = Conditions(**noted["conditions"])
        subjects, software = (*noted["subjects"],), dict(noted["software"])
    except (ValueError, KeyError, TypeError):
        raise InputError(str(path), "what an evaluation was made of", "something else") from None
    return Evaluated(folder, conditions, subjects, software, Setup.load(folder))


def _frame(path: Path) -> DataFrame:
    header, *lines = csv.reader(
        read_text(path, "results of an experiment").splitlines(), strict=True
    )
    rows = [[name, *map(value_of, rest)] for name, *rest in lines]
    return DataFrame(rows, columns=header)
