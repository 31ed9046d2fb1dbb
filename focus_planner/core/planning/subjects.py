# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The subjects that one plan is made for."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace

from focus_planner.core.notes import Note
from focus_planner.core.planning.request import MAX_SUBJECTS
from focus_planner.core.surface.scene import Scene
from focus_planner.core.validation import InputError, check_number


@dataclass(frozen=True, eq=False)
class Subject:
    """A scene as one of several that a plan is made for.

    Parameters
    ----------
    scene : Scene
        Of the subject alone, in the rig's frame.
    name : str
        What results, notes and errors call it; by default "subject 1", "subject 2" and so on.
    weight : float
        How much it counts in the mean over all subjects, relative to the others; above 0.

    Raises
    ------
    InputError
        If the weight is out of range.
    """

    scene: Scene
    name: str = ""
    weight: float = 1.0

    def __post_init__(self) -> None:
        check_number("weight of a subject", self.weight, above=0)

    @contextmanager
    def told(self) -> Iterator[None]:
        """Have errors say that they are about this subject."""
        try:
            yield
        except InputError as error:
            raise InputError(
                f"{self.name}: {error.argument}", error.expected, error.got, error.remedy
            ) from None

    def noted(self, notes: Sequence[Note]) -> tuple[Note, ...]:
        """Return notes that say that they are about this subject."""
        return tuple(Note(note.code, f"{self.name}: {note.text}") for note in notes)


#: What can be planned for.
Scenes = Scene | Subject | Sequence[Scene | Subject]


def subjects_of(scenes: Scenes) -> tuple[Subject, ...]:
    """Return the subjects, each with a name of its own.

    Raises
    ------
    InputError
        If there are none or too many, or two have the same name.
    """
    listed = [scenes] if isinstance(scenes, (Scene, Subject)) else list(scenes)
    if not 1 <= len(listed) <= MAX_SUBJECTS:
        raise InputError("subjects", f"1 to {MAX_SUBJECTS}", str(len(listed)))
    subjects = [each if isinstance(each, Subject) else Subject(each) for each in listed]
    named = tuple(
        replace(each, name=each.name or f"subject {number}")
        for number, each in enumerate(subjects, 1)
    )
    names = [each.name for each in named]
    twice = [name for name in dict.fromkeys(names) if names.count(name) > 1]
    if twice:
        raise InputError("subjects", "a name of its own for each", f"{twice[0]!r} twice")
    return named
