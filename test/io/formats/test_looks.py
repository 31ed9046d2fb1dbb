# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Colours and textures, as every format that has them stores them."""

from __future__ import annotations

import base64
import io
import os
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import laspy
import numpy as np
import pye57
import pytest
from numpy.typing import NDArray
from PIL import Image

from focus_planner.core.surface.appearance import Texture
from focus_planner.core.surface.surface import Mesh, PointCloud
from focus_planner.io.files import BrokenFileError
from focus_planner.io.formats import textures
from focus_planner.io.surfaces import load_surface
from testing.damaged_files import damaged
from testing.gltf_assets import Asset
from testing.ply_files import write_ply

RED, GREEN, BLUE, GREY = (255, 0, 0), (0, 255, 0), (0, 0, 255), (128, 128, 128)
SQUARE = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], dtype=float)
CORNERS = np.array([RED, GREEN, BLUE, GREY])
# Its four quarters are red and green above, blue and grey below.
QUARTERS = (
    np.array([[RED, GREEN], [BLUE, GREY]], dtype=np.uint8).repeat(8, axis=0).repeat(8, axis=1)
)
ENCODINGS = ["ascii", "binary_little_endian", "binary_big_endian"]
Write = Callable[[Path], Path]


def png(pixels: NDArray[Any] = QUARTERS) -> bytes:
    stream = io.BytesIO()
    Image.fromarray(np.asarray(pixels, dtype=np.uint8)).save(stream, "PNG")
    return stream.getvalue()


def mesh_of(path: Path) -> Mesh:
    mesh = load_surface(path)
    assert isinstance(mesh, Mesh)
    return mesh


def cloud_of(path: Path) -> PointCloud:
    cloud = load_surface(path)
    assert isinstance(cloud, PointCloud)
    return cloud


def colours_at(mesh: Mesh, *places: tuple[float, float]) -> list[tuple[int, ...]]:
    """Return the colours of the texture at places x, y of a mesh in the plane z = 0."""
    assert mesh.texture is not None
    found = []
    for place in places:
        for corners, coordinates in zip(mesh.triangles, mesh.texture.coordinates, strict=True):
            shares = np.linalg.solve(
                np.vstack([mesh.vertices[corners, :2].T, np.ones(3)]), [*place, 1]
            )
            if (shares >= 0).all():
                u, v = shares @ coordinates
                height, width = mesh.texture.image.shape[:2]
                pixel = mesh.texture.image[
                    int((1 - v) * height) % height, int(np.floor(u * width)) % width
                ]
                found.append(tuple(pixel.tolist()))
                break
    return found


QUARTER_PLACES = ((0.3, 0.8), (0.8, 0.7), (0.3, 0.2), (0.7, 0.2))
QUARTER_COLOURS = [RED, GREEN, BLUE, GREY]


# --- ply ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("encoding", ENCODINGS)
@pytest.mark.parametrize("prefix", ["", "diffuse_"])
@pytest.mark.parametrize("kind", ["uchar", "ushort", "double"])
def test_ply_vertices(tmp_path: Path, encoding: str, prefix: str, kind: str) -> None:
    scale = {"uchar": 1, "ushort": 257, "double": 1 / 255}[kind]
    rows = [(*map(float, p), *(c * scale)) for p, c in zip(SQUARE, CORNERS, strict=True)]
    if kind != "double":
        rows = [(*row[:3], *map(int, row[3:])) for row in rows]
    names = [f"{kind} {prefix}{name}" for name in ("red", "green", "blue")]
    vertex = ("vertex", ["double x", "double y", "double z", *names], rows)
    face = ("face", ["list uchar int vertex_indices"], [([0, 1, 2, 3],)])
    mesh = mesh_of(write_ply(tmp_path / "a.ply", encoding, vertex, face))
    np.testing.assert_array_equal(mesh.vertex_colours, CORNERS)
    assert mesh.notes == ()


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_ply_bytes_that_are_nearly_black_stay_so(tmp_path: Path, encoding: str) -> None:
    names = ["uchar red", "uchar green", "uchar blue"]
    rows = [(*map(float, point), 1, 0, 1) for point in SQUARE]
    vertex = ("vertex", ["double x", "double y", "double z", *names], rows)
    face = ("face", ["list uchar int vertex_indices"], [([0, 1, 2],)])
    mesh = mesh_of(write_ply(tmp_path / "a.ply", encoding, vertex, face))
    assert mesh.vertex_colours is not None
    assert mesh.vertex_colours.max() == 1


