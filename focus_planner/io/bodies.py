# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The human bodies that come with the package; see ``focus_planner/bodies/README.md``."""

from __future__ import annotations

from importlib import resources
from pathlib import Path

from focus_planner.core.validation import check_choice


def bodies() -> tuple[Path, ...]:
    """Return the paths of all bodies, sorted by name."""
    folder = Path(str(resources.files("focus_planner") / "bodies"))
    return tuple(sorted(folder.glob("*.ply")))


def body(name: str) -> Path:
    """Return the path of a body's mesh.

    Parameters
    ----------
    name : {"arms_down", "arms_out", "arms_raised"}

    Raises
    ------
    InputError
        If there is no such body.
    """
    paths = {path.stem: path for path in bodies()}
    return paths[check_choice("body", name, tuple(paths))]
