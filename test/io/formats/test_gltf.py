# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Gltf files: accessors, compression, scenes, skins, and what their extensions require."""

from __future__ import annotations

import base64
from pathlib import Path
from typing import Any

import DracoPy
import numpy as np
import pytest
from numpy.typing import NDArray

from focus_planner.core.validation import InputError
from focus_planner.io.formats import contents as formats
from focus_planner.io.formats.contents import SurfaceContents
from focus_planner.io.formats.gltf import read_gltf
from testing.gltf_assets import Asset

POINTS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.5]])
SQUARE = [0, 1, 2, 0, 2, 3]


def square(**data: Any) -> Asset:
    asset = Asset(**data)
    attributes = {"POSITION": asset.accessor(POINTS)}
    return asset.mesh({"attributes": attributes, "indices": asset.accessor(SQUARE, "u2")})


def corners(contents: SurfaceContents) -> NDArray[np.float64]:
    assert contents.triangles is not None
    return np.asarray(contents.points[contents.triangles])


EXPECTED = POINTS[np.reshape(SQUARE, (2, 3))]


def test_a_buffer_may_be_anywhere(tmp_path: Path) -> None:
    asset = square()
    np.testing.assert_array_equal(corners(read_gltf(asset.glb(tmp_path / "a.glb"))), EXPECTED)
    inside = "data:application/octet-stream;base64," + base64.b64encode(asset.buffer).decode()
    np.testing.assert_array_equal(
        corners(read_gltf(asset.gltf(tmp_path / "a.gltf", inside))), EXPECTED
    )
    path = asset.gltf(tmp_path / "b.gltf", "the%20buffer.bin")
    with pytest.raises(
        InputError, match=r"the buffer\.bin: expected a buffer of b\.gltf, got no s"
    ):
        read_gltf(path)
    (tmp_path / "the buffer.bin").write_bytes(asset.buffer)
    np.testing.assert_array_equal(corners(read_gltf(path)), EXPECTED)
    (tmp_path / "the buffer.bin").write_bytes(asset.buffer[:-1])
    with pytest.raises(InputError, match=r"\d+ bytes of the \d+ announced"):
        read_gltf(path)


@pytest.mark.parametrize(
    ("extension", "read"),
    [
        ("KHR_mesh_quantization", True),
        ("KHR_materials_unlit", True),
        ("KHR_texture_transform", True),
        ("EXT_texture_webp", True),
        ("EXT_meshopt_compression", False),
        ("KHR_meshopt_compression", False),
        ("EXT_mesh_gpu_instancing", False),
        ("OF_SOMEONE", False),
    ],
)
def test_required_extensions_are_looked_at_first(
    tmp_path: Path, extension: str, read: bool
) -> None:
    asset = square(extensionsRequired=[extension])
    if read:
        np.testing.assert_array_equal(corners(read_gltf(asset.glb(tmp_path / "a.glb"))), EXPECTED)
        return
    asset.json["accessors"] = "whatever it means to this extension"
    with pytest.raises(InputError) as caught:
        read_gltf(asset.glb(tmp_path / "a.glb"))
    assert str(caught.value) == (
        f"{tmp_path / 'a.glb'}: expected glTF without compression or extensions of its geometry,"
        f" got the extension {extension}; export it again without, or as ply"
    )


def test_instances_are_never_one_silently(tmp_path: Path) -> None:
    asset = square(nodes=[{"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": {}}}])
    with pytest.raises(InputError, match="got the extension EXT_mesh_gpu_instancing"):
        read_gltf(asset.glb(tmp_path / "a.glb"))


