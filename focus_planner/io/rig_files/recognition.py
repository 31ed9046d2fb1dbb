# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Which program's cameras a file probably holds, to say so where it is given for another."""

from __future__ import annotations

import re
from itertools import islice
from pathlib import Path

from focus_planner.core.validation import InputError
from focus_planner.io.files import MAX_TEXT, is_folder, read_text

# By the kind of rig: what only its files have, and near their beginning.
_SIGNS = {
    "metashape": r"\A\s*<(\?xml|document|chunk)\b",
    "nerfstudio": r"\A\s*\{.*\"transform_matrix\"",
    "realitycapture": r"^#\s*name,x,y,",
    "kalibr": r"^cam0:\s*$|\A\s*\{?\"?cam0\"?:",
    "transforms": r"child_frame_id\"?:|static_transform_publisher",
}
_START = 20_000  # characters
_ENDINGS = (".json", ".xml", ".csv", ".yaml", ".yml")
_MOST = 50  # files of a folder that are looked at


def probable_kind(text: str) -> str:
    """Return the kind of rig, as ``focus_planner rig`` calls it, of a file's text; "" if none."""
    start = text[:_START]
    for kind, sign in _SIGNS.items():
        if re.search(sign, start, re.MULTILINE | re.DOTALL):
            return kind
    return ""


def probable_kind_of_file(path: Path) -> str:
    """Return the kind of rig of a file; "" if it is of none, or cannot be read as text."""
    try:
        return probable_kind(read_text(path, "text", MAX_TEXT))
    except InputError:
        return ""


def file_of_kind(folder: Path, kind: str) -> Path | None:
    """Return the first file of a kind of rig in a folder; None if there is none, or no folder."""
    if not is_folder(folder):
        return None
    try:
        found = sorted(each for each in folder.iterdir() if each.suffix.lower() in _ENDINGS)
    except OSError:
        return None
    return next(
        (each for each in islice(found, _MOST) if probable_kind_of_file(each) == kind), None
    )
