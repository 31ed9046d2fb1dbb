# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What an evaluation takes: a folder of surfaces or of recorded runs becomes its subjects."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeVar

from focus_planner.core.arrays import FloatArray
from focus_planner.core.notes import Note
from focus_planner.core.rig.layouts import cylinder_rig
from focus_planner.core.rig.rig import Rig
from focus_planner.core.surface.surface import Surface
from focus_planner.core.validation import InputError, first_few
from focus_planner.evaluation.finding.boxes import read_boxes
from focus_planner.evaluation.finding.placing import (
    UNITS,
    Place,
    Placing,
    find_unit,
    find_up,
    notes_on,
    rig_centre,
)
from focus_planner.evaluation.finding.recorded import subjects_in_run
from focus_planner.evaluation.finding.sources import RunRecipe, Source, SurfaceRecipe
from focus_planner.evaluation.finding.subject_files import SubjectFile, subject_files
from focus_planner.io.files import is_there
from focus_planner.io.surfaces import load_surface

_Item = TypeVar("_Item")
# Of a data set, to find which axis is up.
_TRIED = 5


@dataclass(frozen=True)
class Options:
    """How the files of an evaluation are to be taken.

    Attributes
    ----------
    rig : Rig, optional
        By default each run's own, and for surfaces that of the paper.
    up : str, optional
        The axis that is up in the files; by default found for surfaces that are centred, else z.
    unit : {"m", "cm", "mm"}, optional
        Of the files; by default found for surfaces that are centred, else metres.
    place : {"as_is", "centred"}, optional
        By default surfaces are centred before the paper's rig, and left as they are before another:
        their coordinates are then those of the rig's frame, and nothing is assumed.
    most : int, optional
        How many subjects to take, spread over all by their names.
    processes : int
        How many may share the reading of files; scripts that use more than one need the usual
        ``if __name__ == "__main__"``.
    """

    rig: Rig | None = None
    up: str | None = None
    unit: str | None = None
    place: Place | None = None
    most: int | None = None
    processes: int = 1


@dataclass(frozen=True)
class Found:
    """What was found.

    Attributes
    ----------
    sources : tuple of Source
        Sorted by name.
    notes : tuple of Note
        What was assumed of all, and what was left out.
    """

    sources: tuple[Source, ...]
    notes: tuple[Note, ...] = ()


def find_sources(
    data: Path,
    options: Options = Options(),
    on_progress: Callable[[int, int], object] = lambda _done, _all: None,
) -> Found:
    """Return the sources in a folder of surfaces and of recorded runs, or of a single one.

    All are read once, so that what is broken is told before the work begins.

    Parameters
    ----------
    data : Path
    options : Options
    on_progress : callable, optional
        Called with the number of files that are read, and of all; may raise to end it.

    Raises
    ------
    InputError
        If there is nothing that can be read, or the options do not fit what there is.
    """
    if not is_there(data):
        raise InputError(str(data), "a folder of meshes or of recorded runs", "no such folder")
    files = spread(subject_files(data), options.most)
    if not files:
        expected = "at least one mesh, point cloud or recorded run in it or below"
        raise InputError(str(data), expected, "none")
    _check(options, files)
    reading = _Reading(options)
    for done, _ in enumerate(reading.read(files), 1):
        on_progress(done, len(files))
    found = reading.found()
    if not found.sources:
        raise InputError(str(data), "at least one subject that can be read", reading.left_out[0])
    return replace(found, notes=(*found.notes, *_on_versions(data, files)))


