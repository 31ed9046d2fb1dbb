# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""An experiment and subjects for tests of how experiments are run."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from focus_planner.core.rig.layouts import cylinder_rig
from focus_planner.core.surface.surface import Mesh
from focus_planner.core.validation import InputError
from focus_planner.evaluation.experiment import (
    Conditions,
    Experiment,
    Measured,
    Results,
    Row,
    Task,
    WriteUp,
    each_subject,
)
from focus_planner.evaluation.subject import Subject

CONDITIONS = Conditions(samples=20, judged=20)
SECONDS = 0.15  # that a slow task takes


@dataclass(frozen=True)
class Box:
    """A subject that takes no file.

    Attributes
    ----------
    name : str
    size : float
    log : Path, optional
        A file to which every unpacking adds the process that did it.
    trouble : str
        What unpacking it does: "refuse" it, "raise", "kill" its process.
    """

    name: str
    size: float = 0.2
    log: Path | None = None
    trouble: str = ""

    @property
    def digest(self) -> str:
        return f"box of {self.size}"

    def pack(self) -> Box:
        if self.trouble == "lost":
            raise InputError(self.name, "a file", "none")
        return self

    def unpack(self) -> Subject:
        _cause(self.trouble, self.name)
        if self.log is not None:
            note(self.log, self.name)
        corners = self.size * (np.indices((2, 2, 2)).reshape(3, 8).T - 0.5)
        faces = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1]]
        faces += [[2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
        rig = cylinder_rig(rows=1, columns=2, radius=0.6, bottom=0.0, top=0.0)
        return Subject(self.name, Mesh(corners, np.array(faces)), rig)


def boxes(count: int, **settings: object) -> list[Box]:
    return [Box(f"box{number}", 0.2 + 0.01 * number, **settings) for number in range(count)]  # type: ignore[arg-type]


def note(log: Path, what: str) -> None:
    """Add a line to a file that several processes write to."""
    with log.open("a") as file:
        file.write(f"{what} {os.getpid()}\n")


def _measure(subjects: Sequence[Subject], setting: Row, conditions: Conditions) -> Measured:
    """Return numbers that depend on all that is given, of every type that there is."""
    level = setting.get("level", 0)
    assert isinstance(level, int)
    areas = [float(np.ptp(subject.surface.vertices)) for subject in subjects]
    random = np.random.default_rng([conditions.seed, level])
    rows = [
        {
            "part": "" if part else "a, “b”",
            "value": np.float64(sum(areas) * random.random() / 3),
            "count": np.int64(part),
            "large": areas[0] > 0.3,
        }
        for part in range(2)
    ]
    return Measured(rows, {"own_seconds": 0.5})


def _slow(subjects: Sequence[Subject], setting: Row, conditions: Conditions) -> Measured:
    """Take so long that something can happen meanwhile."""
    time.sleep(SECONDS)
    return _measure(subjects, setting, conditions)


def _troubled(subjects: Sequence[Subject], setting: Row, conditions: Conditions) -> Measured:
    _cause(str(setting["trouble"]), subjects[0].name)
    return _measure(subjects, {}, conditions)


def _cause(trouble: str, name: str) -> None:
    if trouble == "refuse":
        raise InputError(name, "something else", "this", "try another")
    if trouble == "raise":
        raise ZeroDivisionError("by\nnothing")
    if trouble == "kill":
        os.kill(os.getpid(), signal.SIGKILL)


def _write_up(results: Results) -> WriteUp:
    return WriteUp(f"{len(results.rows)} rows\n", lambda figure: None)


def _neighbours(names: Sequence[str], _: Conditions) -> list[Task]:
    return [Task(pair, {"level": 0}) for pair in pairwise(names)]


LEVELS = Experiment(
    "levels",
    "Levels",
    "",
    each_subject(*({"level": level} for level in range(4))),
    _measure,
    _write_up,
)
PAIRS = replace(LEVELS, name="pairs", tasks=_neighbours)
SLOW = replace(LEVELS, name="slow", measure=_slow)
TROUBLED = replace(
    LEVELS,
    name="troubled",
    tasks=each_subject(*({"trouble": trouble} for trouble in ("none", "refuse", "raise", "kill"))),
    measure=_troubled,
)
