# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""From messages to the core's types: ``x_from_message``.

The inverse functions, ``x_to_fields``, are in :mod:`focus_planner.messages.writing`. A message with
bad values raises :class:`InputError` and no other exception, whatever it contains.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from enum import IntEnum
from typing import TYPE_CHECKING, Any

import numpy as np

from focus_planner.core.arrays import FloatArray
from focus_planner.core.rig.camera import Camera, CameraIntrinsics, check_camera_name
from focus_planner.core.rig.circles import assumed_circle
from focus_planner.core.rig.lens import Lens
from focus_planner.core.rig.lens_table import LensTable
from focus_planner.core.rig.optics import lens_of_aperture
from focus_planner.core.rig.rig import Grid, Rig
from focus_planner.core.surface.appearance import Colours
from focus_planner.core.surface.cleaning import clean_cloud, clean_mesh
from focus_planner.core.surface.surface import Mesh, PointCloud
from focus_planner.core.validation import InputError
from focus_planner.io.formats.colours import colours_of, columns_of_colour, unpacked_colours
from focus_planner.io.importance import IMPORTANCE, choose_importance
from focus_planner.io.lens_tables import LensTables
from focus_planner.messages.cdr import read_mesh
from focus_planner.messages.frames import HeardFrames, pose_of_message
from focus_planner.messages.limits import Limits
from focus_planner.messages.untold import circle_of, noted

if TYPE_CHECKING:
    from focus_planner.core.rig.frames import Similarity

#: A message as an object of any library, with the attributes that its definition names.
Message = Any
_NO_LIMITS = Limits()
NO_FRAMES = HeardFrames()
Position = tuple[float, float, float]
Orientation = tuple[float, float, float, float]


class Datatype(IntEnum):
    """Type of the numbers in a cloud's field; equal to the constants of ``PointField.msg``."""

    INT8 = 1
    UINT8 = 2
    INT16 = 3
    UINT16 = 4
    INT32 = 5
    UINT32 = 6
    FLOAT32 = 7
    FLOAT64 = 8


_FLOATS = {Datatype.FLOAT32: "f4", Datatype.FLOAT64: "f8"}
_NUMBERS = _FLOATS | {
    Datatype.INT8: "i1",
    Datatype.UINT8: "u1",
    Datatype.INT16: "i2",
    Datatype.UINT16: "u2",
    Datatype.INT32: "i4",
    Datatype.UINT32: "u4",
}
# The largest record that NumPy has.
_LARGEST_STEP = 2**31 - 1
#: Names of a cloud's fields.
POINT = ("x", "y", "z")
NORMAL = ("normal_x", "normal_y", "normal_z")
#: Those of colours in the bits of one number, 0xAARRGGBB.
PACKED = ("rgb", "rgba")


@dataclass(frozen=True)
class Optics:
    """The defaults of cameras that do not bring their own image, lens or lens table.

    Attributes
    ----------
    intrinsics : CameraIntrinsics
    lens : Lens
    tables : LensTables or None
    f_number : float
        The lens's, if nothing tells its circle of confusion, which is then assumed for each
        camera's image; else 0.
    unused_f_number : float
        One that was given but has no effect, as the hyperfocal distance is given too; else 0.
    """

    intrinsics: CameraIntrinsics = field(default_factory=CameraIntrinsics)
    lens: Lens = field(default_factory=Lens)
    tables: LensTables | None = None
    f_number: float = 0.0
    unused_f_number: float = 0.0

    @property
    def focal_length_told(self) -> bool:
        """Whether somebody set the focal length: who set it to its default is not known to have."""
        return self.lens.focal_length != Lens().focal_length

    def lens_for(self, intrinsics: CameraIntrinsics) -> Lens:
        """Return the lens of a camera with this image that does not bring its own."""
        if not self.f_number:
            return self.lens
        told = self.focal_length_told
        return lens_of_aperture(self.lens, self.f_number, None, intrinsics, focal_length_told=told)

    def complete(self, rig: Rig) -> Rig:
        """Return the rig with lens tables for the cameras that do not bring their own."""
        return rig if self.tables is None else self.tables.apply(rig)


