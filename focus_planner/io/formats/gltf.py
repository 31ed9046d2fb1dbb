# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Meshes from gltf and glb files: the triangles of the default scene, as they stand in it.

See the glTF 2.0 specification: accessors (3.6.2), meshes (3.7.2), skins (3.7.3), scenes (3.5).
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from focus_planner.core.arrays import FloatArray
from focus_planner.core.notes import Note
from focus_planner.io.files import BrokenFileError, refusing, unreadable
from focus_planner.io.formats.contents import SurfaceContents
from focus_planner.io.formats.gltf_buffers import Gltf, read_gltf_file
from focus_planner.io.formats.gltf_looks import Look, Looks
from focus_planner.io.formats.textures import looks_or_note

_INSTANCES = "EXT_mesh_gpu_instancing"
_TRIANGLES, _STRIP, _FAN = 4, 5, 6
# A short file may repeat a mesh any number of times.
_MAX_VERTICES = 100_000_000


class _Part(NamedTuple):
    """Triangles with vertices of their own."""

    points: FloatArray
    triangles: NDArray[np.int64]
    normals: FloatArray | None
    look: Look


def read_gltf(path: Path) -> SurfaceContents:
    """Read a gltf file with its buffers, or a glb file.

    Raises
    ------
    InputError
        If it is truncated, no such file, or has geometry that is not read here: names it.
    """
    kind = path.suffix.lower().removeprefix(".")
    with refusing(path, kind):
        try:
            gltf = read_gltf_file(path)
            looks = Looks(gltf)
            parts = _parts(gltf, looks)
            notes = [*gltf.notes, *_other_scenes(path, gltf)]
        except KeyError as error:
            raise BrokenFileError(f"json that lacks {error.args[0]!r} somewhere") from None
    if not parts:
        raise unreadable(path, kind, "no triangle")
    firsts = np.cumsum([0, *(len(part.points) for part in parts[:-1])])
    normals = None
    if any(part.normals is not None for part in parts):
        normals = np.concatenate([_normals_or_none(part) for part in parts])
    colours, texture = looks_or_note(
        path,
        "the texture",
        lambda: looks.together(
            [part.look for part in parts],
            [part.triangles for part in parts],
            [len(part.points) for part in parts],
        ),
        looks.notes,
        (None, None),
    )
    return SurfaceContents(
        np.concatenate([part.points for part in parts]),
        np.concatenate([p.triangles + first for p, first in zip(parts, firsts, strict=True)]),
        normals,
        notes=(*notes, *looks.notes),
        colours=colours,
        texture=texture,
    )


def _parts(gltf: Gltf, looks: Looks) -> list[_Part]:
    parts, vertices = list[_Part](), 0
    for node, pose in _nodes(gltf):
        for part in _of_node(gltf, looks, node, pose):
            parts.append(part)
            vertices += len(part.points)
            if vertices > _MAX_VERTICES:
                raise BrokenFileError(f"more than {_MAX_VERTICES:,} vertices, by repetition")
    return parts


def _normals_or_none(part: _Part) -> FloatArray:
    return np.full(part.points.shape, np.nan) if part.normals is None else part.normals


# --- the scene ---------------------------------------------------------------------------------


def _nodes(gltf: Gltf) -> Iterator[tuple[dict[str, Any], FloatArray]]:
    """Yield the nodes of the default scene with their poses, (4, 4) matrices."""
    poses = _poses(gltf)
    nodes = gltf.items("nodes")
    scenes = gltf.items("scenes")
    if scenes:
        chosen = list(gltf.item("scenes", gltf.json.get("scene", 0)).get("nodes", []))
    else:
        chosen = sorted(set(range(len(nodes))) - {c for n in nodes for c in n.get("children", [])})
    while chosen:
        index = chosen.pop(0)
        node = gltf.item("nodes", index)
        chosen = [*node.get("children", []), *chosen]
        yield node, poses[index]


def _poses(gltf: Gltf) -> dict[int, FloatArray]:
    """Return ``scene_from_node`` of every node, whichever scene it is in."""
    nodes = gltf.items("nodes")
    children = {child for node in nodes for child in node.get("children", [])}
    poses: dict[int, FloatArray] = {}
    waiting = [(i, np.eye(4)) for i in range(len(nodes)) if i not in children]
    while waiting:
        index, parent = waiting.pop()
        if index in poses:
            raise BrokenFileError(f"node {index} with two parents")
        node = gltf.item("nodes", index)
        poses[index] = parent @ _local_pose(node)
        waiting += [(child, poses[index]) for child in node.get("children", [])]
    if len(poses) < len(nodes):
        raise BrokenFileError("nodes in a circle")
    return poses


def _local_pose(node: dict[str, Any]) -> FloatArray:
    if "matrix" in node:
        return np.array(node["matrix"], dtype=np.float64).reshape(4, 4).T
    from scipy.spatial.transform import Rotation  # noqa: PLC0415 - takes as long as a plan

    pose = np.eye(4)
    turn = Rotation.from_quat(node.get("rotation", [0.0, 0.0, 0.0, 1.0])).as_matrix()
    pose[:3, :3] = turn * np.array(node.get("scale", [1.0, 1.0, 1.0]), dtype=np.float64)
    pose[:3, 3] = node.get("translation", [0.0, 0.0, 0.0])
    return pose


