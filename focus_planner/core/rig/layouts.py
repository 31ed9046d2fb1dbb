# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Standard rigs: cameras on a cylinder, on a dome, and before a turntable."""

from __future__ import annotations

import math
from collections.abc import Sequence

from focus_planner.core.rig.camera import Camera, CameraIntrinsics
from focus_planner.core.rig.lens import Lens
from focus_planner.core.rig.plausible import RIG_SIZE
from focus_planner.core.rig.rig import MAX_CAMERAS, Grid, Rig
from focus_planner.core.validation import InputError, check_number, check_whole


def cylinder_rig(
    rows: int = 7,
    columns: int = 24,
    radius: float = 0.75,
    bottom: float = 0.1,
    top: float = 1.7,
    *,
    intrinsics: CameraIntrinsics | None = None,
    lens: Lens | None = None,
    frame_id: str = "world",
) -> Rig:
    """Return cameras on a cylinder about the z axis, looking horizontally at the axis.

    Column j stands at the angle 2πj/columns from +x; the image's y axis points down (−z). Cameras
    are listed row by row from the bottom. The defaults are the paper's rig (Sec. 4.2).

    Parameters
    ----------
    rows, columns : int
    radius, bottom, top : float
        Metres; a single row stands halfway between ``bottom`` and ``top``.
    intrinsics : CameraIntrinsics, optional
    lens : Lens, optional
        Shared by all cameras; the paper's by default.
    frame_id : str
        Of the poses.

    Raises
    ------
    InputError
        If a value is out of range.
    """
    check_whole("rows", rows, 1)
    check_whole("columns", columns, 1)
    _check_total("rows × columns", rows * columns)
    _check_radius(radius)
    heights = _heights(rows, bottom, top)
    digits = max(2, len(str(columns - 1)))
    cameras = []
    for row, z in enumerate(heights):
        for column in range(columns):
            angle = 2 * math.pi * column / columns
            cameras.append(
                Camera(
                    name=f"cam_{row}_{column:0{digits}d}",
                    position=(
                        radius * math.cos(angle),
                        radius * math.sin(angle),
                        z,
                    ),
                    orientation=_facing_axis(angle),
                    intrinsics=intrinsics or CameraIntrinsics(),
                    lens=lens or Lens(),
                )
            )
    return Rig(tuple(cameras), frame_id, Grid(rows, columns))


def dome_rig(
    rings: int = 5,
    columns: int = 20,
    radius: float = 1.2,
    lowest: float = 0.0,
    highest: float = 80.0,
    height: float = 0.8,
    *,
    one_camera: bool = False,
    intrinsics: CameraIntrinsics | None = None,
    lens: Lens | None = None,
    frame_id: str = "world",
) -> Rig:
    """Return cameras on a dome about the z axis, looking at its centre.

    The rings are equally spaced in elevation. Higher ones are shorter and have fewer cameras, so
    that their distances stay alike. Camera j of n stands at the angle 2πj/n from +x. Cameras are
    listed ring by ring from the lowest, each ring from +x on.

    Parameters
    ----------
    rings : int
    columns : int
        Cameras that a ring at the height of the centre has.
    radius : float
        From the centre to the cameras, metres.
    lowest, highest : float
        Elevations of the first and the last ring above the centre, degrees; a single ring is
        halfway between them.
    height : float
        z of the centre, metres.
    one_camera : bool
        Whether one camera moves from place to place. They are then listed in shooting order: every
        second ring backwards, so that an arm goes there and back instead of round and round.
    intrinsics, lens, frame_id
        As for :func:`cylinder_rig`.

    Raises
    ------
    InputError
        If a value is out of range.
    """
    check_whole("rings", rings, 1)
    check_whole("columns", columns, 1)
    elevations = _elevations(rings, lowest, highest)
    counts = [max(1, round(columns * math.cos(elevation))) for elevation in elevations]
    _check_total("cameras", sum(counts))
    _check_radius(radius)
    _check_height("height", height)
    digits = max(2, len(str(max(counts) - 1)))
    cameras = [
        _looking_at_centre(
            f"cam_{ring}_{column:0{digits}d}",
            2 * math.pi * column / count,
            elevation,
            radius,
            height,
            intrinsics or CameraIntrinsics(),
            lens or Lens(),
        )
        for ring, (elevation, count) in enumerate(zip(elevations, counts, strict=True))
        for column in _there_and_back(count, back=one_camera and ring % 2 == 1)
    ]
    return Rig(tuple(cameras), frame_id, sequence=one_camera)