@pytest.mark.parametrize("encoding", ENCODINGS)
@pytest.mark.parametrize("of", ["corners", "corners of unlike faces", "vertices"])
def test_ply_texture(tmp_path: Path, encoding: str, of: str) -> None:
    (tmp_path / "a picture.png").write_bytes(png())
    faces: list[list[int]] = [[0, 1, 2, 3]] if of == "corners" else [[0, 1, 2], [0, 2, 3]]
    if of == "corners of unlike faces":
        faces = [[0, 1, 2], [0, 2, 3, 3]]
    places = [[x for i in face for x in SQUARE[i, :2].tolist()] for face in faces]
    point = ["double x", "double y", "double z"]
    if of == "vertices":
        vertex = ("vertex", [*point, "double s", "double t"], [(*p, *p[:2]) for p in SQUARE])
        face = ("face", ["list uchar int vertex_indices"], [(each,) for each in faces])
    else:
        vertex = ("vertex", point, [tuple(p) for p in SQUARE])
        face = (
            "face",
            ["list uchar int vertex_indices", "list uchar double texcoord"],
            list(zip(faces, places, strict=True)),
        )
    header = ["comment TextureFile a picture.png"]
    mesh = mesh_of(write_ply(tmp_path / "a.ply", encoding, vertex, face, header=header))
    assert colours_at(mesh, *QUARTER_PLACES) == QUARTER_COLOURS


def test_ply_colours_of_faces(tmp_path: Path) -> None:
    vertex = ("vertex", ["double x", "double y", "double z"], [tuple(p) for p in SQUARE])
    names = ["uchar red", "uchar green", "uchar blue"]
    rows = [([0, 1, 2], *RED), ([0, 2, 3], *BLUE)]
    face = ("face", ["list uchar int vertex_indices", *names], rows)
    mesh = mesh_of(write_ply(tmp_path / "a.ply", "ascii", vertex, face))
    assert colours_at(mesh, (0.7, 0.2), (0.2, 0.7)) == [RED, BLUE]


# --- obj ---------------------------------------------------------------------------------------


def obj(folder: Path, text: str, materials: str = "", name: str = "a.obj") -> Path:
    (folder / "a.mtl").write_text(materials)
    (folder / name).write_text(text)
    return folder / name


POINTS = "".join(f"v {x:g} {y:g} {z:g}\n" for x, y, z in SQUARE)
PLACES = "".join(f"vt {x:g} {y:g}\n" for x, y, _ in SQUARE)
COVERED = f"mtllib a.mtl\n{POINTS}{PLACES}vn 0 0 1\nusemtl skin\n"


@pytest.mark.parametrize("scale", [1, 255])
def test_obj_vertices(tmp_path: Path, scale: int) -> None:
    rows = [(*p, *(c / 255 * scale)) for p, c in zip(SQUARE, CORNERS, strict=True)]
    lines = "".join("v " + " ".join(f"{x:.9g}" for x in row) + "\n" for row in rows)
    mesh = mesh_of(obj(tmp_path, f"{lines}vn 0 0 1\nf 1//1 2//1 3//1\nf 1 3 4\n"))
    assert mesh.vertex_colours is not None
    order = [int(np.abs(SQUARE - vertex).sum(axis=1).argmin()) for vertex in mesh.vertices]
    np.testing.assert_array_equal(mesh.vertex_colours, CORNERS[order])


@pytest.mark.parametrize(
    "faces",
    [
        "f 1/1 2/2 3/3 4/4\n",
        "f 1/1/1 2/2/1 3/3/1 4/4/1\n",
        "f 1/1/1 2/2/1 3/3/1\nf -4/-4 -2/-2 -1/-1\n",
        "f 1/1 2/2/1 3/3\nf 1/1/1 3/3/1 4/4/1\n",
    ],
)
@pytest.mark.parametrize("place", ["skin.png", "images/skin.png", r"C:\made by\skin.png"])
def test_obj_texture(tmp_path: Path, faces: str, place: str) -> None:
    file = tmp_path / place if "/" in place else tmp_path / "skin.png"
    file.parent.mkdir(exist_ok=True)
    file.write_bytes(png())
    options = "-s 1 1 1 -clamp on " if "/" in place else ""
    materials = f"newmtl skin\nKd 1 1 1\nmap_Kd {options}{place}\n"
    mesh = mesh_of(obj(tmp_path, COVERED + faces, materials))
    assert colours_at(mesh, *QUARTER_PLACES) == QUARTER_COLOURS
    assert not any("texture" in note.text for note in mesh.notes)