def spread(files: Sequence[_Item], most: int | None) -> list[_Item]:
    """Return so many, spread evenly over all: neighbours are often the same person.

    >>> spread("abcdef", 3)
    ['a', 'c', 'e']
    """
    if most is None or most >= len(files):
        return list(files)
    return [files[index * len(files) // most] for index in range(most)]


def _check(options: Options, files: Sequence[SubjectFile]) -> None:
    """Raise if options are given that apply to nothing."""
    if any(not file.is_run for file in files):
        return
    for name in ("up", "unit", "place"):
        if getattr(options, name) is not None:
            expected = "surfaces from files: those of recorded runs are in the rig's frame"
            raise InputError(f"--{name}", expected, "only recorded runs", "leave it out")


class _Reading:
    """Reads all files, and finds what they have in common.

    Attributes
    ----------
    left_out : list of str
        What cannot be read, and why.
    """

    def __init__(self, options: Options) -> None:
        self._options = options
        self._runs = list[Source]()
        self.left_out = list[str]()
        self._boxes = dict[str, FloatArray]()
        self._paths = dict[str, Path]()

    def read(self, files: Sequence[SubjectFile]) -> Iterator[SubjectFile]:
        """Read files, and yield each that is done; what cannot be read is left out."""
        for file in files:
            if file.is_run:
                self._read_run(file)
                yield file
        surfaces = [file for file in files if not file.is_run]
        paths = [file.path for file in surfaces]
        with closing(read_boxes(paths, self._options.processes)) as boxes:
            for file, box in zip(surfaces, boxes, strict=True):
                if isinstance(box, str):
                    self.left_out.append(f"{file.path}: {box}")
                else:
                    self._boxes[file.name], self._paths[file.name] = box, file.path
                yield file

    def _read_run(self, file: SubjectFile) -> None:
        try:
            self._runs += self._sources_of_run(file)
        except InputError as error:
            self.left_out.append(f"{file.path}: {_why(error, file.path)}")

    def _sources_of_run(self, file: SubjectFile) -> Iterator[Source]:
        names, _ = subjects_in_run(file.path)
        for which in names:
            name = f"{file.name}/{which}" if len(names) > 1 else file.name
            yield Source.of(name, file.path, RunRecipe(self._options.rig, which))

    def found(self) -> Found:
        """Return the sources, and what was assumed."""
        notes = tuple(Note("left_out", f"left out: {what}") for what in self.left_out)
        if not self._paths:
            return Found((*self._runs,), notes)
        rig, placing, assumed = self._placed()
        recipe = SurfaceRecipe(rig, placing, assumed)
        sources = [Source.of(name, path, recipe) for name, path in self._paths.items()]
        ordered = sorted([*sources, *self._runs], key=lambda source: source.name)
        return Found((*ordered,), (*assumed, *notes))

    def _placed(self) -> tuple[Rig, Placing, tuple[Note, ...]]:
        """Return the rig, how all surfaces come before it, and what was assumed for that."""
        options = self._options
        rig = options.rig or cylinder_rig()
        place = options.place or ("as_is" if options.rig else "centred")
        in_frame = place == "as_is"
        unit = options.unit or ("m" if in_frame else find_unit(self._boxes, rig))
        centre = None if in_frame else rig_centre(rig)
        placing = Placing(options.up or "z", UNITS[unit], centre)
        if options.up is None and not in_frame:
            placing = replace(placing, up=find_up(self._tried(), placing, rig))
        notes = notes_on(
            placing,
            unit,
            up_found=options.up is None,
            unit_found=options.unit is None,
            moves=any(map(placing.moves, self._boxes.values())),
        )
        return rig, placing, notes

    def _tried(self) -> list[Surface]:
        paths = list(self._paths.values())
        step = max(len(paths) // _TRIED, 1)
        return [load_surface(path, looks=False) for path in paths[::step][:_TRIED]]


def _why(error: InputError, path: Path) -> str:
    """Return what is wrong, without the path once more."""
    return str(error).removeprefix(f"{path}: ")


def _on_versions(data: Path, files: Sequence[SubjectFile]) -> tuple[Note, ...]:
    """Return a note on subjects of which there is more than one version."""
    several = [file for file in files if file.others]
    if not several:
        return ()
    first, *others = (path.relative_to(data) for path in (several[0].path, *several[0].others))
    count = f"{len(several)} {'subject' if len(several) == 1 else 'subjects'}"
    return (
        Note(
            "left_out",
            f"of {count} there are several versions; the whole, finest one is taken, such as"
            f" {first}, not {first_few(map(str, others))}",
        ),
    )
