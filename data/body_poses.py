# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Poses of people who stand in a rig: how joints turn, in an anatomist's terms.

People face −y, their left is +x, z is up. Angles are degrees. A pose becomes rotations of bones of
the Anny body model, in the axes of the world as the body stands in the model's reference pose.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from trimesh.transformations import rotation_matrix

Array = NDArray[np.float64]
Joints = dict[str, Array]  # bone → (3,) where it begins in the reference pose, m
Rotations = dict[str, Array]  # bone → (3, 3), relative to the bone that it hangs on

_Ranges = tuple[tuple[float, float], ...]

_SPINE = ("spine05", "spine04", "spine03", "spine02", "spine01")
_NECK = ("neck01", "neck02", "neck03", "head")
_DOWN = np.array([0, 0, -1.0])
_SHRUG = 0.2  # of what an arm is lifted above 30°, the clavicle's share


class Arm(NamedTuple):
    """How one arm is held.

    `elevation` of the upper arm: 0 hangs, 90 is level. `azimuth`: 0 to the side, 90 to the front.
    `rotation` of the upper arm outward, which turns a bent forearm up. `flexion` of the elbow: 0 is
    straight. `supination` turns the palm.
    """

    elevation: float
    azimuth: float
    rotation: float
    flexion: float
    supination: float


class Leg(NamedTuple):
    """How one leg is held: hip to the side, hip to the front, knee, and the foot turned out."""

    abduction: float
    hip: float
    knee: float
    turnout: float


class Trunk(NamedTuple):
    """How trunk and head are held: `bend` and `nod` forward, the others to the left or right."""

    bend: float
    lean: float
    twist: float
    nod: float
    look: float


@dataclass(frozen=True)
class Pose:
    """A pose: its kind and its parts."""

    kind: str
    left_arm: Arm
    right_arm: Arm
    left_leg: Leg
    right_leg: Leg
    trunk: Trunk


# Least and greatest angle, in the order of the fields above.
_ARMS: dict[str, _Ranges] = {
    "down": ((12, 45), (-10, 25), (-20, 20), (5, 40), (-20, 30)),
    "out": ((60, 95), (-10, 35), (-10, 95), (40, 110), (-20, 30)),
    "raised": ((100, 150), (0, 40), (0, 60), (20, 110), (-20, 30)),
    "forward": ((35, 100), (45, 95), (30, 90), (10, 80), (-20, 30)),
}
_LEG: _Ranges = ((-5, 6), (-6, 6), (0, 8), (-5, 15))
_STRONG_LEG: _Ranges = ((-2, 10), (-14, 22), (5, 45), (-5, 20))
_TRUNK: _Ranges = ((-3, 6), (-3, 3), (-5, 5), (-8, 12), (-12, 12))
_STRONG_TRUNK: _Ranges = ((-5, 30), (-15, 15), (-25, 25), (-15, 20), (-30, 30))
_KINDS = {"down": 0.3, "out": 0.2, "raised": 0.15, "asymmetric": 0.15, "strong": 0.2}


def draw_pose(generator: np.random.Generator) -> Pose:
    """Draw a pose: one of whole-body photography, each arm held differently, or a stronger one."""
    kind = str(generator.choice(list(_KINDS), p=list(_KINDS.values())))
    strong = kind == "strong"
    left_arm, right_arm = _draw_arms(kind, generator)
    left_leg, right_leg = _draw_legs(_STRONG_LEG if strong else _LEG, generator)
    trunk = Trunk(*_draw(_STRONG_TRUNK if strong else _TRUNK, generator))
    return Pose(kind, left_arm, right_arm, left_leg, right_leg, trunk)


def _draw_arms(kind: str, generator: np.random.Generator) -> tuple[Arm, Arm]:
    if kind in _ARMS:
        both = _draw(_ARMS[kind], generator)
        left, right = (both + generator.normal(0, 3, both.size) for _ in range(2))
    else:
        names = generator.choice(list(_ARMS), 2, replace=kind == "strong")
        left, right = (_draw(_ARMS[name], generator) for name in names)
    return Arm(*left), Arm(*right)


