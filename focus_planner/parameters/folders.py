# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Where paths may lead that are changed while the node runs, by anyone on the network."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from focus_planner.core.validation import InputError

#: The parameters that are paths.
PATHS = ("lens_tables", "record_directory")


@dataclass(frozen=True)
class DataFolders:
    """The folders that were named when the node started.

    Attributes
    ----------
    named : tuple of Path
        Without links.
    at_start : mapping of str to str
        What the paths were then, which they may be again.
    """

    named: tuple[Path, ...]
    at_start: Mapping[str, str]

    @classmethod
    def from_values(cls, values: Mapping[str, Any]) -> DataFolders:
        """Return the folders in the parameters of a node that starts.

        Raises
        ------
        InputError
            If one is no name of a folder.
        """
        names = [name for name in values["data_directories"].split(os.pathsep) if name]
        named = tuple(_resolved("data_directories", name) for name in names)
        return cls(named, {name: values[name] for name in PATHS})

    def check(self, parameter: str, name: str) -> None:
        """Raise unless a parameter may be changed to this path; looks for links on the disk.

        Raises
        ------
        InputError
            If it is neither empty, nor what it was at the start, nor within a folder named then.
        """
        if name in ("", self.at_start[parameter]):
            return
        if self.named:
            place = _resolved(parameter, name)
            if any(folder in (place, *place.parents) for folder in self.named):
                return
        raise InputError(
            parameter,
            "a path in one of the data_directories that the node was started with",
            f"{name!r}, with {os.pathsep.join(map(str, self.named)) or 'none'}",
            f"start the node with this {parameter}, or with its folder in data_directories",
        )


def _resolved(parameter: str, name: str) -> Path:
    try:
        return Path(name).expanduser().resolve()
    except (OSError, RuntimeError, ValueError):  # no such user, links in a circle, a null character
        raise InputError(parameter, "a path", f"{name!r}, which leads nowhere") from None
