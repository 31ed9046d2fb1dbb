# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Files of the poses of one moving camera."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from focus_planner.core.rig.frames import similarity_from_matrix
from focus_planner.core.rig.geometry import camera_positions, camera_rotations
from focus_planner.core.rig.layouts import dome_rig
from focus_planner.core.rig.rig import Rig
from focus_planner.core.validation import InputError
from focus_planner.io.lens_sheet.content import lens_sheet
from focus_planner.io.lens_sheet.csv_text import sheet_to_csv
from focus_planner.io.rig_files.camera_path import load_path
from testing.lens_sheets import camera, plan, shot

RIG = dome_rig(2, 5, 0.4, 10.0, 70.0, 0.1, one_camera=True)
TUM_HEAD = "# ground truth trajectory\n# file: 'scan.bag'\n"


def pose(camera):
    return [*camera.position, *camera.orientation]


def text_of(rows, separator=" "):
    return "".join(separator.join(map(repr, row)) + "\n" for row in rows)


def read(folder: Path, text: str, **options) -> Rig:
    path = folder / "path.txt"
    path.write_text(text, encoding="utf-8")
    return load_path(path, **options)


def assert_same_poses(rig: Rig, expected: Rig = RIG) -> None:
    np.testing.assert_allclose(camera_positions(rig), camera_positions(expected), atol=1e-15)
    np.testing.assert_allclose(camera_rotations(rig), camera_rotations(expected), atol=1e-14)
    assert rig.sequence


POSES = [pose(each) for each in RIG.cameras]
TITLES = ["x", "y", "z", "qx", "qy", "qz", "qw"]


@pytest.mark.parametrize(
    "text",
    [
        text_of(POSES),
        text_of(POSES, ","),
        text_of([1305031098.6659 + i, *row] for i, row in enumerate(POSES)),
        TUM_HEAD
        + "# timestamp tx ty tz qx qy qz qw\n"
        + text_of([0.04 * i, *row] for i, row in enumerate(POSES)),
        ",".join(TITLES) + "\n" + text_of(POSES, ","),
        "\ufeff" + "; ".join(each.upper() for each in TITLES) + "\r\n" + text_of(POSES, ";"),
        "#" + "\t".join(TITLES[::-1]) + "\n\n" + text_of((r[::-1] for r in POSES), "\t"),
        "x [m],y [m],z (m),note,qx,qy,qz,qw\n"
        + "".join(",".join([*map(repr, r[:3]), '"a, b"', *map(repr, r[3:])]) + "\n" for r in POSES),
    ],
)
def test_every_layout_of_poses_is_read(tmp_path, text):
    rig = read(tmp_path, text)
    assert_same_poses(rig)
    assert [camera.name for camera in rig.cameras] == [f"cam_{i:02d}" for i in range(len(POSES))]
    assert rig.frame_id == "world"


def test_a_plans_csv_is_a_path(tmp_path):
    planned = plan(*(camera(each.name, shot(0.4)) for each in RIG.cameras))
    again = read(tmp_path, sheet_to_csv(lens_sheet(planned, RIG)))
    assert_same_poses(again)
    assert [each.name for each in again.cameras] == [each.name for each in RIG.cameras]


def test_what_is_looked_at_may_be_in_the_file_or_given(tmp_path):
    titles = "name,x,y,z,target_x,target_y,target_z\n"
    rows = "first,0,0,1,2,0,1\nsecond place,0,1,1,2,1,2\n"
    rig = read(tmp_path, titles + rows)
    assert [camera.name for camera in rig.cameras] == ["first", "second_place"]
    forward = camera_rotations(rig)[:, :, 2]
    np.testing.assert_allclose(forward[0], (1, 0, 0), atol=1e-15)
    np.testing.assert_allclose(forward[1], np.array([2, 0, 1]) / math.sqrt(5), atol=1e-15)
    given = read(tmp_path, titles + rows, target=(0, 5, 1))
    np.testing.assert_allclose(camera_rotations(given)[:, :, 2], [(0, 1, 0)] * 2, atol=1e-15)
    alone = read(tmp_path, "0 0 1\n0 1 1\n", target=(0, 5, 1))
    np.testing.assert_allclose(camera_rotations(alone), camera_rotations(given))


def test_body_frames_look_along_x(tmp_path):
    rig = read(tmp_path, "0 0 1 0 0 0 1\n", convention="body")
    np.testing.assert_allclose(
        camera_rotations(rig)[0].T, [(0, -1, 0), (0, 0, -1), (1, 0, 0)], atol=1e-15
    )


def test_scale_transform_and_steps(tmp_path):
    text = "x y z target_x target_y target_z\n0 0 0 0 1000 0\n2000 0 0 2000 1000 0\n"
    turned = similarity_from_matrix("m", [[0, -1, 0, 5], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
    rig = read(tmp_path, text, scale=0.001, transform=turned, steps=5, frame_id="cell")
    np.testing.assert_allclose(
        camera_positions(rig), [(5, 0.5 * k, 0) for k in range(5)], atol=1e-14
    )
    np.testing.assert_allclose(camera_rotations(rig)[:, :, 2], [(-1, 0, 0)] * 5, atol=1e-14)
    assert rig.frame_id == "cell"


@pytest.mark.parametrize(
    ("text", "options", "message"),
    [
        ("", {}, "path.txt: expected a path of camera poses, got an empty file"),
        ("# nothing\n", {}, "expected a path of camera poses, got none"),
        ("x,y,z\n", {}, "got titles alone"),
        ("0 0 0\n", {}, "titles qx, qy, qz, qw or target_x, .* or --target, got positions alone"),
        ("0 0 0 1 2\n", {}, "line 1: expected lines of x y z qx qy qz qw, .* got 5 numbers"),
        ("a b c\n", {}, "line 1: expected lines of x y z"),
        ("0 0 0 0 0 0 1\n0 0 0 0 0 1\n", {}, "line 2: expected 7 numbers, as on the first line"),
        ("0 0 0 0 0 0 1\n0 0 0 0 0 0 x\n", {}, "line 2: expected numbers"),
        ("0 0 0 0 0 0 2\n", {}, "line 1: rotation: expected a unit quaternion x, y, z, w"),
        ("0 0 nan 0 0 0 1\n", {}, "line 1: expected finite numbers"),
        ("x y z qx qy qz\n", {}, "line 1: expected the title qw as well"),
        ("x y z\n1 2\n", {"target": (0, 0, 0)}, "line 2: expected 3 values, as there are titles"),
        ("name,x,y,z\n!,0,0,0\n", {"target": (1, 0, 0)}, "line 2: expected a name with letters"),
        ("name,x,y,z\na,0,0,0\na,1,0,0\n", {"target": (9, 0, 0)}, "path.txt: rig: .* unique"),
        ("x,y,z\n0,0," + 200_000 * "0" + "\n", {"target": (9, 9, 0)}, "line 2: expected 3 values"),
        ("0 0 0\n900 0 0\n", {"target": (9, 9, 0)}, "positions: .* give --scale 0.001 if"),
        ("0 0 0\n1 0 0\n", {"target": (9, 9, 0), "scale": 0.0}, "--scale: expected a number above"),
        ("0 0 0\n1 0 0\n", {"target": (1, 0, 0)}, "path.txt: pose 2: expected a point elsewhere"),
        ("0 0 0 0 0 0 1\n", {"convention": "opengl"}, "convention: expected one of optical, body"),
    ],
)
def test_what_is_no_path_is_refused(tmp_path, text, options, message):
    with pytest.raises(InputError, match=message):
        read(tmp_path, text, **options)
