# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Meshes and point clouds from files.

A truncated file is an error, never a part of a surface: every reader compares what the file
announces with what came.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import nullcontext
from os import PathLike
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from focus_planner.core.surface.cleaning import clean_cloud, clean_mesh
from focus_planner.core.surface.surface import Surface
from focus_planner.core.validation import InputError
from focus_planner.io.files import SURFACE, check_readable
from focus_planner.io.formats.arrays import read_npy, read_npz
from focus_planner.io.formats.contents import SurfaceContents
from focus_planner.io.formats.gltf import read_gltf
from focus_planner.io.formats.laser_scans import read_e57, read_las
from focus_planner.io.formats.obj import read_obj
from focus_planner.io.formats.off import read_off
from focus_planner.io.formats.pcd import read_pcd
from focus_planner.io.formats.ply import read_ply
from focus_planner.io.formats.stl import read_stl
from focus_planner.io.formats.text_clouds import read_text_cloud
from focus_planner.io.formats.textures import ignoring_looks
from focus_planner.io.importance import IMPORTANCE, choose_importance, load_importance
from focus_planner.io.reading import telling


class _Format(NamedTuple):
    """How files with an ending are read.

    Attributes
    ----------
    read : callable
    keeps_numbering : bool
        Whether vertices keep their numbering.
    tells : bool
        Whether it can be told how far it is: not where a library does it all at once.
    """

    read: Callable[[Path], SurfaceContents]
    keeps_numbering: bool = True
    tells: bool = True


_FORMATS = {
    "ply": _Format(read_ply),
    "obj": _Format(read_obj),
    "stl": _Format(read_stl, keeps_numbering=False),
    "off": _Format(read_off),
    "glb": _Format(read_gltf, keeps_numbering=False),
    "gltf": _Format(read_gltf, keeps_numbering=False),
    "pcd": _Format(read_pcd),
    **dict.fromkeys(("xyz", "xyzn", "txt", "asc", "csv", "pts"), _Format(read_text_cloud)),
    "npy": _Format(read_npy),
    "npz": _Format(read_npz),
    "las": _Format(read_las, tells=False),
    "laz": _Format(read_las, tells=False),
    "e57": _Format(read_e57, tells=False),
}


def load_surface(
    path: str | PathLike[str],
    importance: str | PathLike[str] | None = None,
    *,
    importance_property: str = IMPORTANCE,
    looks: bool = True,
    on_progress: Callable[[float], object] = lambda _: None,
) -> Surface:
    """Read a mesh or a point cloud, in the format given by the file name's suffix.

    Mesh formats are ply, obj, stl, off, glb, gltf and npz; cloud formats are ply without faces,
    pcd, xyz, xyzn, txt, asc, csv, pts, npy, and with the extra ``formats`` las, laz and e57.
    Coordinates are in metres in the rig's frame, and are not rounded. Vertex or point normals are
    used if the file has them, and so is a property or field ``importance``. Colours and textures
    are for pictures: plans do not depend on them, and a texture that cannot be read is left out.

    Parts that are no surface, triangles without area and points that are not finite, are left out,
    and normals that are none are computed; ``notes`` of the result say so.

    Parameters
    ----------
    path : str or path-like
    importance : str or path-like, optional
        A file with one number per vertex or point, which replaces the importance in the surface's
        own file: ``.npy``, or text with one number per line. For all formats but stl, glb and gltf.
    importance_property : str
        The property, field or column of the surface's own file that holds the importance. One
        named otherwise than ``importance`` must be there.
    looks : bool
        Whether to read materials and textures.
    on_progress : callable, optional
        Called with the share of the file that is read, from 0 to 1, where that is known; not for
        las, laz and e57. It may raise, to end the reading.

    Returns
    -------
    Mesh or PointCloud

    Raises
    ------
    InputError
        If a file is missing, truncated, in another format than its name says, or contains no
        valid surface; or if the importance does not match the surface.
    """
    path = Path(path)
    kind = path.suffix.lower().removeprefix(".")
    check_readable(path, SURFACE)
    if kind not in _FORMATS:
        raise InputError(
            str(path),
            f"a file name that ends in {', '.join(_FORMATS)}",
            repr(path.suffix) if path.suffix else "none of them",
        )
    if importance is not None and not _FORMATS[kind].keeps_numbering:
        ordered = [name for name, each in _FORMATS.items() if each.keeps_numbering]
        raise InputError(
            str(importance),
            f"a surface in one of the formats {', '.join(ordered)}",
            str(path),
            "other formats do not keep the order of vertices: save the mesh as ply",
        )
    with np.errstate(over="ignore", invalid="ignore"):  # a broken file may contain any numbers
        with (
            telling(on_progress) if _FORMATS[kind].tells else nullcontext(),
            nullcontext() if looks else ignoring_looks(),
        ):
            contents = _FORMATS[kind].read(path)
        surface = _surface(path, contents, importance, importance_property)
    on_progress(1.0)
    return surface


def _surface(
    path: Path,
    contents: SurfaceContents,
    importance: str | PathLike[str] | None,
    importance_property: str,
) -> Surface:
    """Return the surface, its importance matched by the file's numbering before it is cleaned."""
    values: NDArray[Any] | None = None
    if importance is not None:
        what = "point" if contents.triangles is None else "vertex"
        values, found = load_importance(Path(importance), contents.vertices_in_file, what)
        values = values if contents.numbering is None else values[contents.numbering]
    else:
        name, found = choose_importance(
            str(path), contents.numbers.keys(), importance_property, "--importance-property"
        )
        values = contents.numbers[name] if name else None
    notes = (*contents.notes, *found)
    if contents.triangles is None:
        return clean_cloud(contents.points, contents.normals, values, notes, contents.colours)
    return clean_mesh(
        contents.points,
        contents.triangles,
        contents.normals,
        values,
        notes,
        contents.colours,
        contents.texture,
    )