def mesh_from_bytes(payload: bytes, limits: Limits = _NO_LIMITS) -> Mesh:
    """Return the mesh of a serialized ``shape_msgs/msg/Mesh``, cleaned by :func:`clean_mesh`.

    Raises
    ------
    InputError
        If these are not the bytes of a mesh, it exceeds the limits, or it is not valid.
    """
    triangles, vertices = read_mesh(payload)
    limits.check_mesh(len(triangles), len(vertices))
    return clean_mesh(vertices, triangles.astype(np.int64))


def cloud_from_message(
    message: Message,
    frame_id: str,
    limits: Limits = _NO_LIMITS,
    importance_field: str = IMPORTANCE,
    heard: HeardFrames = NO_FRAMES,
) -> PointCloud:
    """Return the points, with normals, importance and colours if the message has them.

    Colours are in a field ``rgb`` or ``rgba``, packed as PCL does, or in ``r``, ``g`` and ``b``;
    fields of these names that hold something else are not looked at.

    Points that are not finite are left out, whether or not the message claims to be dense: see
    :func:`clean_cloud`.

    Parameters
    ----------
    message : sensor_msgs/msg/PointCloud2
    frame_id : str
        The frame of the result.
    limits : Limits
    importance_field : str
        The field that holds the importance, of any numeric type. One named otherwise than
        ``importance`` must be there.
    heard : HeardFrames
        For a cloud in another frame.

    Raises
    ------
    InputError
        If the cloud is in a frame that nothing relates to that one, exceeds the limits, or is not
        valid.
    """
    pose = pose_of_message(message.header, frame_id, heard)
    limits.check_cloud(message.width * message.height)
    names = {field.name for field in message.fields}
    geometry = POINT + NORMAL if names.issuperset(NORMAL) else POINT
    others = [name for name in names if name not in POINT + NORMAL]
    importance, notes = choose_importance(
        "cloud", sorted(others), importance_field, "parameter importance_field"
    )
    values = _read_fields(message, geometry + ((importance,) if importance else ()))
    points, normals = values[:, :3], values[:, 3:6] if len(geometry) > 3 else None
    if pose is not None:
        points = pose.points(points)
        normals = None if normals is None else pose.directions(normals)
    return clean_cloud(
        points,
        normals,
        values[:, -1] if importance else None,
        notes,
        _read_colours(message, names),
    )


def pose_from_message(pose: Message) -> tuple[Position, Orientation]:
    """Return the position, and the orientation as x, y, z, w."""
    p, q = pose.position, pose.orientation
    return (p.x, p.y, p.z), (q.x, q.y, q.z, q.w)


def poses_from_message(
    message: Message, optics: Optics, frame_id: str, heard: HeardFrames = NO_FRAMES
) -> Rig:
    """Return a rig of cameras ``cam_000``, ``cam_001``, ..., one per pose."""
    pose_of_rig = pose_of_message(message.header, frame_id, heard)
    lens = optics.lens_for(optics.intrinsics)
    cameras = _moved(
        (
            Camera(f"cam_{i:03d}", *pose_from_message(pose), optics.intrinsics, lens)
            for i, pose in enumerate(message.poses)
        ),
        pose_of_rig,
    )
    lacking = [(True, True)] * len(cameras)
    circles = {}
    if optics.f_number:
        told = optics.focal_length_told
        circle = assumed_circle(optics.intrinsics, lens.focal_length, focal_length_told=told)
        circles = {camera.name: circle for camera in cameras}
    return optics.complete(noted(Rig(cameras, frame_id), optics, lacking, circles))


def lens_table_from_message(message: Message) -> LensTable | None:
    """Return the lens table; None if the message has none."""
    if not (message.unit or len(message.distances) or len(message.values)):
        return None
    return LensTable(message.unit, message.whole, message.distances, message.values, message.step)


