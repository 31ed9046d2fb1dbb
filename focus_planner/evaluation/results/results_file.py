# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The results of one experiment in two files, which are whole whenever they are read again.

``results.csv`` has the rows that tasks measured, ``seconds.csv`` a line for every task, which is
written after its rows, and makes them count. Whatever else a process leaves that is killed, it is
dropped by the next.
"""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from focus_planner.core.validation import InputError
from focus_planner.evaluation.experiment import Conditions, Results, Value
from focus_planner.evaluation.results.cells import text_of, value_of
from focus_planner.evaluation.running.work import Failed, Job, Succeeded
from focus_planner.io.files import atomic_write, made_folder, read_bytes

if TYPE_CHECKING:
    from pandas import DataFrame

_Line = list[str]
_Label = tuple[str, ...]
_SUBJECT, _TASK_SECONDS, _TASK = "subject", "task_seconds", "task"
# Columns of names, whatever these look like.
_TEXTS = frozenset({_SUBJECT, _TASK})
_REMEDY = "give another --output, or remove the folder"


class ResultsFile:
    """What an experiment has measured so far, on disk.

    Parameters
    ----------
    folder : Path
        The experiment's own; made if it is missing.
    jobs : sequence of Job
        All of the experiment.

    Raises
    ------
    InputError
        If the files there are not readable as results of this experiment.
    """

    def __init__(self, folder: Path, jobs: Sequence[Job]) -> None:
        self._folder = made_folder(folder)
        self._labels = {job.key: _label(job) for job in jobs}
        if len(set(self._labels.values())) < len(jobs):
            raise ValueError("two tasks of an experiment have the same subjects and setting")
        self._leading = [_SUBJECT, *(jobs[0].task.setting if jobs else ())]
        self._rows = _Table(folder / "results.csv", self._leading)
        self._seconds = _Table(folder / "seconds.csv", self._leading)
        self._load()

    @property
    def done(self) -> set[str]:
        """The keys of the jobs whose rows are kept."""
        return {line[-1] for line in self._seconds.lines} & self._labels.keys()

    def add(self, found: Iterable[tuple[Job, Succeeded]]) -> None:
        """Keep what jobs have found, for good.

        Raises
        ------
        InputError
            If it cannot be written.
        ValueError
            If the columns are not those of the tasks before.
        """
        rows: list[Mapping[str, Value]] = []
        seconds: list[Mapping[str, Value]] = []
        for job, what in found:
            subject = "+".join(job.task.subjects)
            leading: dict[str, Value] = {_SUBJECT: subject, **job.task.setting}
            rows += [_joined(leading, row) for row in what.measured.rows]
            took: dict[str, Value] = {
                **what.measured.seconds,
                _TASK_SECONDS: what.seconds,
                _TASK: job.key,
            }
            seconds.append(_joined(leading, took))
        self._rows.append(rows)
        self._seconds.append(seconds)

    def finish(self, failed: Mapping[str, Failed]) -> None:
        """Bring what is kept into the order of the tasks, and write down which have failed.

        Parameters
        ----------
        failed : mapping of str to Failed
            By the keys of jobs.
        """
        order = {label: place for place, label in enumerate(self._labels.values())}
        is_whole = len(self.done) == len(self._labels)
        for table in (self._rows, self._seconds):
            if is_whole:  # what is left of other tasks is nobody's any more
                table.keep(lambda label: label in order)
            table.lines.sort(key=lambda line: order.get(self._label_of(line), len(order)))
            table.rewrite()
        _write_failures(
            self._folder / "failed.csv",
            [*self._leading, "reason"],
            [[*self._labels[key], why.reason] for key, why in failed.items()],
        )

    def results(self, conditions: Conditions) -> Results:
        """Return what has been measured, as it was measured."""
        return Results(
            self._rows.frame(self._labels.values()),
            self._seconds.frame(self._labels.values()).drop(columns=_TASK, errors="ignore"),
            conditions,
        )

    def _load(self) -> None:
        """Drop rows that no line of ``seconds.csv`` makes count."""
        counting = {self._label_of(line) for line in self._seconds.lines}
        self._rows.keep(lambda label: label in counting)
        for table in (self._rows, self._seconds):
            if table.is_altered:
                table.rewrite()

    def _label_of(self, line: _Line) -> _Label:
        return tuple(line[: len(self._leading)])


class _Table:
    """A file of lines, of which the last may be torn; and the lines."""

    def __init__(self, path: Path, leading: Sequence[str]) -> None:
        self._path = path
        self._leading = leading
        self.header: _Line = []
        self.lines: list[_Line] = []
        self.is_altered = False
        if path.exists() and path.stat().st_size:
            self._read()

    def _read(self) -> None:
        content = read_bytes(self._path, "results")
        whole = content[: content.rfind(b"\n") + 1]
        try:
            lines = list(csv.reader(io.StringIO(whole.decode(), newline=""), strict=True))
        except (UnicodeDecodeError, csv.Error):
            raise self._foreign("something else") from None
        self.is_altered = len(whole) < len(content)
        self.header, self.lines = (lines[0], lines[1:]) if lines else ([], [])
        if self.header and self.header[: len(self._leading)] != list(self._leading):
            raise self._foreign(f"columns {', '.join(self.header)}")
        if any(len(line) != len(self.header) for line in self.lines):
            raise self._foreign("lines of different length")

    def _foreign(self, got: str) -> InputError:
        return InputError(str(self._path), "results of this experiment", got, _REMEDY)

    def keep(self, wanted: Callable[[_Label], bool]) -> None:
        """Drop the lines whose label is not wanted."""
        count = len(self._leading)
        kept = [line for line in self.lines if wanted(tuple(line[:count]))]
        self.is_altered |= len(kept) < len(self.lines)
        self.lines = kept

    def append(self, rows: Sequence[Mapping[str, Value]]) -> None:
        """Add lines at once, and return when they are on disk."""
        if not rows:
            return
        is_new = not self.header
        self.header = self.header or list(rows[0])
        for row in rows:
            if list(row) != self.header:
                raise ValueError(f"{self._path.name}: {list(row)} after {self.header}")
        lines = [[_cell(name, value) for name, value in row.items()] for row in rows]
        try:
            with self._path.open("ab") as file:
                file.write(_csv([self.header, *lines] if is_new else lines))
                file.flush()
                os.fsync(file.fileno())
        except OSError as error:
            reason = error.strerror or str(error)
            raise InputError(str(self._path), "a file that can be written", reason) from None
        self.lines += lines

    def rewrite(self) -> None:
        """Replace the file by the lines."""
        if self.header:
            with atomic_write(self._path) as file:
                file.write(_csv([self.header, *self.lines]))
        self.is_altered = False

    def frame(self, labels: Iterable[_Label]) -> DataFrame:
        """Return the lines of some labels as they were before they became text."""
        from pandas import DataFrame  # noqa: PLC0415 - it takes a second

        wanted, count = set(labels), len(self._leading)
        lines = [
            [
                text if name in _TEXTS else value_of(text)
                for name, text in zip(self.header, line, strict=True)
            ]
            for line in self.lines
            if tuple(line[:count]) in wanted
        ]
        return DataFrame(lines, columns=self.header or [*self._leading])


def _label(job: Job) -> _Label:
    return ("+".join(job.task.subjects), *map(text_of, job.task.setting.values()))


def _cell(name: str, value: Value) -> str:
    return str(value) if name in _TEXTS else text_of(value)


def _joined(leading: Mapping[str, Value], measured: Mapping[str, Value]) -> dict[str, Value]:
    if not leading.keys().isdisjoint(measured):
        raise ValueError(f"measured columns are called as the setting's: {list(measured)}")
    return {**leading, **measured}


def _csv(lines: Iterable[Sequence[str]]) -> bytes:
    text = io.StringIO(newline="")
    csv.writer(text, lineterminator="\n").writerows(lines)
    return text.getvalue().encode()


def _write_failures(path: Path, header: Sequence[str], lines: Sequence[Sequence[str]]) -> None:
    if not lines:
        path.unlink(missing_ok=True)
        return
    with atomic_write(path) as file:
        file.write(_csv([header, *lines]))
