# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The poses of bodies, on a skeleton of straight bones."""

from __future__ import annotations

import re
from collections import Counter

import numpy as np
import pytest
from body_poses import _KINDS, Arm, Leg, Pose, Trunk, draw_pose, rotations

from testing.pages import ROOT

# The left arm's, half lifted and somewhat bent; the right one is its mirror image.
JOINTS = {
    "upperarm01.L": np.array([0.2, 0, 1.4]),
    "lowerarm01.L": np.array([0.4, 0, 1.2]),
    "wrist.L": np.array([0.55, -0.15, 1.05]),
}
UPPER = JOINTS["lowerarm01.L"] - JOINTS["upperarm01.L"]
FORE = JOINTS["wrist.L"] - JOINTS["lowerarm01.L"]
MIRROR = np.diag([-1.0, 1, 1])
AT_EASE = Pose(
    "down",
    Arm(20, 0, 0, 10, 0),
    Arm(20, 0, 0, 10, 0),
    Leg(0, 0, 0, 0),
    Leg(0, 0, 0, 0),
    Trunk(*[0] * 5),
)


def turned(**parts):
    return rotations(Pose(**{**vars(AT_EASE), **parts}), JOINTS)


def chain(found, *bones):
    return np.linalg.multi_dot([np.eye(3), *(found[bone] for bone in bones)])


def upper_arm(found, side="L"):
    direction = UPPER if side == "L" else MIRROR @ UPPER
    return chain(found, f"clavicle.{side}", f"upperarm01.{side}") @ direction


def forearm(found):
    return chain(found, "clavicle.L", "upperarm01.L", "upperarm02.L", "lowerarm01.L") @ FORE


def cosine(a, b):
    return a @ b / np.linalg.norm(a) / np.linalg.norm(b)


def test_a_drawn_pose_turns_bones_and_nothing_else():
    for seed in range(50):
        for matrix in rotations(draw_pose(np.random.default_rng(seed)), JOINTS).values():
            assert matrix @ matrix.T == pytest.approx(np.eye(3), abs=1e-12)
            assert np.linalg.det(matrix) == pytest.approx(1)


@pytest.mark.parametrize(
    ("elevation", "azimuth", "direction"),
    [
        (0, 0, (0, 0, -1)),
        (90, 0, (1, 0, 0)),
        (90, 90, (0, -1, 0)),
        (180, 0, (0, 0, 1)),
        (45, 0, (1, 0, -1)),
        (135, 90, (0, -1, 1)),
    ],
)
def test_an_upper_arm_points_where_elevation_and_azimuth_say(elevation, azimuth, direction):
    arm = Arm(elevation, azimuth, 30, 20, 10)
    found = turned(left_arm=arm, right_arm=arm)
    assert cosine(upper_arm(found), np.array(direction)) == pytest.approx(1)
    assert cosine(upper_arm(found, "R"), MIRROR @ direction) == pytest.approx(1)


@pytest.mark.parametrize("flexion", [0, 30, 90])
def test_an_elbow_is_bent_by_its_flexion(flexion):
    found = turned(left_arm=Arm(50, 20, 40, flexion, 0))
    assert cosine(upper_arm(found), forearm(found)) == pytest.approx(np.cos(np.radians(flexion)))


@pytest.mark.parametrize(("rotation", "direction"), [(0, (0, -1, 0)), (90, (0, 0, 1))])
def test_a_level_arms_forearm_points_forward_and_rotated_outward_up(rotation, direction):
    found = turned(left_arm=Arm(90, 0, rotation, 90, 0))
    assert cosine(forearm(found), np.array(direction)) == pytest.approx(1)


def test_left_and_right_are_mirror_images():
    found = turned(left_arm=Arm(*range(10, 60, 10)), right_arm=Arm(*range(10, 60, 10)))
    for bone in (name for name in found if name.endswith(".L")):
        image = MIRROR @ found[bone] @ MIRROR
        assert found[f"{bone[:-2]}.R"] == pytest.approx(image, abs=1e-12), bone


def test_a_leg_goes_forward_and_out_its_knee_bends_back_and_its_foot_stays_level():
    found = turned(left_leg=Leg(10, 20, 30, 15))
    down = np.array([0, 0, -1.0])
    thigh, shin = found["upperleg01.L"] @ down, chain(found, "upperleg01.L", "lowerleg01.L") @ down
    assert thigh[0] > 0 > thigh[1]
    assert shin[1] > thigh[1]
    foot = chain(found, "upperleg01.L", "lowerleg01.L", "foot.L")
    assert foot @ [0, 0, 1] == pytest.approx([0, 0, 1], abs=1e-12)
    assert (foot @ [0, -1, 0])[0] > 0


def test_both_feet_of_a_drawn_stance_are_equally_high():
    for seed in range(50):
        pose = draw_pose(np.random.default_rng(seed))
        found = rotations(pose, JOINTS)
        ankles = [
            (found[f"upperleg01.{side}"] @ (np.eye(3) + found[f"lowerleg01.{side}"]))[2, 2]
            for side in "LR"
        ]
        assert ankles[0] == pytest.approx(ankles[1])


def test_a_trunk_bends_forward_over_all_of_the_spine():
    found = turned(trunk=Trunk(50, 0, 0, 40, 0))
    back = chain(found, *(f"spine0{k}" for k in (5, 4, 3, 2, 1)))
    assert back @ [0, 0, 1] == pytest.approx([0, -np.sin(np.radians(50)), np.cos(np.radians(50))])
    head = chain(found, "neck01", "neck02", "neck03", "head") @ [0, 0, 1]
    assert head == pytest.approx([0, -np.sin(np.radians(40)), np.cos(np.radians(40))])


def test_a_seed_gives_a_pose_again_and_all_kinds_come():
    drawn = [draw_pose(np.random.default_rng(seed)) for seed in range(300)]
    assert drawn[7] == draw_pose(np.random.default_rng(7))
    shares = {kind: count / 300 for kind, count in Counter(pose.kind for pose in drawn).items()}
    assert shares == pytest.approx(_KINDS, abs=0.1)


def test_the_page_states_the_shares_of_the_kinds():
    page = (ROOT / "data" / "README.md").read_text(encoding="utf-8")
    said = {
        kind: int(share) / 100 for kind, share in re.findall(r"(?m)^\| (\w+) \| (\d+) % ", page)
    }
    assert said == _KINDS