def lens_from_message(
    message: Message,
    intrinsics: CameraIntrinsics | None = None,
    *,
    focal_length_told: bool = True,
) -> Lens:
    """Return the lens of a message that gives its focal length.

    Parameters
    ----------
    message : focus_planner_msgs/msg/Lens
    intrinsics : CameraIntrinsics, optional
        Of its camera; the default if they are not known.
    focal_length_told : bool
        Whether somebody gave the focal length.
    """
    with _named("lens."):
        table = lens_table_from_message(message.table)
    lens = Lens(
        focal_length=message.focal_length,
        hyperfocal_distance=message.hyperfocal_distance or Lens().hyperfocal_distance,
        min_focus=message.min_focus,
        max_focus=message.max_focus or math.inf,
        focus_distances=tuple(message.focus_distances) or None,
        focus_steps=message.focus_steps or None,
        table=table,
        hiatus=message.hiatus,
        circle_of_confusion=message.circle_of_confusion or None,
    )
    if message.hyperfocal_distance:
        return lens
    return lens_of_aperture(
        lens,
        message.f_number,
        lens.circle_of_confusion,
        intrinsics or CameraIntrinsics(),
        focal_length_told=focal_length_told,
    )


def intrinsics_from_message(message: Message) -> CameraIntrinsics:
    """Return the intrinsics of the raw image; R and P, which are for rectified images, are ignored.

    A region of interest of size 0 stands for the whole image, and a binning of 0 for none.
    """
    fx, _, cx, _, fy, cy, *_ = message.k.tolist()
    distortion, roi = tuple(message.d.tolist()), message.roi
    # Without coefficients, any name of a distortion model is accepted: some drivers make up theirs.
    distorted = any(distortion) or message.distortion_model == "equidistant"
    return CameraIntrinsics(
        *(message.width, message.height, fx, fy, cx, cy),
        distortion_model=message.distortion_model if distorted else "",
        distortion=distortion if distorted else (),
        binning=(message.binning_x or 1, message.binning_y or 1),
        region=(roi.x_offset, roi.y_offset, roi.width, roi.height)
        if roi.width or roi.height
        else None,
    )


def _own_image(message: Message) -> CameraIntrinsics | None:
    """Return the intrinsics of camera info; None if it is empty."""
    if message.width:
        return intrinsics_from_message(message)
    if any(message.d) or max(message.binning_x, message.binning_y) > 1 or message.roi.width:
        raise InputError(
            "camera_info.width",
            "the width of the image, with distortion, binning or a region of interest",
            "0",
            "fill in width, height and k too, or leave camera_info empty for the planner's image",
        )
    return None


def camera_from_message(message: Message, optics: Optics) -> Camera:
    """Return the camera, whose name has been checked, completed from ``optics``."""
    with _named(f"camera {message.name}: "):
        intrinsics = _own_image(message.camera_info) or optics.intrinsics
        if message.lens.focal_length:
            lens = lens_from_message(message.lens, intrinsics)
        else:
            lens = optics.lens_for(intrinsics)
    return Camera(message.name, *pose_from_message(message.pose), intrinsics, lens)


def _moved(cameras: Iterable[Camera], pose: Similarity | None) -> tuple[Camera, ...]:
    """Return the cameras of a rig that has this pose; None if it is in the planner's frame."""
    if pose is None:
        return tuple(cameras)
    return tuple(_placed(camera, pose) for camera in cameras)


def _placed(camera: Camera, pose: Similarity) -> Camera:
    from focus_planner.core.rig.frames import (  # noqa: PLC0415 - loads SciPy
        similarity_from_pose,
    )

    where = f"camera {camera.name}"
    at = pose @ similarity_from_pose(where, camera.position, camera.orientation)
    return replace(camera, position=at.position, orientation=at.orientation)


