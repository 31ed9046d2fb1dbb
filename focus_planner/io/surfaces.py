"""Meshes and point clouds from files.

A truncated file is an error, never a part of a surface. trimesh's readers (and Open3D's even more
so) accept truncated text files, so the counts that a file declares are checked first.
"""

from __future__ import annotations

import logging
import re
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray

from focus_planner.core.arrays import FloatArray
from focus_planner.core.surface.surface import Mesh, PointCloud, Surface
from focus_planner.core.validation import InputError
from focus_planner.io.clouds import CLOUDS, load_cloud
from focus_planner.io.files import check_final_newline, check_readable, unreadable
from focus_planner.io.importance import importance_column, load_importance, with_importance

MESHES = ("ply", "obj", "stl", "off", "glb", "gltf")

_PLY_ELEMENT = re.compile(rb"^element\s+(\w+)\s+(\d+)", re.MULTILINE)


# Read with their vertices in order; for the other formats trimesh drops and repeats vertices.
_VERTICES_IN_ORDER = ("ply", "off", *CLOUDS)


def load_surface(
    path: str | PathLike[str], importance: str | PathLike[str] | None = None
) -> Surface:
    """Read a mesh or a point cloud, in the format given by the file name's suffix.

    Mesh formats are ply, obj, stl, off, glb and gltf; cloud formats are ply without faces, pcd,
    xyz, xyzn, pts and npy. Coordinates are in metres in the rig's frame, and are not rounded.
    Vertex or point normals are used if the file has them, and so is the importance: a property or
    field ``importance``, or else ``weight``, of a ply or pcd file.

    Parameters
    ----------
    path : str or path-like
    importance : str or path-like, optional
        A file with one number per vertex or point, which replaces the importance in the surface's
        own file: ``.npy``, or text with one number per line. For ply, off and clouds.

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
    check_readable(path, "a mesh or point cloud")
    if kind not in MESHES + CLOUDS:
        raise InputError(
            str(path),
            f"a file name that ends in {', '.join((*MESHES, *CLOUDS))}",
            repr(path.suffix) if path.suffix else "none of them",
        )
    if importance is not None and kind not in _VERTICES_IN_ORDER:
        raise InputError(
            str(importance),
            f"a surface in one of the formats {', '.join(_VERTICES_IN_ORDER)}",
            str(path),
            "other formats do not keep the order of vertices: save the mesh as ply",
        )
    with np.errstate(over="ignore", invalid="ignore"):  # a broken file may contain any numbers
        surface, own = load_cloud(path, kind) if kind in CLOUDS else _load_mesh(path, kind)
    if importance is not None:
        own = load_importance(Path(importance), surface)
    return surface if own is None else with_importance(surface, own)


def _load_mesh(path: Path, kind: str) -> tuple[Surface, FloatArray | None]:
    if kind == "ply":
        return _ply(path)
    if kind in ("obj", "off"):
        check_final_newline(path, kind, path.read_bytes())
    if kind == "off":
        _check_off_counts(path)
    return _mesh(path, kind, _scene(path, kind)), None


def _scene(path: Path, kind: str, **options: Any) -> trimesh.Scene:
    logger = logging.getLogger("trimesh")
    disabled = logger.disabled
    logger.disabled = True  # it warns of colours and textures, which do not matter here
    try:
        # Processing would merge vertices, and silently drop what Mesh rejects with a reason.
        return trimesh.load_scene(
            path, file_type=kind, process=False, skip_materials=True, **options
        )
    except Exception as error:  # noqa: BLE001
        # The readers raise all kinds of exceptions for broken files.
        raise unreadable(path, kind, f"{type(error).__name__}: {error}".rstrip(": ")) from None
    finally:
        logger.disabled = disabled


def _mesh(path: Path, kind: str, scene: trimesh.Scene) -> Mesh:
    parts = []
    for node in scene.graph.nodes_geometry:
        pose, name = scene.graph[node]
        part = scene.geometry[name]
        if isinstance(part, trimesh.Trimesh) and len(part.faces):
            parts.append(part.copy(include_cache=True).apply_transform(pose))
    if not parts:
        raise unreadable(path, kind, "no triangle")
    whole: Any = trimesh.util.concatenate(parts) if len(parts) > 1 else parts[0]
    # trimesh computes missing normals on access; those from the file are in the cache already.
    given = "vertex_normals" in whole._cache.cache  # noqa: SLF001
    return Mesh(whole.vertices, whole.faces, whole.vertex_normals if given else None)


def _ply(path: Path) -> tuple[Surface, FloatArray | None]:
    header, end, body = path.read_bytes().partition(b"end_header")
    if not end or not header.startswith(b"ply"):
        raise unreadable(path, "ply", "no complete header")
    counts = {name.decode(): int(count) for name, count in _PLY_ELEMENT.findall(header)}
    if b"format ascii" in header:
        check_final_newline(path, "ply", body)
        _check_lines(path, "ply", len(body.split(b"\n")) - 2, sum(counts.values()))
    if "tristrips" in counts:
        raise InputError(str(path), "triangles or points", "triangle strips", "convert the file")
    if counts.get("face") == 0:
        raise InputError(
            str(path),
            "a mesh with triangles, or a cloud",
            "a mesh with none (element face 0)",
            "if it is a cloud, save it without the face element",
        )
    # By default trimesh splits vertices at texture seams.
    scene = _scene(path, "ply", fix_texture=False)
    if "face" in counts:
        mesh = _mesh(path, "ply", scene)
        return mesh, _ply_importance(_ply_columns(scene))
    if not scene.geometry:
        return PointCloud(np.empty((0, 3))), None
    columns = _ply_columns(scene)
    return _ply_cloud(scene, columns), _ply_importance(columns)


def _ply_columns(scene: trimesh.Scene) -> dict[str, NDArray[Any]]:
    """Return all of the file's vertex properties, which trimesh keeps among its metadata."""
    columns = next(iter(scene.geometry.values())).metadata["_ply_raw"]["vertex"]["data"]
    names = columns if isinstance(columns, dict) else columns.dtype.names
    return {name: np.ravel(columns[name]) for name in names}


def _ply_importance(columns: dict[str, NDArray[Any]]) -> FloatArray | None:
    name = importance_column(columns)
    return columns[name] if name else None


def _ply_cloud(scene: trimesh.Scene, columns: dict[str, NDArray[Any]]) -> PointCloud:
    normals: FloatArray | None = None
    if {"nx", "ny", "nz"} <= set(columns):
        normals = np.column_stack([columns[name] for name in ("nx", "ny", "nz")])
    return PointCloud(next(iter(scene.geometry.values())).vertices, normals)


def _check_off_counts(path: Path) -> None:
    text = re.sub(rb"#[^\n]*", b"", path.read_bytes())
    lines = [line for line in text.partition(b"OFF")[2].splitlines() if line.strip()]
    try:
        vertices, faces = (int(count) for count in lines[0].split()[:2])
    except (IndexError, ValueError):
        raise unreadable(path, "off", "no counts of vertices and faces") from None
    _check_lines(path, "off", len(lines) - 1, vertices + faces)


def _check_lines(path: Path, kind: str, lines: int, announced: int) -> None:
    if lines < announced:
        raise unreadable(path, kind, f"{lines} lines of the {announced} announced")