@pytest.mark.parametrize(("kind", "most"), [("i1", 127), ("u1", 255), ("i2", 32767), ("u2", 65535)])
@pytest.mark.parametrize("normalized", [True, False])
def test_quantized_positions(tmp_path: Path, kind: str, most: int, normalized: bool) -> None:
    scale = 2.0 if normalized else 2.0 / most
    asset = Asset(nodes=[{"mesh": 0, "scale": [scale] * 3, "translation": [0, 0, 1]}])
    asset.json["extensionsRequired"] = ["KHR_mesh_quantization"]
    points = np.round(POINTS * most)
    attributes = {"POSITION": asset.accessor(points, kind, normalized=normalized)}
    asset.mesh({"attributes": attributes, "indices": asset.accessor(SQUARE, "u1")})
    found = corners(read_gltf(asset.glb(tmp_path / "a.glb")))
    np.testing.assert_allclose(found, 2 * EXPECTED + [0, 0, 1], atol=2 / most)


def test_rows_may_be_apart(tmp_path: Path) -> None:
    asset = Asset()
    rows = np.zeros(4, [("point", "<f4", 3), ("other", "<f4", 3)])
    rows["point"], rows["other"] = POINTS, 7
    view = asset.view(rows.tobytes(), byteStride=24)
    place = {"bufferView": view, "componentType": 5126, "count": 4, "type": "VEC3"}
    asset.json["accessors"] = [place, place | {"byteOffset": 12}]
    attributes = {"POSITION": 0, "NORMAL": 1}
    asset.mesh({"attributes": attributes, "indices": asset.accessor(SQUARE, "u4")})
    contents = read_gltf(asset.glb(tmp_path / "a.glb"))
    np.testing.assert_array_equal(corners(contents), EXPECTED)
    assert contents.normals is not None
    np.testing.assert_array_equal(contents.normals, np.full((4, 3), 7))


@pytest.mark.parametrize("on_zeros", [True, False])
def test_sparse_accessors(tmp_path: Path, on_zeros: bool) -> None:
    asset = Asset()
    index = asset.accessor(np.zeros((4, 3)) if on_zeros else POINTS * [1, 1, 0])
    changed = [1, 2, 3] if on_zeros else [3]
    asset.json["accessors"][index]["sparse"] = {
        "count": len(changed),
        "indices": {"bufferView": asset.view(bytes(changed)), "componentType": 5121},
        "values": {"bufferView": asset.view(POINTS[changed].astype("<f4").tobytes())},
    }
    if on_zeros:
        del asset.json["accessors"][index]["bufferView"]
    asset.mesh({"attributes": {"POSITION": index}, "indices": asset.accessor(SQUARE, "u2")})
    np.testing.assert_array_equal(corners(read_gltf(asset.glb(tmp_path / "a.glb"))), EXPECTED)


@pytest.mark.parametrize(
    ("mode", "indices", "expected"),
    [
        (4, None, [[0, 1, 2]]),
        (5, [0, 1, 2, 3], [[0, 1, 2], [1, 3, 2]]),
        (6, [0, 1, 2, 3], [[1, 2, 0], [2, 3, 0]]),
        (5, None, [[0, 1, 2], [1, 3, 2]]),
        (6, None, [[1, 2, 0], [2, 3, 0]]),
    ],
)
def test_triangles_strips_and_fans(
    tmp_path: Path, mode: int, indices: list[int] | None, expected: list[list[int]]
) -> None:
    asset = Asset()
    points = POINTS[:3] if mode == 4 else POINTS
    primitive: dict[str, Any] = {"attributes": {"POSITION": asset.accessor(points)}, "mode": mode}
    if indices:
        primitive["indices"] = asset.accessor(indices, "u2")
    lines = {"attributes": primitive["attributes"], "mode": 1}
    contents = read_gltf(asset.mesh(lines, primitive).glb(tmp_path / "a.glb"))
    assert contents.triangles is not None
    assert contents.triangles.tolist() == expected