def rig_from_message(
    message: Message, optics: Optics, frame_id: str, heard: HeardFrames = NO_FRAMES
) -> Rig:
    """Return the rig, its cameras completed from ``optics``."""
    pose = pose_of_message(message.header, frame_id, heard)
    rows, columns = message.grid_rows, message.grid_columns
    names = [camera.name for camera in message.cameras]
    for name in names:
        check_camera_name(name, names)
    cameras = _moved((camera_from_message(camera, optics) for camera in message.cameras), pose)
    grid = Grid(rows, columns) if rows or columns else None
    lacking = [
        (not camera.camera_info.width, not camera.lens.focal_length) for camera in message.cameras
    ]
    circles = {
        camera.name: circle
        for camera, sent in zip(cameras, message.cameras, strict=True)
        if (circle := circle_of(camera, sent, optics)) is not None
    }
    return optics.complete(noted(Rig(cameras, frame_id, grid), optics, lacking, circles))


@contextmanager
def _named(prefix: str) -> Iterator[None]:
    """Prefix the argument that an error names."""
    try:
        yield
    except InputError as error:
        raise InputError(prefix + error.argument, error.expected, error.got, error.remedy) from None


def _read_fields(message: Message, names: tuple[str, ...]) -> FloatArray:
    """Return the (n, len(names)) values of these fields.

    Raises
    ------
    InputError
        If a field is missing or the sizes in the message contradict each other.
    """
    _check_sizes(message)
    if message.width * message.height == 0:
        return np.empty((0, len(names)))
    points = _points(message, _point_dtype(message, names))
    return np.stack([points[name].ravel().astype(np.float64) for name in names], axis=1)


def _points(message: Message, row: np.dtype[np.void]) -> Any:
    """Return (height, width) the points, of which a record is laid out so."""
    return np.ndarray(
        (message.height, message.width),
        row,
        message.data,
        strides=(message.row_step, message.point_step),
    )


def _read_colours(message: Message, names: set[str]) -> Colours | None:
    """Return the points' colours; None if there are none, or not in a form that is known."""
    packed = next((name for name in PACKED if name in names), None)
    columns = (packed,) if packed else columns_of_colour(dict.fromkeys(names))
    if columns is None or message.width * message.height == 0:
        return None
    try:
        row = _point_dtype(message, columns)
    except InputError:
        return None
    if packed and row[packed].itemsize != 4:
        return None
    values = _points(message, row)
    if packed:  # its bits are meant, whatever it is declared as
        kind = row[packed].str[0] + "u4"
        return unpacked_colours(values[packed].ravel().view(kind).astype(np.uint32))
    return colours_of(np.stack([values[name].ravel() for name in columns], axis=1))


def _check_sizes(message: Message) -> None:
    size = message.height * message.row_step
    if message.row_step < message.width * message.point_step or len(message.data) != size:
        raise InputError(
            "cloud",
            "height × row_step bytes of data in rows of at least width × point_step",
            f"{len(message.data)} bytes for {message.height} rows of {message.row_step},"
            f" {message.width} points of {message.point_step} each",
        )
    if message.point_step > _LARGEST_STEP:
        raise InputError(
            "cloud point_step", f"at most {_LARGEST_STEP} bytes", f"{message.point_step}"
        )


def _point_dtype(message: Message, names: tuple[str, ...]) -> np.dtype[np.void]:
    fields = {field.name: field for field in message.fields}
    order = ">" if message.is_bigendian else "<"
    formats = []
    for name in names:
        if name not in fields:
            raise InputError(
                "cloud fields", "x, y and z", ", ".join(fields) or "none", "they are the points"
            )
        field = fields[name]
        kinds = _FLOATS if name in POINT + NORMAL else _NUMBERS
        if field.datatype not in kinds or field.count > 1:
            raise InputError(
                f"cloud field {name}",
                "one FLOAT32 or FLOAT64" if kinds is _FLOATS else "one number",
                f"{field.count} of datatype {field.datatype}",
            )
        formats.append(np.dtype(order + kinds[field.datatype]))
        if field.offset + formats[-1].itemsize > message.point_step:
            raise InputError(
                f"cloud field {name}",
                f"a field that ends within point_step ({message.point_step} bytes)",
                f"offset {field.offset} and {formats[-1].itemsize} bytes",
            )
    return np.dtype(
        {
            "names": list(names),
            "formats": formats,
            "offsets": [fields[name].offset for name in names],
            "itemsize": message.point_step,
        }
    )