def _other_scenes(path: Path, gltf: Gltf) -> list[Note]:
    count = len(gltf.items("scenes"))
    if count < 2:
        return []
    text = f"left out: {count - 1} of {count} scenes of {path}; the default scene is planned for"
    return [Note("left_out", text)]


# --- meshes ------------------------------------------------------------------------------------


def _of_node(gltf: Gltf, looks: Looks, node: dict[str, Any], pose: FloatArray) -> Iterator[_Part]:
    if _INSTANCES in node.get("extensions", {}):
        raise gltf.not_read(_INSTANCES)
    if "mesh" not in node:
        return
    mesh = gltf.item("meshes", node["mesh"])
    weights = node.get("weights", mesh.get("weights", []))
    for primitive in mesh["primitives"]:
        if primitive.get("mode", _TRIANGLES) not in {_TRIANGLES, _STRIP, _FAN}:
            continue  # points and lines
        triangles, attributes, look = _primitive(gltf, looks, primitive, weights)
        poses = pose[None]
        if "skin" in node:  # whose own pose is ignored
            poses = _skinned(gltf, gltf.item("skins", node["skin"]), attributes)
        yield _moved(attributes["POSITION"], attributes.get("NORMAL"), triangles, poses, look)


def _primitive(
    gltf: Gltf, looks: Looks, primitive: dict[str, Any], weights: list[float]
) -> tuple[NDArray[np.int64], dict[str, NDArray[Any]], Look]:
    """Return the triangles and the attributes of a primitive, morphed by the weights, its look."""
    of_draco: dict[str, NDArray[Any]] = {}
    if gltf.is_only_in_draco(primitive):
        of_draco = gltf.draco(primitive)
    names = ("POSITION", "NORMAL", "JOINTS_0", "WEIGHTS_0", "JOINTS_1", "WEIGHTS_1")
    attributes = {}
    for name, index in primitive["attributes"].items():
        if name in names:
            attributes[name] = of_draco[name] if name in of_draco else gltf.accessor(index)
    for weight, target in zip(weights, primitive.get("targets", []), strict=False):
        for name, index in target.items():
            if name in attributes and weight:
                attributes[name] = attributes[name] + weight * gltf.accessor(index)
    count = len(attributes["POSITION"])
    if any(len(values) != count for values in attributes.values()):
        raise BrokenFileError("attributes of different lengths")
    indices: NDArray[Any] = np.arange(count)
    if "indices" in primitive:
        given = (
            of_draco["indices"] if "indices" in of_draco else gltf.accessor(primitive["indices"])
        )
        indices = given.reshape(-1).astype(np.int64)
    triangles = _triangles(indices, primitive.get("mode", _TRIANGLES))
    return triangles, attributes, looks.of(primitive, of_draco, count)


def _triangles(indices: NDArray[np.int64], mode: int) -> NDArray[np.int64]:
    if mode == _TRIANGLES:
        if len(indices) % 3:
            raise BrokenFileError(f"{len(indices)} corners of triangles")
        return indices.reshape(-1, 3)
    count = max(len(indices) - 2, 0)
    first, second, third = (indices[i : i + count] for i in range(3))
    if mode == _FAN:
        return np.stack([second, third, np.full(count, indices[0]) if count else first], axis=1)
    odd = np.arange(count) % 2 == 1  # every other triangle of a strip turns the other way
    return np.stack([first, np.where(odd, third, second), np.where(odd, second, third)], axis=1)


def _skinned(gltf: Gltf, skin: dict[str, Any], attributes: dict[str, NDArray[Any]]) -> FloatArray:
    """Return (V, 4, 4) the poses of vertices that follow the joints of a skeleton."""
    joints = skin["joints"]
    from_mesh = np.tile(np.eye(4), (len(joints), 1, 1))
    if "inverseBindMatrices" in skin:
        columns = gltf.accessor(skin["inverseBindMatrices"])[: len(joints)]
        from_mesh = columns.reshape(-1, 4, 4).transpose(0, 2, 1)
    poses = _poses(gltf)
    of_joints = np.stack([poses[joint] for joint in joints]) @ from_mesh
    blended: FloatArray = np.zeros((len(attributes["JOINTS_0"]), 4, 4))
    for joint, weight in (("JOINTS_0", "WEIGHTS_0"), ("JOINTS_1", "WEIGHTS_1")):
        if joint in attributes:
            which = attributes[joint].astype(np.int64)
            blended += (attributes[weight][:, :, None, None] * of_joints[which]).sum(axis=1)
    return blended / blended[:, 3:, 3:]  # by the sum of the weights


def _moved(
    points: NDArray[Any],
    normals: NDArray[Any] | None,
    triangles: NDArray[np.int64],
    poses: FloatArray,
    look: Look,
) -> _Part:
    """Return a part in the scene's frame; ``poses`` is (1, 4, 4), or one for every vertex."""
    linear, shift = poses[:, :3, :3], poses[:, :3, 3]
    moved = (linear @ points[:, :, None])[:, :, 0] + shift
    mirrored = np.linalg.det(linear) < 0
    if normals is not None:
        # Cofactors: the inverse transpose, whatever the scale, also where it is singular.
        cofactors = np.cross(np.roll(linear, -1, axis=1), np.roll(linear, -2, axis=1))
        normals = (cofactors @ normals[:, :, None])[:, :, 0]
        normals = np.where(mirrored[:, None], -normals, normals)
    if mirrored.all():  # turns triangles over
        triangles = triangles[:, ::-1]
    return _Part(moved, triangles, normals, look)