def _draw_legs(ranges: _Ranges, generator: np.random.Generator) -> tuple[Leg, Leg]:
    """Draw a stance: one foot before the other, the knees bent alike, so that both feet stand."""
    out, step, knee, turn = _draw(ranges, generator)
    return Leg(out, knee / 2 + step, knee, turn), Leg(out, knee / 2 - step, knee, turn)


def _draw(ranges: _Ranges, generator: np.random.Generator) -> Array:
    low, high = np.transpose(ranges)
    drawn: Array = generator.uniform(low, high)
    return drawn


def rotations(pose: Pose, joints: Joints) -> Rotations:
    """Return how each bone that is not at rest turns.

    Parameters
    ----------
    pose : Pose
    joints : dict of (3,) arrays
        Where each bone begins in the reference pose, m.

    Returns
    -------
    dict of (3, 3) arrays
        Rotations in the axes of the reference pose, each applied before that of the bone above.
    """
    left = _arm(pose.left_arm, joints) | _leg(pose.left_leg)
    right = _arm(pose.right_arm, joints) | _leg(pose.right_leg)
    mirrored = {f"{bone}.R": _mirrored(matrix) for bone, matrix in right.items()}
    return {f"{bone}.L": matrix for bone, matrix in left.items()} | mirrored | _trunk(pose.trunk)


def _arm(arm: Arm, joints: Joints) -> Rotations:
    """Return the rotations of the left arm's bones."""
    shoulder, elbow, wrist = (joints[f"{b}.L"] for b in ("upperarm01", "lowerarm01", "wrist"))
    upper, fore = elbow - shoulder, wrist - elbow
    lift = arm.elevation - _angle(upper, _DOWN)
    clavicle = _about_y(-_SHRUG * max(arm.elevation - 30, 0))
    whole = _about_z(-arm.azimuth) @ _about_y(-lift)
    return {
        "clavicle": clavicle,
        "upperarm01": clavicle.T @ whole @ _turn(-arm.rotation / 2, upper),
        "upperarm02": _turn(-arm.rotation / 2, upper),
        "lowerarm01": _turn(arm.flexion - _angle(upper, fore), np.cross(upper, fore)),
        "lowerarm02": _turn(-arm.supination, fore),
    }


def _leg(leg: Leg) -> Rotations:
    """Return the rotations of the left leg's bones; the foot stays level."""
    hip = _about_y(-leg.abduction) @ _about_x(-leg.hip)
    knee = _about_x(leg.knee)
    return {
        "upperleg01": hip,
        "lowerleg01": knee,
        "foot": (hip @ knee).T @ _about_z(leg.turnout),
    }


def _trunk(trunk: Trunk) -> Rotations:
    spine, neck = 1 / len(_SPINE), 1 / len(_NECK)
    bent = _about_x(trunk.bend * spine) @ _about_y(trunk.lean * spine)
    bent = bent @ _about_z(trunk.twist * spine)
    turned = _about_x(trunk.nod * neck) @ _about_z(trunk.look * neck)
    return dict.fromkeys(_SPINE, bent) | dict.fromkeys(_NECK, turned)


def _angle(a: Array, b: Array) -> float:
    cosine = float(a @ b / np.linalg.norm(a) / np.linalg.norm(b))
    return float(np.degrees(np.arccos(cosine)))


def _turn(degrees: float, axis: Array) -> Array:
    matrix: Array = rotation_matrix(np.radians(degrees), axis)[:3, :3]
    return matrix


def _about_x(degrees: float) -> Array:
    return _turn(degrees, np.array([1.0, 0, 0]))


def _about_y(degrees: float) -> Array:
    return _turn(degrees, np.array([0, 1.0, 0]))


def _about_z(degrees: float) -> Array:
    return _turn(degrees, np.array([0, 0, 1.0]))


def _mirrored(matrix: Array) -> Array:
    """Return the rotation that is the mirror image, left for right."""
    mirror = np.diag([-1.0, 1, 1])
    image: Array = mirror @ matrix @ mirror
    return image
