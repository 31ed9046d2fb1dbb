# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A rig of the places to which a gantry takes one camera over a plane."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from focus_planner.core.arrays import FloatArray
from focus_planner.core.rig.aim import looking_along
from focus_planner.core.rig.camera import Camera, CameraIntrinsics
from focus_planner.core.rig.lens import Lens
from focus_planner.core.rig.plausible import RIG_SIZE
from focus_planner.core.rig.rig import MAX_CAMERAS, Rig
from focus_planner.core.validation import (
    InputError,
    check_array,
    check_choice,
    check_finite,
    check_number,
    check_whole,
)

#: Where a gantry's camera may look, in ROS's words (REP 103: x forward, y left, z up).
LOOKS = {
    "down": (0.0, 0.0, -1.0),
    "up": (0.0, 0.0, 1.0),
    "forward": (1.0, 0.0, 0.0),
    "backward": (-1.0, 0.0, 0.0),
    "left": (0.0, 1.0, 0.0),
    "right": (0.0, -1.0, 0.0),
}
# Of a picture: so much rounding asks for no further one.
_ROUNDING = 1e-9


def gantry_rig(
    width: float = 1.0,
    height: float = 0.7,
    distance: float = 0.5,
    overlap: float = 0.5,
    *,
    columns: int | None = None,
    rows: int | None = None,
    look: str = "down",
    centre: Sequence[float] = (0.0, 0.0, 0.0),
    intrinsics: CameraIntrinsics | None = None,
    lens: Lens | None = None,
    frame_id: str = "world",
) -> Rig:
    """Return the places at which one camera that moves over a plane photographs a rectangle of it.

    All pictures look the same way, straight at the plane, and together show the whole rectangle.
    They are listed in shooting order, row by row there and back: the even rows from the left of
    the image to its right, the odd ones from right to left, the lowest row first.
    ``cam_<row>_<column>`` counts rows from the bottom and columns from the left.

    Parameters
    ----------
    width, height : float
        Of the rectangle, along the image's x and y axis, metres.
    distance : float
        From the plane to the camera's centre of projection, metres. What rises above the plane is
        nearer, and pictures overlap less there.
    overlap : float
        The share of a picture that the next one of its row shows as well, and likewise of rows: at
        least 0, below 1. There are as few pictures as have at least this overlap.
    columns, rows : int, optional
        How many to take instead, equally spaced over the same rectangle; then the overlap follows,
        and if they are too few there are gaps.
    look : str
        ``"down"``, ``"up"``, or ``"forward"`` (+x), ``"backward"``, ``"left"`` (+y), ``"right"``.
        Images are upright; looking down or up, +y is at their top.
    centre : (3,) array
        The middle of the rectangle, metres.
    intrinsics : CameraIntrinsics, optional
        How much of the plane a picture shows is that of its pixels that are read out, without
        their distortion.
    lens, frame_id
        As for :func:`~focus_planner.core.rig.layouts.cylinder_rig`.

    Raises
    ------
    InputError
        If a value is out of range.
    """
    for name, value in (("width", width), ("height", height), ("distance", distance)):
        RIG_SIZE.check(name, check_number(name, value, above=0))
    check_number("overlap", overlap, at_least=0)
    if overlap >= 1:
        raise InputError("overlap", "a share of at least 0, below 1", f"{overlap:g}")
    direction = np.array(LOOKS[check_choice("look", look, tuple(LOOKS))])
    middle = check_array("centre", centre, (3,))
    check_finite("centre", middle, "number")
    image = intrinsics or CameraIntrinsics()
    x, y, read_width, read_height = image.pixels_read
    across = _places(
        "columns", columns, width, distance / image.fx, (x, read_width, image.cx), overlap
    )
    # The image's y axis points down; the lowest row is the first.
    upwards = _places(
        "rows", rows, height, distance / image.fy, (y, read_height, image.cy), overlap
    )[::-1]
    if len(across) * len(upwards) > MAX_CAMERAS:
        got = f"{len(upwards)} × {len(across)}"
        raise InputError("rows × columns", f"at most {MAX_CAMERAS}", got)
    turn = looking_along(direction[None])[0]
    right, down = turn.apply([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    qx, qy, qz, qw = (float(value) + 0.0 for value in turn.as_quat())
    digits = max(2, len(str(len(across) - 1)))
    cameras = []
    for row, v in enumerate(upwards):
        there = range(len(across))
        for column in there if row % 2 == 0 else reversed(there):
            place = middle - distance * direction + across[column] * right + v * down
            px, py, pz = (float(value) + 0.0 for value in place)
            name = f"cam_{row}_{column:0{digits}d}"
            cameras.append(Camera(name, (px, py, pz), (qx, qy, qz, qw), image, lens or Lens()))
    return Rig(tuple(cameras), frame_id, sequence=True)


def _places(
    name: str,
    count: int | None,
    length: float,
    pixel: float,
    pixels: tuple[int, int, float],
    overlap: float,
) -> FloatArray:
    """Return where along one axis of the image the camera stands, from the rectangle's middle.

    Parameters
    ----------
    name : str
        What the count is called.
    count : int, optional
        How many places; by default as many as the overlap takes.
    length : float
        Of the rectangle, metres.
    pixel : float
        Metres of the plane that one pixel shows.
    pixels : tuple of int, int and float
        The first that is read out, how many are, and the principal point.
    overlap : float
    """
    first, number, principal = pixels
    # A pixel's centre has an integer coordinate, so its border is half a pixel off.
    before = pixel * (principal - (first - 0.5))
    after = pixel * number - before
    start, end = before - length / 2, length / 2 - after
    if count is None:
        travel = max(end - start, 0.0)
        step = (1 - overlap) * pixel * number
        steps = travel / step
        if steps > MAX_CAMERAS:
            raise InputError(name, f"at most {MAX_CAMERAS}", f"{steps:.3g} for this overlap")
        count = math.ceil(steps - _ROUNDING) + 1
    if check_whole(name, count, 1, MAX_CAMERAS) == 1 or end <= start:
        if count > 1:
            got = f"{count}, though one picture shows {pixel * number:.3g} m"
            raise InputError(name, f"1 for the {length:g} m of the rectangle", got)
        return np.array([(start + end) / 2])
    return np.linspace(start, end, count)
