# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The folder of an evaluation: under which conditions, of which subjects, and the results."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from focus_planner.core.validation import InputError, first_few
from focus_planner.evaluation.experiment import Conditions
from focus_planner.evaluation.results.results_file import ResultsFile
from focus_planner.evaluation.running.program import program, version
from focus_planner.evaluation.running.work import Job, Source
from focus_planner.io.file_locks import locked_folder
from focus_planner.io.files import atomic_write, made_folder, read_text
from focus_planner.recording.software import software

_REMEDY = "give another --output, or remove the folder"


@dataclass(frozen=True)
class Store:
    """A folder of results, while no other process writes to it.

    Attributes
    ----------
    folder : Path
    """

    folder: Path

    def results_of(self, experiment: str, jobs: Sequence[Job]) -> ResultsFile:
        """Return the results of an experiment: those that there are, and those to come."""
        return ResultsFile(self.folder / experiment, jobs)


@contextmanager
def opened(folder: Path, conditions: Conditions, sources: Sequence[Source]) -> Iterator[Store]:
    """Hold the folder of an evaluation, which is made if it is missing.

    Raises
    ------
    InputError
        If it holds an evaluation under other conditions, of other subjects, or by another version;
        if another process writes to it; or if it cannot be written to.
    """
    _check_names(sources)
    with locked_folder(made_folder(folder), wait=False) as is_ours:
        if not is_ours:
            raise InputError(
                str(folder),
                "a folder to which nobody else writes",
                "one to which another evaluation writes",
                "wait for its end, or give another --output",
            )
        _agree(folder / "evaluation.json", conditions, sources)
        yield Store(folder)


def _check_names(sources: Sequence[Source]) -> None:
    names = [source.name for source in sources]
    odd = [name for name in names if not name.isprintable()]
    if odd:
        raise InputError("subject", "a name of printable characters", repr(odd[0]))
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise InputError("subjects", "a name of its own for each", f"several {first_few(twice)}")


def _agree(path: Path, conditions: Conditions, sources: Sequence[Source]) -> None:
    """Check that the folder holds this evaluation, or note that it does from now on."""
    subjects = {source.name: source.digest for source in sources}
    noted: dict[str, Any] = {}
    if path.exists():
        noted = _read(path)
        _check_same_version(path.parent, noted)
        _check_conditions(path.parent, noted["conditions"], conditions)
        _check_subjects(path.parent, noted["subjects"], subjects)
    told = {
        "conditions": asdict(conditions),
        "subjects": subjects,
        "software": noted.get("software") or {**software(), "sources": program()["sources"]},
    }
    if told != noted:
        with atomic_write(path) as file:
            file.write((json.dumps(told, indent=1) + "\n").encode())


def _read(path: Path) -> dict[str, Any]:
    try:
        noted = json.loads(read_text(path, "evaluation"))
        whole = all(
            isinstance(noted[part], dict) for part in ("conditions", "subjects", "software")
        )
    except (ValueError, KeyError, TypeError):
        whole = False
    if not whole:
        raise InputError(str(path), "what an evaluation was made of", "something else", _REMEDY)
    return dict(noted)


def _check_same_version(folder: Path, noted: dict[str, Any]) -> None:
    before = noted["software"].get("focus_planner")
    if before != version():
        raise InputError(
            str(folder), f"results of version {version()}", f"those of {before}", _REMEDY
        )


def _check_conditions(folder: Path, noted: dict[str, Any], conditions: Conditions) -> None:
    asked = asdict(conditions)
    differing = [name for name in asked if noted.get(name) != asked[name]]
    if differing:
        raise InputError(
            str(folder),
            "an evaluation with " + ", ".join(f"{name} {asked[name]}" for name in differing),
            "one with " + ", ".join(f"{name} {noted.get(name)}" for name in differing),
            _REMEDY,
        )


def _check_subjects(folder: Path, noted: dict[str, Any], subjects: dict[str, str]) -> None:
    others = [name for name, digest in noted.items() if subjects.get(name, digest) != digest]
    if others:
        raise InputError(
            str(folder),
            "results of the same subjects",
            f"others called {first_few(others)}",
            _REMEDY,
        )
    more = [name for name in noted if name not in subjects]
    if more:
        raise InputError(
            str(folder),
            "results of the same subjects, or of fewer",
            f"those of {first_few(more)} too",
            "give these as well, or another --output",
        )
