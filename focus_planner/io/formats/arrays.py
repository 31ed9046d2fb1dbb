# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Point clouds from npy files, and meshes from archives of such."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from zipfile import is_zipfile

import numpy as np
from numpy.typing import NDArray

from focus_planner.core.validation import InputError
from focus_planner.io.files import open_regular, read_array, unreadable
from focus_planner.io.formats.contents import SurfaceContents

#: What an archive calls the arrays of its mesh.
MESH_ARRAYS = ("vertices", "faces")


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


def read_npz(path: Path) -> SurfaceContents:
    """Read the mesh of an archive, as in the data set 3DBodyTex.v2: ``vertices`` and ``faces``.

    What else is there, such as a texture, is not read.

    Raises
    ------
    InputError
        If one of them is missing, or has not three numbers in each row.
    """
    arrays = {name: _member(path, name) for name in MESH_ARRAYS}
    for name, array in arrays.items():
        if array.ndim != 2 or array.shape[1] != 3:
            raise InputError(f"{path}, {name}", "an array of shape (n, 3)", f"{array.shape}")
    vertices, faces = arrays.values()
    if faces.dtype.kind not in "iu":
        raise InputError(f"{path}, faces", "whole numbers", str(faces.dtype))
    return SurfaceContents(vertices, faces.astype(np.int64))


def holds_mesh(path: Path) -> bool:
    """Return whether a file is an archive with the arrays of a mesh, without reading them."""
    try:
        with open_regular(path, "a mesh") as file:
            return is_zipfile(file) and {*MESH_ARRAYS} <= {*np.load(file).files}
    except (InputError, OSError, ValueError):
        return False


def _member(path: Path, name: str) -> NDArray[Any]:
    with open_regular(path, "the arrays of a mesh") as file:
        try:
            array: NDArray[Any] = np.load(file, allow_pickle=False)[name]
        except Exception:  # noqa: BLE001 - a broken archive can raise anything
            raise unreadable(path, "npz", f"no array {name}") from None
    return array
