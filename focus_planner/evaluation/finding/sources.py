# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Subjects as files, and on their way to other machines.

A source is what one machine has, files; a parcel is what it sends to others, who unpack a subject.
"""

from __future__ import annotations

import hashlib
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

from focus_planner.core.notes import Note
from focus_planner.core.rig.rig import Rig
from focus_planner.core.validation import InputError
from focus_planner.evaluation.finding.placing import Placing
from focus_planner.evaluation.finding.recorded import subjects_in_run
from focus_planner.evaluation.subject import Subject
from focus_planner.io.files import read_bytes
from focus_planner.io.rigs import rig_to_yaml
from focus_planner.io.surface_files import surface_files
from focus_planner.io.surfaces import load_surface


@dataclass(frozen=True)
class Parcel:
    """A subject on its way to another machine: the content of its files, and what to do with it.

    Attributes
    ----------
    name : str
    files : mapping of str to bytes
    recipe : Recipe
    """

    name: str
    files: Mapping[str, bytes]
    recipe: Recipe

    def unpack(self) -> Subject:
        """Return the subject.

        Raises
        ------
        InputError
            If its files cannot be read, which whoever packed it could.
        """
        with _unpacked(self.files) as folder:
            subject = self.recipe.subject(self.name, folder / next(iter(self.files)))
            return _without_folder(subject, folder)


@dataclass(frozen=True)
class Source:
    """A subject's files.

    Attributes
    ----------
    name : str
        Unique within an evaluation.
    digest : str
        SHA-256 of all that decides what the subject is: its files' content, its rig, its place.
    path : Path
    recipe : Recipe
    """

    name: str
    digest: str
    path: Path
    recipe: Recipe

    @classmethod
    def of(cls, name: str, path: Path, recipe: Recipe) -> Source:
        """Return a subject's source, which is read for its digest.

        Raises
        ------
        InputError
            If it cannot be read.
        """
        return cls(name, _digest(recipe.files(path), recipe), path, recipe)

    @property
    def rig(self) -> Rig | None:
        """The subject's rig; None for the one of its recorded run."""
        return self.recipe.rig

    def pack(self) -> Parcel:
        """Return the parcel to send; for machines that have the files.

        Raises
        ------
        InputError
            If they cannot be read any more, or changed since.
        """
        files = self.recipe.files(self.path)
        if _digest(files, self.recipe) != self.digest:
            raise InputError(
                str(self.path), "the file that was there when the evaluation began", "another one"
            )
        return Parcel(self.name, files, self.recipe)


@dataclass(frozen=True)
class Recipe(ABC):
    """How files become a subject.

    Attributes
    ----------
    rig : Rig or None
        None for that of the files.
    """

    rig: Rig | None

    @abstractmethod
    def files(self, path: Path) -> dict[str, bytes]:
        """Return the content of the files that are needed, the one to read first."""

    @abstractmethod
    def subject(self, name: str, path: Path) -> Subject:
        """Return the subject of a file."""

    @abstractmethod
    def text(self) -> str:
        """Return all that the subject depends on beside the files."""


@dataclass(frozen=True)
class SurfaceRecipe(Recipe):
    """How the file of a surface becomes a subject.

    Attributes
    ----------
    rig : Rig
    placing : Placing
    notes : tuple of Note
    """

    rig: Rig
    placing: Placing
    notes: tuple[Note, ...]

    def files(self, path: Path) -> dict[str, bytes]:
        """Return the content of its files, without textures."""
        return surface_files(path)

    def subject(self, name: str, path: Path) -> Subject:
        """Return the surface before the rig."""
        surface = self.placing.apply(load_surface(path, looks=False))
        return Subject(name, surface, self.rig, (*surface.notes, *self.notes))

    def text(self) -> str:
        """Return the rig and the surface's place."""
        return f"{self.placing}\n{rig_to_yaml(self.rig)}"


@dataclass(frozen=True)
class RunRecipe(Recipe):
    """How a recorded run becomes a subject.

    Attributes
    ----------
    rig : Rig or None
        None for the run's own.
    which : str
        The subject's name in the run.
    """

    rig: Rig | None
    which: str

    def files(self, path: Path) -> dict[str, bytes]:
        """Return the content of the run's MCAP file."""
        file = next(iter(sorted(path.glob("*.mcap")))) if path.is_dir() else path
        return {file.name: read_bytes(file, "a recorded run")}

    def subject(self, name: str, path: Path) -> Subject:
        """Return the surface of the run before its rig, or the other one."""
        surfaces, rig = subjects_in_run(path)
        surface = surfaces[self.which]
        return Subject(name, surface, self.rig or rig, surface.notes)

    def text(self) -> str:
        """Return the rig, if it is not the run's own, and which subject it is."""
        return f"{self.which}\n{rig_to_yaml(self.rig) if self.rig else ''}"


def _digest(files: Mapping[str, bytes], recipe: Recipe) -> str:
    digest = hashlib.sha256(recipe.text().encode())
    for name, content in files.items():
        digest.update(f"\n{Path(name).suffix} {len(content)}\n".encode())
        digest.update(content)
    return digest.hexdigest()


@contextmanager
def _unpacked(files: Mapping[str, bytes]) -> Iterator[Path]:
    """Yield a folder with the files, for as long as the block runs."""
    with TemporaryDirectory(prefix="focus_planner_") as name:
        folder = Path(name)
        for file, content in files.items():
            path = folder / file
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
        yield folder


def _without_folder(subject: Subject, folder: Path) -> Subject:
    """Return the subject without the name of a folder that nobody else has."""

    def told(notes: tuple[Note, ...]) -> tuple[Note, ...]:
        return tuple(Note(each.code, each.text.replace(f"{folder}/", "")) for each in notes)

    surface = replace(subject.surface, notes=told(subject.surface.notes))
    return replace(subject, surface=surface, notes=told(subject.notes))