def test_obj_several_materials_become_one_texture(tmp_path: Path) -> None:
    (tmp_path / "one.png").write_bytes(png())
    (tmp_path / "other.png").write_bytes(png(np.full((4, 6, 3), 77)))
    materials = (
        "newmtl skin\nmap_Kd one.png\nnewmtl cloth\nmap_Kd other.png\nnewmtl hair\nKd 0 1 0\n"
    )
    more = "".join(f"v {x + 2:g} {y:g} 0\n" for x, y, _ in SQUARE)
    faces = "f 1/1 2/2 3/3\nf 1/1 3/3 4/4\nusemtl cloth\nf 5/1 6/2 7/3\nusemtl hair\nf 5 7 8\n"
    mesh = mesh_of(obj(tmp_path, COVERED.replace("vn", more + "vn") + faces, materials))
    places = [*QUARTER_PLACES, (2.7, 0.2), (2.2, 0.7)]
    assert colours_at(mesh, *places) == [*QUARTER_COLOURS, (77, 77, 77), GREEN]


def test_obj_texture_that_repeats_beside_another(tmp_path: Path) -> None:
    (tmp_path / "one.png").write_bytes(png())
    materials = "newmtl skin\nmap_Kd one.png\nnewmtl hair\nKd 0 1 0\n"
    places = "".join(f"vt {2 * x - 7:g} {3 * y + 5:g}\n" for x, y, _ in SQUARE)
    faces = "f 1/1 2/2 3/3\nf 1/1 3/3 4/4\nusemtl hair\nf 1 3 4\n"
    text = f"mtllib a.mtl\n{POINTS}{places}usemtl skin\n{faces}"
    mesh = mesh_of(obj(tmp_path, text, materials))
    assert colours_at(mesh, (0.9, 0.3), (0.4, 0.1), (0.6, 0.55)) == [GREEN, GREY, RED]


def test_obj_materials_of_plain_colours(tmp_path: Path) -> None:
    materials = "newmtl skin\nKd 1 0 0\nnewmtl cloth\nKd 0 0 1\n"
    faces = "f 1 2 3\nusemtl cloth\nf 1 3 4\n"
    mesh = mesh_of(obj(tmp_path, COVERED + faces, materials))
    assert colours_at(mesh, (0.7, 0.2), (0.2, 0.7)) == [RED, BLUE]


def test_obj_materials_that_are_all_of_one_grey_are_none(tmp_path: Path) -> None:
    mesh = mesh_of(obj(tmp_path, COVERED + "f 1 2 3\n", "newmtl skin\nKd 0.8 0.8 0.8\n"))
    assert mesh.texture is None
    assert mesh.notes == ()


# --- gltf --------------------------------------------------------------------------------------


def linear(colours: NDArray[Any]) -> NDArray[np.float64]:
    values = np.asarray(colours) / 255
    return np.asarray(
        np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)
    )


@pytest.mark.parametrize("alpha", [False, True])
@pytest.mark.parametrize(("kind", "most"), [("f4", None), ("u1", 255), ("u2", 65535)])
def test_gltf_vertices_are_in_proportion_to_light(
    tmp_path: Path, kind: str, most: int | None, alpha: bool
) -> None:
    asset = Asset()
    values = linear(CORNERS)
    values = np.column_stack([values, np.ones(4)]) if alpha else values
    if most:
        accessor = asset.accessor(np.rint(values * most), kind, normalized=True)
    else:
        accessor = asset.accessor(values)
    attributes = {"POSITION": asset.accessor(SQUARE), "COLOR_0": accessor}
    asset.mesh({"attributes": attributes, "indices": asset.accessor([0, 1, 2, 0, 2, 3], "u2")})
    mesh = mesh_of(asset.glb(tmp_path / "a.glb"))
    assert mesh.vertex_colours is not None
    np.testing.assert_allclose(mesh.vertex_colours.astype(int), CORNERS, atol=1)


