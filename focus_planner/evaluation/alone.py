# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""An experiment from Python, in this process."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from focus_planner.core.validation import InputError
from focus_planner.evaluation.experiment import Conditions, Experiment, Results
from focus_planner.evaluation.results.store import opened
from focus_planner.evaluation.running.here import Here
from focus_planner.evaluation.running.running import run
from focus_planner.evaluation.running.work import Source


def evaluate(
    experiment: Experiment,
    sources: Sequence[Source],
    conditions: Conditions | None = None,
    folder: Path | None = None,
) -> Results:
    """Run an experiment in this process, one task after the other.

    Parameters
    ----------
    experiment : Experiment
    sources : sequence of Source
        Of its subjects, as :func:`~focus_planner.evaluation.finding.finding.find_sources` finds
        them.
    conditions : Conditions, optional
        By default the paper's 1,000 samples.
    folder : Path, optional
        Where to keep results as they come, for the next time; by default nowhere.

    Raises
    ------
    InputError
        If a task fails.
    """
    conditions = conditions or Conditions()
    with TemporaryDirectory() as name, opened(folder or Path(name), conditions, sources) as store:
        outcome = run(experiment, sources, conditions, store, Here())
        for task, reason in outcome.failures:
            raise InputError(task, "a task that can be done", reason)
        return outcome.file.results(conditions)