def test_nodes_move_turn_scale_and_mirror(tmp_path: Path) -> None:
    turn = [0.0, 0.0, np.sqrt(0.5), np.sqrt(0.5)]  # x to y
    matrix = np.diag([-1.0, 1.0, 1.0, 1.0])
    matrix[:3, 3] = [0, 0, 9]
    asset = square(
        scenes=[{"nodes": [0, 3]}],
        nodes=[
            {"children": [1, 2], "rotation": turn, "scale": [2, 3, 4], "translation": [0, 5, 0]},
            {"mesh": 0},
            {"mesh": 0, "matrix": matrix.T.ravel().tolist()},
            {},
            {"mesh": 0},  # in no scene
        ],
    )
    attributes = asset.json["meshes"][0]["primitives"][0]["attributes"]
    attributes["NORMAL"] = asset.accessor([[0, 0, 1]] * 4)
    contents = read_gltf(asset.glb(tmp_path / "a.glb"))
    x, y, z = POINTS.T
    first = np.column_stack([-3 * y, 5 + 2 * x, 4 * z])
    second = np.column_stack([-3 * y, 5 - 2 * x, 4 * (z + 9)])
    np.testing.assert_allclose(contents.points, np.concatenate([first, second]), atol=1e-9)
    assert contents.triangles is not None
    assert contents.normals is not None
    a, b, c = (contents.points[contents.triangles[:, i]] for i in range(3))
    outward = np.cross(b - a, c - a)
    of_corners = contents.normals[contents.triangles[:, 0]]
    assert ((outward * of_corners).sum(axis=1) > 0).all()
    np.testing.assert_allclose(np.abs(contents.normals[:, 2]) > 0, True)


def test_weights_of_shapes_and_skeletons_move_vertices(tmp_path: Path) -> None:
    asset = Asset()
    position = asset.accessor(POINTS)
    target = {"POSITION": asset.accessor(np.ones((4, 3)))}
    primitive = {
        "attributes": {"POSITION": position},
        "indices": asset.accessor(SQUARE, "u2"),
        "targets": [target],
    }
    asset.mesh(primitive, weights=[0.5])
    shaped = corners(read_gltf(asset.glb(tmp_path / "a.glb")))
    np.testing.assert_allclose(shaped, EXPECTED + 0.5)

    asset = Asset(nodes=[{"mesh": 0, "skin": 0, "translation": [99, 99, 99]},
                         {"translation": [0, 0, 2]}, {"scale": [0.01] * 3}],
                  scenes=[{"nodes": [0, 1, 2]}])  # fmt: skip
    bind = np.stack([np.eye(4), np.diag([100.0, 100, 100, 1])]).transpose(0, 2, 1)
    asset.json["skins"] = [
        {"joints": [1, 2], "inverseBindMatrices": asset.accessor(bind.reshape(2, 16))}
    ]
    attributes = {
        "POSITION": asset.accessor(POINTS),
        "JOINTS_0": asset.accessor([[0, 1, 0, 0]] * 4, "u1"),
        "WEIGHTS_0": asset.accessor([[1, 0, 0, 0], [0, 1, 0, 0], [1, 1, 0, 0], [0.5, 0.5, 0, 0]]),
    }
    asset.mesh({"attributes": attributes, "indices": asset.accessor(SQUARE, "u2")})
    found = read_gltf(asset.glb(tmp_path / "a.glb")).points
    lifted = POINTS + np.array([[2.0], [0], [1], [1]]) * [0, 0, 1]
    np.testing.assert_allclose(found, lifted, atol=1e-6)


def draco(path: Path, *, required: bool = True, announced: int = 4) -> Path:
    asset = Asset(**({"extensionsRequired": ["KHR_draco_mesh_compression"]} if required else {}))
    packed = DracoPy.encode(
        POINTS.astype(np.float64), np.reshape(SQUARE, (2, 3)), quantization_bits=16,
        preserve_order=True,
    )  # fmt: skip
    view = asset.view(packed)
    asset.json["accessors"] = [
        {"componentType": 5126, "count": announced, "type": "VEC3"},
        {"componentType": 5125, "count": 6, "type": "SCALAR"},
    ]
    extension = {"bufferView": view, "attributes": {"POSITION": 0}}
    primitive = {"attributes": {"POSITION": 0}, "indices": 1}
    primitive["extensions"] = {"KHR_draco_mesh_compression": extension}
    return asset.mesh(primitive).glb(path)