def covered(asset: Asset, image: dict[str, Any], **more: Any) -> Asset:
    asset.json |= {
        "images": [image],
        "textures": [{"source": 0, **more.get("texture", {})}],
        "samplers": more.get("samplers", []),
        "materials": [
            {
                "pbrMetallicRoughness": {
                    "baseColorTexture": {"index": 0, "texCoord": 1, **more.get("info", {})},
                    **more.get("base", {}),
                }
            }
        ],
    }
    places = np.column_stack([SQUARE[:, 0], 1 - SQUARE[:, 1]]) * more.get("scale", 1.0)
    attributes = {"POSITION": asset.accessor(SQUARE), "TEXCOORD_1": asset.accessor(places)}
    indices = asset.accessor([0, 1, 2, 0, 2, 3], "u2")
    return asset.mesh({"attributes": attributes, "indices": indices, "material": 0})


@pytest.mark.parametrize("place", ["beside", "within", "uri"])
def test_gltf_texture(tmp_path: Path, place: str) -> None:
    (tmp_path / "my skin.png").write_bytes(png())
    asset = Asset()
    image: dict[str, Any] = {"uri": "my%20skin.png"}
    if place == "within":
        image = {"bufferView": asset.view(png()), "mimeType": "image/png"}
    elif place == "uri":
        image = {"uri": "data:image/png;base64," + base64.b64encode(png()).decode()}
    mesh = mesh_of(covered(asset, image).glb(tmp_path / "a.glb"))
    assert colours_at(mesh, *QUARTER_PLACES) == QUARTER_COLOURS
    assert mesh.notes == ()


def test_gltf_texture_times_a_factor(tmp_path: Path) -> None:
    asset = Asset()
    image = {"bufferView": asset.view(png(np.full((2, 2, 3), 255)))}
    factor = [*linear(np.array([10, 100, 200])).tolist(), 1]
    covered(asset, image, base={"baseColorFactor": factor})
    mesh = mesh_of(asset.glb(tmp_path / "a.glb"))
    assert colours_at(mesh, (0.3, 0.3)) == [(10, 100, 200)]


def test_gltf_texture_that_is_moved(tmp_path: Path) -> None:
    asset = Asset()
    image = {"bufferView": asset.view(png())}
    # By a quarter turn: what was left is at the bottom, by the specification's own formula.
    transform = {"offset": [0, 1], "rotation": np.pi / 2, "scale": [1, 1]}
    covered(asset, image, info={"extensions": {"KHR_texture_transform": transform}})
    mesh = mesh_of(asset.glb(tmp_path / "a.glb"))
    for (x, y), colour in zip(QUARTER_PLACES, colours_at(mesh, *QUARTER_PLACES), strict=True):
        u, v = 1 - y, 1 - x  # offset + (v, -u) of u = x, v = 1 - y
        assert colour == tuple(QUARTERS[int(v * 16), int(u * 16)])


def test_gltf_texture_that_ends_at_its_edge(tmp_path: Path) -> None:
    asset = Asset()
    image = {"bufferView": asset.view(png())}
    samplers = [{"wrapS": 33071, "wrapT": 33648}]
    covered(asset, image, samplers=samplers, texture={"sampler": 0}, scale=0.999)
    mesh = mesh_of(asset.glb(tmp_path / "a.glb"))
    assert colours_at(mesh, *QUARTER_PLACES) == QUARTER_COLOURS


def test_gltf_plain_colours(tmp_path: Path) -> None:
    asset = Asset()
    factors = [[1, 0, 0, 1], [0, 0, 1, 1]]
    asset.json["materials"] = [{"pbrMetallicRoughness": {"baseColorFactor": f}} for f in factors]
    parts = [
        {
            "attributes": {"POSITION": asset.accessor(SQUARE + 2 * i)},
            "indices": asset.accessor([0, 1, 2], "u2"),
            "material": i,
        }
        for i in range(2)
    ]
    mesh = mesh_of(asset.mesh(*parts).glb(tmp_path / "a.glb"))
    assert mesh.vertex_colours is not None
    used = mesh.vertex_colours[mesh.triangles]
    np.testing.assert_array_equal(used, [[RED] * 3, [BLUE] * 3])


def test_gltf_without_looks_has_none(tmp_path: Path) -> None:
    asset = Asset(materials=[{"pbrMetallicRoughness": {"metallicFactor": 0}}])
    attributes = {"POSITION": asset.accessor(SQUARE)}
    indices = asset.accessor([0, 1, 2], "u2")
    asset.mesh({"attributes": attributes, "indices": indices, "material": 0})
    mesh = mesh_of(asset.glb(tmp_path / "a.glb"))
    assert (mesh.vertex_colours, mesh.texture, mesh.notes) == (None, None, ())


