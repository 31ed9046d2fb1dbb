# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A rig of the places of one camera that moves along a path."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from focus_planner.core.arrays import FloatArray, IntArray
from focus_planner.core.rig.aim import looking_along
from focus_planner.core.rig.camera import Camera, CameraIntrinsics
from focus_planner.core.rig.lens import Lens
from focus_planner.core.rig.rig import MAX_CAMERAS, Rig
from focus_planner.core.validation import (
    MAX_COORDINATE,
    InputError,
    check_array,
    check_finite,
    check_whole,
)


def path_rig(
    positions: ArrayLike,
    orientations: ArrayLike | None = None,
    *,
    targets: ArrayLike | None = None,
    steps: int = 0,
    closed: bool = False,
    names: Sequence[str] | None = None,
    intrinsics: CameraIntrinsics | None = None,
    lens: Lens | None = None,
    frame_id: str = "world",
) -> Rig:
    """Return the places of one camera that moves along a path, in shooting order.

    Parameters
    ----------
    positions : (N, 3) array
        Along the path, metres.
    orientations : (N, 4) array, optional
        Of the optical frames there, as quaternions x, y, z, w.
    targets : (3,) or (N, 3) array, optional
        Instead, what the camera looks at, upright: one point, or one for each position, metres.
        Straight up and down, +y is at the top of its image.
    steps : int
        How many pictures to take, equally spaced along the path, from its first position to its
        last; a single one is halfway. 0 takes one at each position.
    closed : bool
        Whether the path ends where it begins. Its length then includes the way back, and the last
        of the ``steps`` is one step before the first.
    names : sequence of str, optional
        Of the cameras, if there is one at each position; ``cam_00``, ``cam_01``, … by default.
    intrinsics, lens, frame_id
        As for :func:`~focus_planner.core.rig.layouts.cylinder_rig`.

    Returns
    -------
    Rig
        Between two positions the camera moves on a straight line, and what it looks at does too;
        without targets it turns about one axis at constant speed, the short way (slerp).

    Raises
    ------
    InputError
        If there are neither orientations nor targets, or both; a number is not finite, a
        quaternion has no unit norm, a camera is where it is to look; or there are to be ``steps``
        along a path without length.
    """
    places = _vectors("positions", positions, 3)
    if (orientations is None) == (targets is None):
        got = "neither" if targets is None else "both"
        raise InputError("path", "either orientations or targets", got)
    check_whole("steps", steps, 0, MAX_CAMERAS)
    if not steps and len(places) > MAX_CAMERAS:
        raise InputError("positions", f"at most {MAX_CAMERAS}", str(len(places)))
    turns = None if orientations is None else _rotations(orientations, len(places))
    aims = None if targets is None else _targets(targets, len(places))
    if steps:
        at, share, after = _spread(places, steps, closed=closed)
        if turns is not None:
            way = (turns[at].inv() * turns[after]).as_rotvec()
            turns = turns[at] * Rotation.from_rotvec(share[:, None] * way)
        if aims is not None:
            aims = _between(aims, at, share, after)
        places = _between(places, at, share, after)
    if turns is None:
        assert aims is not None
        turns = looking_along(aims - places)
    digits = max(2, len(str(len(places) - 1)))
    called = [f"cam_{i:0{digits}d}" for i in range(len(places))]
    if names is not None and not steps:
        if len(names) != len(places):
            raise InputError("names", f"{len(places)}, one for each position", str(len(names)))
        called = list(names)
    cameras = [
        Camera(name, (x, y, z), (qx, qy, qz, qw), intrinsics or CameraIntrinsics(), lens or Lens())
        for name, (x, y, z), (qx, qy, qz, qw) in zip(
            # + 0.0: no −0
            called,
            (places + 0.0).tolist(),
            (turns.as_quat() + 0.0).tolist(),
            strict=True,
        )
    ]
    return Rig(tuple(cameras), frame_id, sequence=True)


def _vectors(name: str, values: ArrayLike, size: int) -> FloatArray:
    array = check_array(name, values, (None, size))
    if not len(array):
        raise InputError(name, "at least one", "none")
    check_finite(name, array, "row")
    if np.abs(array).max() > MAX_COORDINATE:
        expected = f"coordinates up to {MAX_COORDINATE:g} m"
        raise InputError(name, expected, f"{np.abs(array).max():g}")
    return array


def _rotations(orientations: ArrayLike, count: int) -> Rotation:
    quaternions = _vectors("orientations", orientations, 4)
    if len(quaternions) != count:
        expected = f"{count}, one for each position"
        raise InputError("orientations", expected, str(len(quaternions)))
    norms = np.linalg.norm(quaternions, axis=1)
    off = np.flatnonzero(~(np.abs(norms - 1) <= 1e-3))  # as for a camera's orientation
    if len(off):
        i = int(off[0])
        got = f"{tuple(quaternions[i].tolist())} of norm {norms[i]:g}"
        raise InputError(f"orientations[{i}]", "a unit quaternion x, y, z, w", got)
    return Rotation.from_quat(quaternions.copy())  # SciPy wants writeable arrays


def _targets(targets: ArrayLike, count: int) -> FloatArray:
    if np.ndim(targets) == 1:
        return np.tile(_vectors("targets", np.reshape(targets, (1, -1)), 3), (count, 1))
    points = _vectors("targets", targets, 3)
    if len(points) != count:
        expected = f"one point, or {count}, one for each position"
        raise InputError("targets", expected, str(len(points)))
    return points


def _spread(
    places: FloatArray, steps: int, *, closed: bool
) -> tuple[IntArray, FloatArray, IntArray]:
    """Return where equally spaced steps are: the place before each, the share of way, the next."""
    corners = np.append(np.arange(len(places)), 0) if closed else np.arange(len(places))
    lengths = np.linalg.norm(np.diff(places[corners], axis=0), axis=1)
    # Where nothing moves there is no step.
    moving = np.flatnonzero(lengths > 0)
    if not len(moving):
        raise InputError(
            "steps",
            "0, for a path without length",
            str(steps),
            "take the poses as they are, or give positions that differ",
        )
    ends = np.cumsum(lengths[moving])
    if closed:
        along = ends[-1] * np.arange(steps) / steps
    elif steps == 1:
        along = ends[-1:] / 2
    else:
        along = ends[-1] * np.linspace(0.0, 1.0, steps)
    leg = np.minimum(np.searchsorted(ends, along, side="right"), len(ends) - 1)
    first = moving[leg]
    begin = ends[leg] - lengths[first]
    share = np.clip((along - begin) / lengths[first], 0.0, 1.0)
    return corners[first], share, corners[first + 1]


def _between(values: FloatArray, at: IntArray, share: FloatArray, after: IntArray) -> FloatArray:
    mixed: FloatArray = values[at] + share[:, None] * (values[after] - values[at])
    return mixed
