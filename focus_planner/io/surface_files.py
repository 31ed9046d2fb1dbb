# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What to take along of a surface's files, so that it can be read on another machine."""

from __future__ import annotations

import io
from pathlib import Path
from urllib.parse import unquote

import numpy as np

from focus_planner.io.files import SURFACE, read_bytes
from focus_planner.io.formats.arrays import MESH_ARRAYS
from focus_planner.io.formats.gltf_buffers import read_gltf_file
from focus_planner.io.formats.textures import file_beside


def surface_files(path: Path) -> dict[str, bytes]:
    """Return the files that reading a surface takes, without materials and textures.

    Parameters
    ----------
    path : Path
        Of a surface that can be read.

    Returns
    -------
    dict of str to bytes
        Content by name; the first is the surface itself, the others are where it names them.
    """
    kind = path.suffix.lower()
    if kind == ".npz":
        return {path.name: _mesh_alone(path)}
    files = {path.name: read_bytes(path, SURFACE)}
    if kind == ".gltf":
        uris = [each.get("uri", "data:") for each in read_gltf_file(path).items("buffers")]
        names = [unquote(uri) for uri in uris if not uri.startswith("data:")]
        files |= {name: read_bytes(file_beside(path, name), "a buffer") for name in names}
    return files


def _mesh_alone(path: Path) -> bytes:
    """Return an archive without its texture, which may be ten times as large as the mesh."""
    content = io.BytesIO()
    with np.load(path, allow_pickle=False) as archive:
        np.savez(content, **{name: archive[name] for name in MESH_ARRAYS})
    return content.getvalue()