# --- off ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("scale", [1, 255])
def test_off_vertices(tmp_path: Path, scale: int) -> None:
    rows = [(*p, *(c / 255 * scale), 1) for p, c in zip(SQUARE, CORNERS, strict=True)]
    lines = ["COFF", "4 1 0", *(" ".join(f"{x:.9g}" for x in row) for row in rows), "4 0 1 2 3", ""]
    (tmp_path / "a.off").write_text("\n".join(lines))
    np.testing.assert_array_equal(mesh_of(tmp_path / "a.off").vertex_colours, CORNERS)


def test_off_faces(tmp_path: Path) -> None:
    points = ["0 0 0", "1 0 0", "1 1 0", "0 1 0"]
    lines = ["OFF", "4 2 0", *points, "3 0 1 2 255 0 0", "3 0 2 3 0 0 255 255", ""]
    (tmp_path / "a.off").write_text("\n".join(lines))
    mesh = mesh_of(tmp_path / "a.off")
    assert colours_at(mesh, (0.7, 0.2), (0.2, 0.7)) == [RED, BLUE]


def test_off_colours_that_are_none_are_noted(tmp_path: Path) -> None:
    points = ["0 0 0", "1 0 0", "1 1 0"]
    (tmp_path / "a.off").write_text("\n".join(["COFF", "3 1 0", *points, "3 0 1 2", ""]))
    mesh = mesh_of(tmp_path / "a.off")
    assert mesh.vertex_colours is None
    assert [note.code for note in mesh.notes] == ["left_out"]
    assert "the colours of" in mesh.notes[0].text


# --- clouds ------------------------------------------------------------------------------------

RANDOM = np.random.default_rng(5)
CLOUD = RANDOM.normal(size=(40, 3))
SHADES = RANDOM.integers(0, 256, (40, 3))


@pytest.mark.parametrize("form", ["ascii", "binary"])
@pytest.mark.parametrize(
    ("name", "kind"), [("rgb", "F"), ("rgb", "U"), ("rgba", "U"), ("rgb", "I")]
)
def test_pcd_packed(tmp_path: Path, form: str, name: str, kind: str) -> None:
    alpha = 0xFF if name == "rgba" or kind == "I" else 0
    packed = (alpha << 24 | SHADES @ [1 << 16, 1 << 8, 1]).astype(np.uint32)
    values = {"F": packed.view(np.float32), "U": packed, "I": packed.view(np.int32)}[kind]
    head = [
        "VERSION .7", f"FIELDS x y z {name}", "SIZE 8 8 8 4", f"TYPE F F F {kind}",
        "COUNT 1 1 1 1", "WIDTH 40", "HEIGHT 1", f"DATA {form}",
    ]  # fmt: skip
    if form == "ascii":
        rows = (
            f"{x!r} {y!r} {z!r} {v}\n" for (x, y, z), v in zip(CLOUD.tolist(), values, strict=True)
        )
        body = "".join(rows).encode()
    else:
        table = np.empty(40, [("p", "<f8", 3), ("c", values.dtype)])
        table["p"], table["c"] = CLOUD, values
        body = table.tobytes()
    (tmp_path / "a.pcd").write_bytes("\n".join([*head, ""]).encode() + body)
    np.testing.assert_array_equal(cloud_of(tmp_path / "a.pcd").colours, SHADES)


def table_of(*columns: NDArray[Any]) -> str:
    return "".join(" ".join(f"{x:.9g}" for x in row) + "\n" for row in np.column_stack(columns))


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.xyz", table_of(CLOUD, SHADES)),
        ("a.txt", table_of(CLOUD, SHADES, CLOUD)),
        ("a.pts", "40\n" + table_of(CLOUD, SHADES[:, 0] - 900, SHADES)),
        ("a.csv", "x,y,z,r,g,b\n" + table_of(CLOUD, SHADES).replace(" ", ",")),
        ("a.asc", "X Y Z nx ny nz Red Green Blue\n" + table_of(CLOUD, CLOUD, SHADES / 255)),
        ("a.xyz", "b g r z y x\n" + table_of(SHADES[:, ::-1], CLOUD[:, ::-1])),
    ],
    ids=["six", "nine", "pts", "csv", "titles", "reversed"],
)
def test_text_clouds(tmp_path: Path, name: str, text: str) -> None:
    (tmp_path / name).write_text(text)
    cloud = cloud_of(tmp_path / name)
    np.testing.assert_array_equal(cloud.colours, SHADES)
    np.testing.assert_allclose(cloud.points, CLOUD, rtol=1e-6)


