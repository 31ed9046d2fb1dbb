# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Evaluation: the paper's experiments, and more, on many subjects and many machines.

``experiments/X.py`` is the experiment X: its settings, what a task measures, and what it writes of
the results, with what several of them share in ``measuring``. ``experiment`` says what they have
in common, ``subject`` what they get. Subjects come from ``finding``; ``running`` has tasks done,
here or on many machines; ``results`` keeps what comes of them; ``writing`` makes tables, plots and
the page.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from focus_planner.evaluation.alone import evaluate
    from focus_planner.evaluation.experiment import Conditions, Experiment, Results
    from focus_planner.evaluation.experiments import EXPERIMENTS
    from focus_planner.evaluation.finding.finding import find_sources

__all__ = [
    "EXPERIMENTS",
    "Conditions",
    "Experiment",
    "Results",
    "evaluate",
    "find_sources",
]

_HOMES = {
    "EXPERIMENTS": "experiments",
    "Conditions": "experiment",
    "Experiment": "experiment",
    "Results": "experiment",
    "evaluate": "alone",
    "find_sources": "finding.finding",
}


def __getattr__(name: str) -> Any:
    """Import a public name when it is asked for: what runs experiments takes seconds."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