def turntable_rig(
    cameras: int = 3,
    stops: int = 24,
    radius: float = 0.6,
    lowest: float = 10.0,
    highest: float = 60.0,
    height: float = 0.05,
    *,
    bottom: float | None = None,
    top: float | None = None,
    one_camera: bool = False,
    intrinsics: CameraIntrinsics | None = None,
    lens: Lens | None = None,
    frame_id: str = "world",
) -> Rig:
    """Return the views that cameras on an arc have of a subject that turns before them.

    At every stop each camera takes a picture with a focus distance of its own, so it is planned as
    one camera per stop: ``cam_<camera>_<stop>``. Poses are in the frame of the turning subject,
    with its axis as z. At stop 0 the cameras are above +x. The subject turns counter-clockwise
    seen from above, so around it the cameras go clockwise: at stop k, which is a turn of the table
    by 2πk/stops, they are at −2πk/stops.

    Parameters
    ----------
    cameras, stops : int
    radius, lowest, highest, height
        As for :func:`dome_rig`, of whose rings each is a camera.
    bottom, top : float, optional
        Instead of elevations and a centre: z of the lowest and of the highest camera, metres, all
        of which look horizontally at the axis from ``radius`` away; a single one is halfway.
    one_camera : bool
        Whether there is one camera, which is moved after every turn of the table. Shooting order is
        then turn by turn, as the cameras are listed, instead of stop by stop.
    intrinsics, lens, frame_id
        As for :func:`cylinder_rig`.

    Raises
    ------
    InputError
        If a value is out of range.
    """
    check_whole("cameras", cameras, 1)
    check_whole("stops", stops, 1)
    _check_total("cameras × stops", cameras * stops)
    _check_radius(radius)
    _check_height("height", height)
    if (bottom is None) != (top is None):
        raise InputError("bottom and top", "both or neither", "one without the other")
    levels = [(elevation, height) for elevation in _elevations(cameras, lowest, highest)]
    if bottom is not None and top is not None:
        if (lowest, highest, height) != (10.0, 60.0, 0.05):
            expected = "these, or lowest, highest and height"
            raise InputError("bottom and top", expected, "both")
        levels = [(0.0, z) for z in _heights(cameras, bottom, top)]
    digits = max(2, len(str(stops - 1)))
    views = [
        _looking_at_centre(
            f"cam_{camera}_{stop:0{digits}d}",
            -2 * math.pi * stop / stops,
            elevation,
            radius,
            z,
            intrinsics or CameraIntrinsics(),
            lens or Lens(),
        )
        for camera, (elevation, z) in enumerate(levels)
        for stop in range(stops)
    ]
    return Rig(tuple(views), frame_id, Grid(cameras, stops), sequence=one_camera)


def _check_total(argument: str, count: int) -> None:
    if count > MAX_CAMERAS:
        raise InputError(argument, f"at most {MAX_CAMERAS}", str(count))


def _check_radius(radius: float) -> None:
    RIG_SIZE.check("radius", check_number("radius", radius, above=0))


def _check_height(argument: str, z: float) -> None:
    if check_number(argument, z):
        RIG_SIZE.check(argument, z)


def _heights(count: int, bottom: float, top: float) -> Sequence[float]:
    """Return equally spaced heights, metres; that of one is halfway."""
    _check_height("bottom", bottom)
    _check_height("top", top)
    if top < bottom:
        raise InputError("top", f"at least bottom ({bottom:g} m)", f"{top:g} m")
    return [bottom + share * (top - bottom) for share in _shares(count)]


def _shares(count: int) -> Sequence[float]:
    return [i / (count - 1) for i in range(count)] if count > 1 else [0.5]


def _there_and_back(count: int, *, back: bool) -> Sequence[int]:
    return range(count - 1, -1, -1) if back else range(count)


def _elevations(count: int, lowest: float, highest: float) -> Sequence[float]:
    """Return equally spaced elevations, radians; that of one is halfway."""
    check_number("lowest", lowest, at_least=-90, at_most=90)
    check_number("highest", highest, at_least=-90, at_most=90)
    if highest < lowest:
        raise InputError("highest", f"at least lowest ({lowest:g}°)", f"{highest:g}°")
    return [math.radians(lowest + share * (highest - lowest)) for share in _shares(count)]


def _looking_at_centre(
    name: str,
    angle: float,
    elevation: float,
    radius: float,
    height: float,
    intrinsics: CameraIntrinsics,
    lens: Lens,
) -> Camera:
    """Return a camera at an angle from +x and an elevation that looks at (0, 0, height)."""
    level = radius * math.cos(elevation)
    position = (
        level * math.cos(angle),
        level * math.sin(angle),
        height + radius * math.sin(elevation),
    )
    x, y, z, w = _facing_axis(angle)
    # Then a turn about its own x axis, downwards.
    s, c = -math.sin(elevation / 2), math.cos(elevation / 2)
    orientation = (w * s + x * c, y * c + z * s, z * c - y * s, w * c - x * s)
    return Camera(name, position, orientation, intrinsics, lens)


def _facing_axis(angle: float) -> tuple[float, float, float, float]:
    """Return the orientation with z towards the axis, x to the right, y down.

    At angle 0 the optical x, y, z axes are the world's +y, −z, −x: the quaternion
    (−½, −½, ½, ½). A rotation by ``angle`` about the world's z follows.
    """
    c, s = math.cos(angle / 2), math.sin(angle / 2)
    return ((-c + s) / 2, (-c - s) / 2, (c + s) / 2, (c - s) / 2)
