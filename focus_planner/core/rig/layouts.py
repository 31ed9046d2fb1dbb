"""Standard rigs: cameras on a cylinder."""

from __future__ import annotations

import math

from focus_planner.core.rig.camera import Camera, CameraIntrinsics
from focus_planner.core.rig.lens import Lens
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
    intrinsics, lens : optional
        Shared by all cameras; the paper's by default.
    frame_id : str

    Raises
    ------
    InputError
        If a value is out of range.
    """
    check_whole("rows", rows, 1)
    check_whole("columns", columns, 1)
    if rows * columns > MAX_CAMERAS:
        raise InputError("rows × columns", f"at most {MAX_CAMERAS}", str(rows * columns))
    check_number("radius", radius, above=0)
    check_number("bottom", bottom)
    check_number("top", top)
    if top < bottom:
        raise InputError("top", f"at least bottom ({bottom:g} m)", f"{top:g} m")
    digits = max(2, len(str(columns - 1)))
    cameras = []
    for row in range(rows):
        share = row / (rows - 1) if rows > 1 else 0.5
        for column in range(columns):
            angle = 2 * math.pi * column / columns
            cameras.append(
                Camera(
                    name=f"cam_{row}_{column:0{digits}d}",
                    position=(
                        radius * math.cos(angle),
                        radius * math.sin(angle),
                        bottom + share * (top - bottom),
                    ),
                    orientation=_facing_axis(angle),
                    intrinsics=intrinsics or CameraIntrinsics(),
                    lens=lens or Lens(),
                )
            )
    return Rig(tuple(cameras), frame_id, Grid(rows, columns))


def _facing_axis(angle: float) -> tuple[float, float, float, float]:
    """Return the orientation with z towards the axis, x to the right, y down.

    At angle 0 the optical x, y, z axes are the world's +y, −z, −x: the quaternion
    (−½, −½, ½, ½). A rotation by ``angle`` about the world's z follows.
    """
    c, s = math.cos(angle / 2), math.sin(angle / 2)
    return ((-c + s) / 2, (-c - s) / 2, (c + s) / 2, (c - s) / 2)
