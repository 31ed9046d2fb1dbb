# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What an evaluation notes of itself beside its results: what was asked for, and where it ran."""

from __future__ import annotations

import json
import os
from dataclasses import asdict, dataclass, fields
from pathlib import Path

from focus_planner.core.validation import InputError
from focus_planner.io.files import atomic_write, read_text

_FILE = "setup.json"


@dataclass(frozen=True)
class Setup:
    """What was asked for, and where it ran.

    Attributes
    ----------
    command : str
        What to type to repeat all of it.
    about : str
        What the subjects are, in the words of who started it: Markdown, which may begin with the
        page's title.
    rig : str
        What the rigs are, in words.
    notes : tuple of str
        What was assumed of the subjects, and which were left out.
    cores : int
        Of the machine on which it began.
    workers : str
        What measured there, in words; empty if the workers of a scheduler did, wherever they are.
    """

    command: str = ""
    about: str = ""
    rig: str = ""
    notes: tuple[str, ...] = ()
    cores: int = os.cpu_count() or 1
    workers: str = ""

    def save(self, folder: Path) -> None:
        """Write it to the folder of an evaluation.

        Raises
        ------
        InputError
            If it cannot be written.
        """
        with atomic_write(folder / _FILE) as file:
            file.write((json.dumps(asdict(self), indent=1, ensure_ascii=False) + "\n").encode())

    @staticmethod
    def is_in(folder: Path) -> bool:
        """Return whether a folder holds one."""
        return (folder / _FILE).is_file()

    @classmethod
    def load(cls, folder: Path) -> Setup:
        """Read it from the folder of an evaluation.

        Raises
        ------
        InputError
            If there is none.
        """
        path = folder / _FILE
        try:
            values = json.loads(read_text(path, "an evaluation"))
            told = {field.name: values[field.name] for field in fields(cls)}
        except (ValueError, KeyError, TypeError):
            raise InputError(str(path), "what an evaluation notes of itself", "else") from None
        return cls(**told | {"notes": (*told["notes"],)})
