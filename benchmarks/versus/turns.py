# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.
"""Two revisions that take turns, each in a process of its own, one stage at a time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.versus.process import Process
from focus_planner.core.arrays import FloatArray


@dataclass(frozen=True)
class Stage:
    """What is timed.

    Attributes
    ----------
    key : str
        Its name in ``inside/stages.py``.
    number : int
        Of samples or cameras.
    threads : int, optional
        How many Numba may use; by default one per core.
    """

    key: str
    number: int
    threads: int | None = None


@dataclass(frozen=True, eq=False)
class Timings:
    """What a stage took, turn by turn.

    Attributes
    ----------
    seconds, results : (R, 2) arrays
        Of R turns: the earlier revision's, today's. Results are what the stages return.
    """

    seconds: FloatArray
    results: FloatArray

    @property
    def medians(self) -> FloatArray:
        """(2,) seconds."""
        return np.median(self.seconds, axis=0)

    @property
    def least(self) -> FloatArray:
        """(2,) seconds."""
        return self.seconds.min(axis=0)

    def times_faster(self) -> tuple[float, float, float]:
        """Return the quartiles, the median in the middle, of the earlier ÷ today's, turn by turn.

        The two of a turn ran one after the other, when the machine was about as busy.
        """
        low, middle, high = np.quantile(self.seconds[:, 0] / self.seconds[:, 1], [0.25, 0.5, 0.75])
        return float(low), float(middle), float(high)


def take_turns(processes: Sequence[Process], stage: Stage, rounds: int) -> Timings:
    """Return what a stage takes each process, after a turn of each that does not count.

    Raises
    ------
    LackingError
        If a revision cannot run the stage.
    """
    outcomes = np.array(
        [
            [process.run(stage.key, stage.number, seed) for process in processes]
            for seed in range(rounds + 1)
        ]
    )[1:]
    return Timings(outcomes[:, :, 0], outcomes[:, :, 1])