@pytest.mark.parametrize(
    ("name", "others"),
    [
        ("a.xyz", CLOUD / np.linalg.norm(CLOUD, axis=1)[:, None]),
        ("a.txt", np.eye(3)[SHADES[:, 0] % 3]),
        ("a.xyzn", np.abs(SHADES) + 1),
        ("a.txt", SHADES - 1.5),
        ("a.txt", SHADES[:, :2]),
    ],
    ids=["normals", "normals of a box", "xyzn", "others", "two"],
)
def test_what_may_be_something_else_is_no_colour(
    tmp_path: Path, name: str, others: NDArray[Any]
) -> None:
    (tmp_path / name).write_text(table_of(CLOUD, others))
    assert cloud_of(tmp_path / name).colours is None


@pytest.mark.parametrize("scale", [1, 257])
def test_las(tmp_path: Path, scale: int) -> None:
    las = laspy.create(point_format=2)
    las.header.scales = np.full(3, 1e-6)
    las.x, las.y, las.z = CLOUD.T
    las.red, las.green, las.blue = (SHADES * scale).astype(np.uint16).T
    las.write(tmp_path / "a.las")
    np.testing.assert_array_equal(cloud_of(tmp_path / "a.las").colours, SHADES)


def test_e57(tmp_path: Path) -> None:
    file = pye57.E57(str(tmp_path / "a.e57"), mode="w")
    columns = {f"cartesian{axis}": CLOUD[:, i] for i, axis in enumerate("XYZ")}
    for i, name in enumerate(("Red", "Green", "Blue")):
        columns[f"color{name}"] = SHADES[:, i].astype(np.uint8)
    file.write_scan_raw(columns)
    file.close()
    np.testing.assert_array_equal(cloud_of(tmp_path / "a.e57").colours, SHADES)


def test_points_that_are_left_out_take_their_colours_along(tmp_path: Path) -> None:
    points = CLOUD.copy()
    points[[3, 17]] = np.nan
    (tmp_path / "a.xyz").write_text(table_of(points, SHADES))
    kept = np.isfinite(points[:, 0])
    np.testing.assert_array_equal(cloud_of(tmp_path / "a.xyz").colours, SHADES[kept])


# --- what is wrong with a texture --------------------------------------------------------------


def too_large() -> bytes:
    content = bytearray(png(np.zeros((1, 1, 3))))
    content[16:24] = (60_000).to_bytes(4, "big") * 2  # without the pixels
    content[29:33] = zlib.crc32(content[12:29]).to_bytes(4, "big")
    return bytes(content)


def remove(path: Path) -> None:
    path.unlink()


def fifo(path: Path) -> None:
    path.unlink()
    os.mkfifo(path)


def elsewhere(path: Path) -> None:
    path.unlink()
    path.symlink_to("/etc/hostname")


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (remove, "skin.png: no such file"),
        (fifo, "skin.png: a pipe"),
        (lambda path: path.write_bytes(b""), "skin.png: an empty file"),
        (lambda path: path.write_bytes(png()[:60]), "an image that cannot be read"),
        (lambda path: path.write_bytes(too_large()), "pixels"),
        (elsewhere, "skin.png is not in the folder of the surface"),
    ],
    ids=["missing", "pipe", "empty", "cut off", "too large", "elsewhere"],
)
@pytest.mark.parametrize("kind", ["obj", "glb", "ply"])
def test_a_texture_that_cannot_be_read_is_noted(
    tmp_path: Path, kind: str, change: Callable[[Path], object], told: str
) -> None:
    (tmp_path / "skin.png").write_bytes(png())
    change(tmp_path / "skin.png")
    if kind == "obj":
        file = obj(tmp_path, COVERED + "f 1/1 2/2 3/3 4/4\n", "newmtl skin\nmap_Kd skin.png\n")
    elif kind == "glb":
        file = covered(Asset(), {"uri": "skin.png"}).glb(tmp_path / "a.glb")
    else:
        rows = [(*p, *p[:2]) for p in SQUARE]
        vertex = ("vertex", [*(f"double {name}" for name in "xyzst")], rows)
        face = ("face", ["list uchar int vertex_indices"], [([0, 1, 2, 3],)])
        header = ["comment TextureFile skin.png"]
        file = write_ply(tmp_path / "a.ply", "ascii", vertex, face, header=header)
    mesh = mesh_of(file)
    assert len(mesh.triangles) == 2
    assert mesh.texture is None
    (note,) = mesh.notes
    assert note.code == "left_out"
    assert note.text.startswith(f"left out: the texture of {file}: ")
    assert told in note.text
    assert note.text.endswith("; the plan is the same, pictures of it are without")


