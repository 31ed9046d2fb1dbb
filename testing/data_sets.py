# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Folders of scans as they are downloaded: 3DBodyTex, and others."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import trimesh

_MTL = "newmtl material_0\nKd 1.0 1.0 1.0\nmap_Kd {name}.png\n"


def person(height=1.7, up="z", *, coarse=False):
    """Return a mesh of about a person's size, off the origin, with an axis that is up."""
    mesh = trimesh.creation.icosphere(1 if coarse else 2, radius=0.5)
    mesh.apply_scale([0.5, 0.3, height])
    mesh.apply_translation([0.3, -0.2, 0.4 + height / 2])
    turns = {
        "z": np.eye(4),
        "y": _columns([0, 2, 1], [1, 1, -1]),
        "x": _columns([2, 1, 0], [1, 1, -1]),
    }
    mesh.apply_transform(turns[up])
    return mesh


def _columns(axes, signs):
    matrix = np.eye(4)
    matrix[:3, :3] = np.eye(3)[axes] * np.array(signs)[:, None]
    return matrix


def write_obj(path: Path, mesh, scale=1.0) -> Path:
    """Write a mesh as a scanner's program does: with texture coordinates, and a material."""
    name = path.stem
    lines = ["# a scan", f"mtllib {name}.mtl", "usemtl material_0"]
    lines += [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in mesh.vertices * scale]
    lines += [f"vt {i / len(mesh.vertices):.4f} 0.5" for i in range(len(mesh.vertices))]
    lines += ["f " + " ".join(f"{v}/{v}" for v in triangle + 1) for triangle in mesh.faces]
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join(lines) + "\n")
    path.with_suffix(".mtl").write_text(_MTL.format(name=name))
    return path


def write_npz(path: Path, mesh) -> Path:
    """Write a mesh as 3DBodyTex.v2 has it: an archive with a texture."""
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savez_compressed(
        path,
        vertices=mesh.vertices,
        faces=mesh.faces,
        texcoords=np.zeros((len(mesh.vertices), 2)),
        texcoords_indices=mesh.faces,
        texture=np.zeros((64, 64, 3), np.uint8),
    )
    (path.parent / "landmarks3d.txt").write_text("nose 0.1 1.6 0.2\near_left nan nan nan\n")
    return path


def body_tex_1(folder: Path, scans=("006-f-run", "012-m-u", "355-m-scape039"), scale=1.0) -> Path:
    """Lay out 3DBodyTex.v1: a folder per scan, y up, materials whose textures are not there."""
    root = folder / "3dbodytex-1.1-highres"
    for number, scan in enumerate(scans):
        path = root / scan / "model_highres_0_normalized.obj"
        write_obj(path, person(1.6 + number / 20, "y"), scale)
    (root / "README.txt").write_text("3DBodyTex: see the licence agreement\n")
    return root


def body_tex_2(folder: Path) -> Path:
    """Lay out 3DBodyTex.v2: archives, with partial scans and landmarks beside them."""
    root = folder / "Track1-3DBodyTex.v2"
    for part, scan in (("train", "170410-001-m-r9iu-df44"), ("test", "170410-007-f-1moq-b682")):
        name = f"{scan}-low-res-result"
        write_npz(root / part / name / f"{name}_normalized.npz", person(1.7, "y"))
        write_npz(
            root / part / name / f"{name}_normalized-partial-01.npz", person(1.5, "y", coarse=True)
        )
    return root
