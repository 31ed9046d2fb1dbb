# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Calibrations as other programs write them, for the recipes in the docs.

``python -m testing.calibrations colmap FOLDER``, and likewise ``transforms FILE``, ``camera_info
FOLDER``, ``nerfstudio FILE``, ``metashape FILE``, ``realitycapture FOLDER``, ``kalibr FILE``,
``path FILE``.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import yaml
from PIL import Image
from scipy.spatial.transform import Rotation

from focus_planner.core.rig.geometry import camera_positions, camera_rotations
from focus_planner.core.rig.layouts import cylinder_rig, dome_rig
from testing import photogrammetry

#: Metres per unit of the model, as the recipe has it.
SCALE = 0.213


def write_colmap(folder: Path) -> None:
    """Write a sparse model of twelve cameras around the origin, in units of its own."""
    rig = cylinder_rig(2, 6, radius=1.2)
    images = []
    rotations, positions = camera_rotations(rig), camera_positions(rig) / SCALE
    for i, camera in enumerate(rig.cameras, start=1):
        x, y, z, w = camera.orientation
        place = -rotations[i - 1].T @ positions[i - 1]
        numbers = " ".join(repr(float(v)) for v in (w, -x, -y, -z, *place))
        images += [f"{i} {numbers} 1 cam{i:02}/0001.jpg", ""]
    folder.mkdir(parents=True)
    (folder / "cameras.txt").write_text("1 PINHOLE 4000 6000 8000 8000 2000 3000\n")
    (folder / "images.txt").write_text("\n".join(images) + "\n")


def write_transforms(path: Path) -> None:
    """Write what ``ros2 topic echo /tf_static`` prints of four cameras around the origin."""
    transforms = [
        {
            "header": {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": "world"},
            "child_frame_id": f"cam_{i}_optical_frame",
            "transform": {
                "translation": dict(zip("xyz", map(float, camera.position), strict=True)),
                "rotation": dict(zip("xyzw", map(float, camera.orientation), strict=True)),
            },
        }
        for i, camera in enumerate(cylinder_rig(1, 4, radius=1.5).cameras)
    ]
    path.write_text(yaml.safe_dump({"transforms": transforms}) + "---\n")


def write_camera_info(folder: Path) -> None:
    """Write what ``camera_calibration`` writes, for each of these four cameras."""
    calibration = {
        "image_width": 1920,
        "image_height": 1080,
        "camera_matrix": {"data": [1400.0, 0.0, 959.5, 0.0, 1405.0, 541.0, 0.0, 0.0, 1.0]},
        "distortion_model": "plumb_bob",
        "distortion_coefficients": {"data": [-0.2, 0.05, 0.001, -0.0005, 0.0]},
    }
    folder.mkdir()
    for i in range(4):
        (folder / f"cam_{i}.yaml").write_text(yaml.safe_dump(calibration))


def write_path(path: Path) -> None:
    """Write eight positions of a camera that goes around the origin, as a table."""
    rig = cylinder_rig(1, 8, radius=1.5, bottom=0.9, top=0.9)
    rows = (",".join(map(repr, camera.position)) for camera in rig.cameras)
    path.write_text("\n".join(["x,y,z", *rows]) + "\n")


def write_nerfstudio(path: Path) -> None:
    """Write a transforms.json of twelve pictures around the origin, in units of its own."""
    rig = cylinder_rig(2, 6, radius=1.2)
    size = {"w": 4000, "h": 6000, "fl_x": 8000.0, "fl_y": 8000.0, "cx": 2000.0, "cy": 3000.0}
    image = {"camera_model": "OPENCV", **size, "k1": -0.03, "k2": 0.01, "p1": 1e-4, "p2": -2e-4}
    path.parent.mkdir(parents=True, exist_ok=True)
    names = [f"images/cam{i + 1:02}.jpg" for i in range(len(rig))]
    photogrammetry.write_nerfstudio(path, rig, image, names, SCALE)


def write_metashape(path: Path) -> None:
    """Write a chunk in metres: twelve cameras around the origin, and one that is not aligned."""
    rig = cylinder_rig(2, 6, radius=1.2)
    placed = Rotation.from_euler("xyz", [20, -35, 110], degrees=True).as_matrix(), np.ones(3), 0.37
    sensor = photogrammetry.metashape_sensor(
        {"f": 8012.5, "cx": 11.25, "cy": -7.5, "k1": -0.031, "k2": 0.012, "p1": 1e-4, "p2": -2e-4},
        (4000, 6000),
        focal_length=50.0,
        pixel=0.00625,
    )
    cameras = [
        photogrammetry.metashape_camera(i, f"Kamera ({i + 1}).JPG", matrix)
        for i, matrix in enumerate(photogrammetry.metashape_matrices(rig, *placed))
    ]
    cameras.append(photogrammetry.metashape_camera(12, "Kamera (13).JPG", None))
    transform = photogrammetry.metashape_transform(*placed)
    path.write_text(photogrammetry.metashape_document([sensor], cameras, transform))


def write_realitycapture(folder: Path) -> None:
    """Write a registration of a dome as CSV, beside small pictures with the lens in their EXIF."""
    rig = dome_rig(2, 8, radius=1.4, lowest=10.0, highest=50.0)
    names = [f"cam{i + 1:02}.jpg" for i in range(len(rig))]
    values = {"f": 48.0, "px": 0.002, "py": -0.001, "k1": -0.03, "k2": 0.01, "k3": -0.002}
    folder.mkdir(parents=True)
    (folder / "cameras.csv").write_text(photogrammetry.realityscan_csv(rig, values, names))
    exif = Image.Exif()
    exif.get_ifd(0x8769)[0x920A] = 50.0
    for name in names:
        Image.new("L", (400, 600)).save(folder / name, exif=exif)


def write_kalibr(path: Path) -> None:
    """Write the camchain of four cameras in a row."""
    image = {
        "camera_model": "pinhole",
        "intrinsics": [1400.0, 1405.0, 959.5, 541.0],
        "distortion_model": "radtan",
        "distortion_coeffs": [-0.2, 0.05, 0.001, -0.0005],
        "resolution": [1920, 1080],
    }
    topics = [f"/cam{i}/image_raw" for i in range(4)]
    path.write_text(photogrammetry.kalibr_chain(cylinder_rig(1, 4, radius=1.5), image, topics))


_WRITERS = {
    "colmap": write_colmap,
    "transforms": write_transforms,
    "camera_info": write_camera_info,
    "nerfstudio": write_nerfstudio,
    "metashape": write_metashape,
    "realitycapture": write_realitycapture,
    "kalibr": write_kalibr,
    "path": write_path,
}

if __name__ == "__main__":
    _WRITERS[sys.argv[1]](Path(sys.argv[2]))
