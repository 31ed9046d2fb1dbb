# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Mistakes in the poses of a rig, or in a surface's up axis, and how to correct them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from focus_planner.core.arrays import FloatArray
from focus_planner.core.rig.camera import Camera
from focus_planner.core.rig.frames import BODY_FROM_OPTICAL
from focus_planner.core.surface.up_axis import TURNS


class Poses(NamedTuple):
    """The poses of C cameras: (C, 3) positions, and C orientations."""

    positions: FloatArray
    orientations: Rotation


class Trial(NamedTuple):
    """A mistake that may have been made, and what corrects it."""

    code: str
    assumption: str
    meaning: str
    correct: Callable[[Poses], Poses]


def poses_of(cameras: Sequence[Camera]) -> Poses:
    """Return the poses of some cameras."""
    return Poses(
        np.array([camera.position for camera in cameras]),
        Rotation.from_quat([camera.orientation for camera in cameras]),
    )


def posed(cameras: Iterable[Camera], poses: Poses) -> Iterator[Camera]:
    """Yield the cameras at other poses."""
    places, turns = poses.positions.tolist(), poses.orientations.as_quat().tolist()
    for camera, place, turn in zip(cameras, places, turns, strict=True):
        yield replace(camera, position=tuple(place), orientation=tuple(turn))


def trials() -> Iterator[Trial]:
    """Yield the mistakes, the commonest first: of equals the first is suspected."""
    yield _up_axis("y")
    yield Trial(
        "quaternion_order",
        "quaternions read as w, x, y, z",
        "the orientations are probably written in that order; write them as x, y, z, w",
        _reordered,
    )
    yield Trial(
        "camera_axes",
        "the cameras' frames read as OpenGL's (x right, y up, z backward)",
        "they probably are; give optical frames (x right, y down, z forward): turn each camera by"
        " half a turn about its x axis",
        partial(_turned, turn=Rotation.from_quat([1.0, 0.0, 0.0, 0.0])),
    )
    yield Trial(
        "camera_axes",
        "the cameras' frames read as body frames (x forward, y left, z up)",
        "they probably are; give optical frames (x right, y down, z forward)",
        partial(_turned, turn=BODY_FROM_OPTICAL.rotation),
    )
    yield Trial(
        "inverted_poses",
        "the camera poses inverted",
        "they probably go from the world to the cameras; give the cameras' positions and"
        " orientations in the world",
        _inverted,
    )
    for up in ("x", "-z", "-y", "-x"):
        yield _up_axis(up)


def _up_axis(up: str) -> Trial:
    option = f"--up={up}" if up.startswith("-") else f"--up {up}"
    return Trial(
        "up_axis",
        f"the surface's {up} axis up",
        f"that is probably its up; turn its (x, y, z) to {TURNS[up]}, as focus_planner plan does"
        f" with {option}",
        # A turned surface and a rig that is turned the other way look the same.
        partial(_all_turned, turn=Rotation.from_matrix(TURNS[up].matrix()).inv()),
    )


def _reordered(poses: Poses) -> Poses:
    quaternions = np.roll(poses.orientations.as_quat(), -1, axis=1)
    return Poses(poses.positions, Rotation.from_quat(quaternions))


def _turned(poses: Poses, turn: Rotation) -> Poses:
    """Turn each camera about its own centre."""
    return Poses(poses.positions, poses.orientations * turn)


def _inverted(poses: Poses) -> Poses:
    inverse = poses.orientations.inv()
    return Poses(-inverse.apply(poses.positions), inverse)


def _all_turned(poses: Poses, turn: Rotation) -> Poses:
    """Turn the rig about the origin."""
    return Poses(turn.apply(poses.positions), turn * poses.orientations)
