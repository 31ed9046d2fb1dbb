# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What a plan may take: the size of its problem, and memory.

A problem's memory is in its pairs of a sample and a camera that sees it, and how many there are is
known once rays have been cast. Before that, samples × shots × cameras is the most there can be.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from focus_planner.core.planning.request import PlanRequest
from focus_planner.core.validation import InputError

if TYPE_CHECKING:
    # Its import takes seconds, and a node, which has planning done elsewhere, does without.
    from focus_planner.core.problem.problem import Problem

# Bytes of a pair at the peak of planning, measured on a body in the paper's rig and rounded up
# (docs/results.md). Every shot has its own pairs.
_BYTES = 150
_BYTES_OF_TUPLES, _BYTES_OF_TUPLES_FOR_A_SHOT = 50, 23
_BYTES_OF_PROOF = 310
# Of a sample, which counts where few cameras see it.
_BYTES_OF_SAMPLE = 100
# Of what would fit, what is said to: other samples are seen by a few more cameras.
_CERTAIN = 0.95
_GIGA = 1e9


@dataclass(frozen=True)
class ResourceLimits:
    """The most that a request may take; infinity for no limit.

    Attributes
    ----------
    max_problem_size : float
        Samples × shots × cameras.
    max_memory : float
        Bytes.
    """

    max_problem_size: float = math.inf
    max_memory: float = math.inf

    def check_size(
        self, request: PlanRequest, samples: int, cameras: int, subjects: int = 1
    ) -> None:
        """Raise ``InputError`` if a problem of so many samples and cameras is too large.

        Parameters
        ----------
        request : PlanRequest
        samples : int
            To plan on, of each subject.
        cameras : int
            Of the rig.
        subjects : int
        """
        for what, count in (("samples", samples), ("fresh_samples", request.fresh_samples)):
            size = count * request.shots * cameras * subjects
            if size > self.max_problem_size:
                fits = math.floor(self.max_problem_size / (request.shots * cameras * subjects))
                raise InputError(
                    what,
                    f"at most {fits:,} for {_counted(request, cameras, subjects)}"
                    f" (parameter max_problem_size, {self.max_problem_size:,.0f})",
                    f"{count:,}",
                    "take fewer, or raise the parameter",
                )

    def check_memory(self, request: PlanRequest, problem: Problem, samples: int) -> float:
        """Return the bytes that planning takes, about; raise ``InputError`` if that is too much.

        Parameters
        ----------
        request : PlanRequest
        problem : Problem
            Tells how many cameras see a sample.
        samples : int
            To plan on, of all subjects together.
        """
        subjects = len(problem.subjects)
        pairs = len(problem.depth) / problem.sample_count
        needed = (_bytes_of_pair(request) * pairs + _BYTES_OF_SAMPLE) * samples
        if needed > self.max_memory:
            fits = int(_CERTAIN * samples * self.max_memory / needed / subjects)
            raise InputError(
                "samples",
                f"at most {_rounded_down(fits):,} for method {request.method} and"
                f" {_counted(request, problem.camera_count // request.shots, subjects)}"
                f" (parameter max_memory, {self.max_memory / _GIGA:.3g} GB)",
                f"{samples // subjects:,}, which would take {needed / _GIGA:.3g} GB",
                "take fewer, or raise the parameter if there is enough memory",
            )
        return needed


def _bytes_of_pair(request: PlanRequest) -> int:
    if request.method not in {"k_view", "optimal"}:
        return _BYTES
    shots = request.shots - 1
    with_tuples = _BYTES + _BYTES_OF_TUPLES + _BYTES_OF_TUPLES_FOR_A_SHOT * shots
    return max(with_tuples, _BYTES_OF_PROOF) if request.method == "optimal" else with_tuples


def _counted(request: PlanRequest, cameras: int, subjects: int) -> str:
    shots = f"{request.shots} shots of " if request.shots > 1 else ""
    of_each = f" and each of {subjects} subjects" if subjects > 1 else ""
    return f"{shots}{cameras} camera{'s' if cameras > 1 else ''}{of_each}"


def _rounded_down(count: int) -> int:
    """Return a count with two digits that count, no larger: it is an estimate."""
    unit = int(10 ** max(len(str(count)) - 2, 0))
    return count // unit * unit
