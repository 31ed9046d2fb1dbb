"""Calibrations as other programs write them, for the recipes in the docs.

``python -m testing.calibrations colmap FOLDER``, ``... transforms FILE`` and
``... camera_info FOLDER``.
"""

from __future__ import annotations

import sys
from pathlib import Path

import yaml

from focus_planner.core.rig.geometry import camera_positions, camera_rotations
from focus_planner.core.rig.layouts import cylinder_rig

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


_WRITERS = {
    "colmap": write_colmap,
    "transforms": write_transforms,
    "camera_info": write_camera_info,
}

if __name__ == "__main__":
    _WRITERS[sys.argv[1]](Path(sys.argv[2]))
