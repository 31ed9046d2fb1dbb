# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Point clouds from npy files."""

from __future__ import annotations

from pathlib import Path

from focus_planner.core.validation import InputError
from focus_planner.io.files import read_array
from focus_planner.io.formats.contents import SurfaceContents


def read_npy(path: Path) -> SurfaceContents:
    """Read an array of 3 columns, or 6 with normals.

    Raises
    ------
    InputError
        If it is another array, or none.
    """
    array = read_array(path)
    if array.ndim != 2 or array.shape[1] not in (3, 6):
        raise InputError(
            str(path), "an array of shape (n, 3), or (n, 6) with normals", f"{array.shape}"
        )
    return SurfaceContents(array[:, :3], None, array[:, 3:] if array.shape[1] == 6 else None)