@pytest.mark.parametrize("name", ["../skin.png", "/etc/hostname", "..\\skin.png"])
def test_a_texture_elsewhere_is_not_read(tmp_path: Path, name: str) -> None:
    folder = tmp_path / "model"
    folder.mkdir()
    (tmp_path / "skin.png").write_bytes(png())
    file = obj(folder, COVERED + "f 1/1 2/2 3/3 4/4\n", f"newmtl skin\nmap_Kd {name}\n")
    mesh = mesh_of(file)
    assert mesh.texture is None
    assert len(mesh.notes) == 1


def test_a_missing_material_file_matters_only_with_texture_coordinates(tmp_path: Path) -> None:
    text = COVERED.replace("a.mtl", "other.mtl") + "f 1 2 3\n"
    (note,) = mesh_of(obj(tmp_path, text)).notes
    assert "the materials of" in note.text
    assert "other.mtl: no such file" in note.text
    without = text.replace("vt ", "# ")
    assert mesh_of(obj(tmp_path, without)).notes == ()


@pytest.mark.filterwarnings("error")
def test_damaged_looks_never_cost_the_surface(tmp_path: Path) -> None:
    materials = b"newmtl skin\nKd 1 0.5 0\nmap_Kd -o 0 0 skin.png\n"
    outcomes = set()
    for seed in range(60):
        random = np.random.default_rng(seed)
        image, text = (png(), damaged(materials, random)) if seed % 2 else (png(), materials)
        image = image if seed % 2 else damaged(image, random)
        (tmp_path / "skin.png").write_bytes(image)
        file = obj(tmp_path, COVERED + "f 1/1 2/2 3/3 4/4\n")
        (tmp_path / "a.mtl").write_bytes(text)
        mesh = mesh_of(file)
        assert len(mesh.triangles) == 2
        outcomes.add(mesh.texture is None)
    assert outcomes == {True, False}


def test_images_of_other_kinds_are_converted() -> None:
    grey = np.arange(16, dtype=np.uint8).reshape(4, 4) * 16
    deep = (grey.astype(np.uint16) * 257).astype(np.uint16)
    for pixels in (grey, deep):
        stream = io.BytesIO()
        Image.fromarray(pixels).save(stream, "PNG")
        np.testing.assert_array_equal(textures.image_of(stream.getvalue())[..., 1], grey)


def test_a_large_image_is_made_smaller(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(textures, "_MAX_SIDE", 4)
    assert textures.image_of(png()).tolist() == QUARTERS[::4, ::4].tolist()


def test_the_more_images_the_smaller_each(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(textures, "_MAX_ATLAS", 256)
    assert textures.image_of(png()).shape == (16, 16, 3)
    assert textures.image_of(png(), 4).shape == (8, 8, 3)
    monkeypatch.setattr(textures, "_MAX_DECODED", 512)
    with pytest.raises(BrokenFileError, match="an image of 16 x 16 pixels, of at most 128"):
        textures.image_of(png(), 4)


# --- together ----------------------------------------------------------------------------------


def test_triangles_that_are_left_out_take_their_coordinates_along(tmp_path: Path) -> None:
    (tmp_path / "skin.png").write_bytes(png())
    faces = "f 1/1 1/1 2/2\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n"
    mesh = mesh_of(obj(tmp_path, COVERED + faces, "newmtl skin\nmap_Kd skin.png\n"))
    assert len(mesh.triangles) == 2
    assert colours_at(mesh, *QUARTER_PLACES) == QUARTER_COLOURS


def test_vertices_take_the_colours_of_the_texture() -> None:
    coordinates = SQUARE[:, :2][[[0, 1, 2], [0, 2, 3]]].astype(np.float32)
    texture = Texture(QUARTERS, coordinates)
    mesh = Mesh(SQUARE, np.array([[0, 1, 2], [0, 2, 3]]), texture=texture)
    np.testing.assert_array_equal(mesh.colours_of_vertices(), [BLUE, GREY, GREEN, RED])