def test_draco_is_read(tmp_path: Path) -> None:
    found = corners(read_gltf(draco(tmp_path / "a.glb")))
    np.testing.assert_allclose(
        np.sort(found.reshape(-1, 9)), np.sort(EXPECTED.reshape(-1, 9)), atol=1e-4
    )
    with pytest.raises(InputError, match="KHR_draco_mesh_compression with 4 numbers in POSITION"):
        read_gltf(draco(tmp_path / "a.glb", announced=5))


def test_without_the_library_it_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(name: str) -> None:
        raise ModuleNotFoundError(name=name)

    monkeypatch.setattr(formats.importlib, "import_module", missing)
    with pytest.raises(InputError) as caught:
        read_gltf(draco(tmp_path / "a.glb"))
    assert str(caught.value) == (
        f"{tmp_path / 'a.glb'}: expected the Python package that reads glTF's"
        " KHR_draco_mesh_compression, got no module DracoPy; install it with: pip install DracoPy"
    )


def test_other_scenes_are_told(tmp_path: Path) -> None:
    asset = square(scenes=[{"nodes": []}, {"nodes": [0]}], scene=1)
    contents = read_gltf(asset.glb(tmp_path / "a.glb"))
    np.testing.assert_array_equal(corners(contents), EXPECTED)
    (note,) = contents.notes
    assert note.text.startswith("left out: 1 of 2 scenes of ")
    del asset.json["scenes"], asset.json["scene"]
    np.testing.assert_array_equal(corners(read_gltf(asset.glb(tmp_path / "a.glb"))), EXPECTED)


@pytest.mark.parametrize(
    ("change", "telling"),
    [
        ({"asset": {"version": "1.0"}}, "glTF 2.0, got glTF 1.0"),
        ({"nodes": [{"mesh": 5}]}, "number 5 of its meshes, of which there are 1"),
        ({"nodes": [{"mesh": -1}]}, "number -1 of its meshes, of which there are 1"),
        ({"nodes": [{"mesh": "0"}]}, "one of its meshes by something else than a number"),
        ({"scene": 1}, "number 1 of its scenes, of which there are 1"),
        ({"skins": {}, "nodes": [{"mesh": 0, "skin": 0}]}, "skins that are no list of objects"),
        ({"meshes": [{}]}, "json that lacks 'primitives' somewhere"),
        ({"nodes": [{"mesh": 0, "children": [0]}], "scenes": [{"nodes": [0]}]}, "in a circle"),
        ({"nodes": [{"children": [2]}, {"children": [2]}, {}]}, "node 2 with two parents"),
        ({"nodes": [{}]}, "no triangle"),
        ({"nodes": [{"mesh": 0, "rotation": [0, 0, 0, 0]}]}, "values that do not fit together"),
    ],
)
def test_what_does_not_add_up_is_refused(
    tmp_path: Path, change: dict[str, Any], telling: str
) -> None:
    asset = square(**change)
    with pytest.raises(InputError, match=telling) as caught:
        read_gltf(asset.glb(tmp_path / "a.glb"))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "change",
    [
        {"count": 5},
        {"count": -1},
        {"byteOffset": 4},
        {"byteOffset": -4},
        {"componentType": 9},
        {"type": "VEC9"},
        {"bufferView": 9},
        {"bufferView": None, "count": 2**40},
    ],
)
def test_an_accessor_announces_what_is_there(tmp_path: Path, change: dict[str, Any]) -> None:
    asset = square()
    asset.json["accessors"][0] |= change
    if change.get("bufferView", 0) is None:
        del asset.json["accessors"][0]["bufferView"]
    with pytest.raises(InputError, match="a complete glb file"):
        read_gltf(asset.glb(tmp_path / "a.glb"))


def test_a_glb_announces_its_length(tmp_path: Path) -> None:
    path = square().glb(tmp_path / "a.glb")
    content = path.read_bytes()
    for end in range(0, len(content), 7):
        path.write_bytes(content[:end])
        with pytest.raises(InputError, match=r"a complete glb file|an empty file"):
            read_gltf(path)
    path.write_bytes(content + b"\0\n")
    assert [note.code for note in read_gltf(path).notes] == ["left_out"]
