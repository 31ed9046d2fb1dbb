"""Messages to the core's types and back, in pairs ``x_from_ros`` and ``x_to_ros``.

What does not fit raises :class:`InputError`; nothing else does, whatever the message says.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, TypeVar

import numpy as np
from builtin_interfaces.msg import Time
from focus_planner_msgs.msg import CameraFocus as CameraFocusMsg
from focus_planner_msgs.msg import CameraRig as CameraRigMsg
from focus_planner_msgs.msg import FocusPlan as FocusPlanMsg
from focus_planner_msgs.msg import Lens as LensMsg
from focus_planner_msgs.msg import RigCamera as RigCameraMsg
from focus_planner_msgs.msg import Shot as ShotMsg
from focus_planner_msgs.srv import PlanFocus
from geometry_msgs.msg import Point, Pose, PoseArray, Quaternion
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import CameraInfo, PointCloud2, PointField
from std_msgs.msg import Header

from focus_planner.core.checks import InputError
from focus_planner.core.optics import hyperfocal_distance
from focus_planner.core.plans import CameraFocus, FocusPlan, PlanRequest, Shot
from focus_planner.core.types import (
    Camera,
    CameraStatus,
    FloatArray,
    Grid,
    Image,
    Lens,
    Mesh,
    PointCloud,
    Rig,
)
from focus_planner.io.importance import IMPORTANCE_NAMES, importance_column
from focus_planner.messages.cdr import read_mesh, write_mesh
from focus_planner.ros.inputs import Optics

_FLOATS = {PointField.FLOAT32: "f4", PointField.FLOAT64: "f8"}
_NUMBERS = _FLOATS | {
    PointField.INT8: "i1",
    PointField.UINT8: "u1",
    PointField.INT16: "i2",
    PointField.UINT16: "u2",
    PointField.INT32: "i4",
    PointField.UINT32: "u4",
}
_POINT = ("x", "y", "z")
_NORMAL = ("normal_x", "normal_y", "normal_z")

Message = TypeVar("Message")
Position = tuple[float, float, float]
Orientation = tuple[float, float, float, float]


def message_from_ros(payload: bytes, message_type: type[Message]) -> Message:
    """Return the message that these bytes serialize.

    Raises
    ------
    InputError
        If they do not.
    """
    try:
        message: Message = deserialize_message(payload, message_type)
    except (RuntimeError, ValueError, MemoryError) as error:
        raise InputError(
            f"{message_type.__name__} message", "its serialized form", f"other bytes ({error})"
        ) from None
    return message


def check_frame(header: Header, frame_id: str) -> None:
    """Raise unless a message is in the planner's frame.

    Raises
    ------
    InputError
        Names both frames.
    """
    if header.frame_id != frame_id:
        raise InputError(
            "header.frame_id",
            f"{frame_id!r} (parameter frame_id)",
            repr(header.frame_id),
            "transform the message into that frame first",
        )


def mesh_from_ros(payload: bytes) -> Mesh:
    """Return the mesh of a serialized ``shape_msgs/msg/Mesh``."""
    triangles, vertices = read_mesh(payload)
    return Mesh(vertices=vertices, triangles=triangles.astype(np.int64))


def mesh_to_ros(mesh: Mesh, *, big_endian: bool = False) -> bytes:
    """Return the serialized ``shape_msgs/msg/Mesh``, which a publisher takes as it is.

    It has no place for the normals and the importance of vertices: they are left out.
    """
    return write_mesh(mesh.triangles, mesh.vertices, big_endian=big_endian)


def cloud_from_ros(message: PointCloud2, frame_id: str) -> PointCloud:
    """Return the points, with their normals and their importance if there are any.

    The importance is the field ``importance``, or else ``weight``, of any type of number. Points
    of which a coordinate is not finite are left out if the message says that it is not dense.
    """
    check_frame(message.header, frame_id)
    names = {field.name for field in message.fields}
    geometry = _POINT + _NORMAL if names.issuperset(_NORMAL) else _POINT
    importance = importance_column(names)
    values = _read_fields(message, geometry + ((importance,) if importance else ()))
    if not message.is_dense:
        values = values[np.isfinite(values[:, : len(geometry)]).all(axis=1)]
    return PointCloud(
        values[:, :3],
        values[:, 3:6] if len(geometry) > 3 else None,
        values[:, -1] if importance else None,
    )


def cloud_to_ros(cloud: PointCloud, frame_id: str) -> PointCloud2:
    """Return the points as FLOAT64 fields, with normals and importance if the cloud has them."""
    names, parts = [*_POINT], [cloud.points]
    if cloud.normals is not None:
        names += _NORMAL
        parts.append(cloud.normals)
    if cloud.importance is not None:
        names.append(IMPORTANCE_NAMES[0])
        parts.append(cloud.importance[:, None])
    columns = np.hstack(parts)
    step = 8 * len(names)
    return PointCloud2(
        header=Header(frame_id=frame_id),
        height=1,
        width=len(columns),
        fields=[
            PointField(name=name, offset=8 * i, datatype=PointField.FLOAT64, count=1)
            for i, name in enumerate(names)
        ],
        is_bigendian=False,
        point_step=step,
        row_step=step * len(columns),
        data=np.ascontiguousarray(columns, dtype="<f8").tobytes(),
        is_dense=True,
    )


def pose_from_ros(pose: Pose) -> tuple[Position, Orientation]:
    """Return position and orientation x, y, z, w."""
    p, q = pose.position, pose.orientation
    return (p.x, p.y, p.z), (q.x, q.y, q.z, q.w)


def pose_to_ros(position: Position, orientation: Orientation) -> Pose:
    """Return the pose of a position and an orientation x, y, z, w."""
    x, y, z, w = orientation
    return Pose(
        position=Point(x=position[0], y=position[1], z=position[2]),
        orientation=Quaternion(x=x, y=y, z=z, w=w),
    )


def poses_from_ros(message: PoseArray, optics: Optics, frame_id: str) -> Rig:
    """Return a rig of cameras ``cam_000``, ``cam_001``, ..., one per pose."""
    check_frame(message.header, frame_id)
    cameras = (
        Camera(f"cam_{i:03d}", *pose_from_ros(pose), optics.image, optics.lens)
        for i, pose in enumerate(message.poses)
    )
    return Rig(tuple(cameras), frame_id)


def poses_to_ros(rig: Rig) -> PoseArray:
    """Return the poses of a rig's cameras; names, images, lenses and grid are left out."""
    poses = [pose_to_ros(camera.position, camera.orientation) for camera in rig.cameras]
    return PoseArray(header=Header(frame_id=rig.frame_id), poses=poses)


def lens_from_ros(message: LensMsg) -> Lens:
    """Return the lens; its focal length must be given."""
    return Lens(
        focal_length=message.focal_length,
        hyperfocal_distance=message.hyperfocal_distance
        or hyperfocal_distance(message.focal_length, message.f_number, message.circle_of_confusion),
        min_focus=message.min_focus,
        max_focus=message.max_focus or math.inf,
        focus_distances=tuple(message.focus_distances) or None,
        focus_steps=message.focus_steps or None,
    )


def lens_to_ros(lens: Lens) -> LensMsg:
    """Return the lens by its hyperfocal distance."""
    return LensMsg(
        focal_length=lens.focal_length,
        hyperfocal_distance=lens.hyperfocal_distance,
        min_focus=lens.min_focus,
        max_focus=0.0 if math.isinf(lens.max_focus) else lens.max_focus,
        focus_distances=lens.focus_distances or (),
        focus_steps=lens.focus_steps or 0,
    )


def image_from_ros(message: CameraInfo) -> Image:
    """Return size and intrinsics (K); distortion, binning and region of interest are not read."""
    fx, _, cx, _, fy, cy, *_ = message.k.tolist()
    return Image(message.width, message.height, fx, fy, cx, cy)


def image_to_ros(image: Image) -> CameraInfo:
    """Return an undistorted image's camera info."""
    k = [image.fx, 0.0, image.cx, 0.0, image.fy, image.cy, 0.0, 0.0, 1.0]
    return CameraInfo(width=image.width, height=image.height, k=k)


def camera_from_ros(message: RigCameraMsg, optics: Optics) -> Camera:
    """Return the camera; what it leaves out is taken from ``optics``."""
    camera = Camera(message.name, *pose_from_ros(message.pose))
    with _named(f"camera {camera.name}: "):
        image = image_from_ros(message.camera_info) if message.camera_info.width else optics.image
        lens = lens_from_ros(message.lens) if message.lens.focal_length else optics.lens
    return Camera(camera.name, camera.position, camera.orientation, image, lens)


def camera_to_ros(camera: Camera) -> RigCameraMsg:
    """Return the camera with all it has."""
    return RigCameraMsg(
        name=camera.name,
        pose=pose_to_ros(camera.position, camera.orientation),
        camera_info=image_to_ros(camera.image),
        lens=lens_to_ros(camera.lens),
    )


def rig_from_ros(message: CameraRigMsg, optics: Optics, frame_id: str) -> Rig:
    """Return the rig; what its cameras leave out is taken from ``optics``."""
    check_frame(message.header, frame_id)
    rows, columns = message.grid_rows, message.grid_columns
    cameras = tuple(camera_from_ros(camera, optics) for camera in message.cameras)
    return Rig(cameras, frame_id, Grid(rows, columns) if rows or columns else None)


def rig_to_ros(rig: Rig) -> CameraRigMsg:
    """Return the rig with all its cameras have."""
    return CameraRigMsg(
        header=Header(frame_id=rig.frame_id),
        cameras=[camera_to_ros(camera) for camera in rig.cameras],
        grid_rows=rig.grid.rows if rig.grid else 0,
        grid_columns=rig.grid.columns if rig.grid else 0,
    )


def distorted_cameras(message: CameraRigMsg) -> list[str]:
    """Return the names of the cameras that bring distortion, which is not modelled."""
    return [camera.name for camera in message.cameras if any(camera.camera_info.d)]


def request_from_ros(message: PlanFocus.Request, defaults: PlanRequest) -> PlanRequest:
    """Return the request; what it leaves out (0 or "") is taken from ``defaults``."""
    return PlanRequest(
        method=message.method or defaults.method,
        samples=message.samples or defaults.samples,
        seed=message.seed or defaults.seed,
        k=message.k or defaults.k,
        scope=message.scope or defaults.scope,
        tuples=defaults.tuples,
        time_budget=message.time_budget or defaults.time_budget,
        shots=message.shots or defaults.shots,
        depth_tolerance=message.depth_tolerance or defaults.depth_tolerance,
        fresh_samples=defaults.fresh_samples,
        standard_error=defaults.standard_error,
        bound=message.bound or defaults.bound,
        gap=message.gap or defaults.gap,
    )


def request_to_ros(request: PlanRequest) -> PlanFocus.Request:
    """Return the request; an unlimited time is left out.

    So are ``tuples``, ``fresh_samples`` and ``standard_error``, which only parameters set.
    """
    budget = request.time_budget
    return PlanFocus.Request(
        method=request.method,
        samples=request.samples,
        seed=request.seed,
        k=request.k,
        scope=request.scope,
        time_budget=0.0 if math.isinf(budget) else budget,
        shots=request.shots,
        depth_tolerance=request.depth_tolerance,
        bound=request.bound,
        gap=request.gap,
    )


def shot_from_ros(message: ShotMsg) -> Shot:
    """Return what a message says of one shot."""
    return Shot(
        focus_distance=message.focus_distance,
        near_limit=message.near_limit,
        far_limit=message.far_limit,
        assigned_samples=message.assigned_samples,
        in_focus_samples=message.in_focus_samples,
    )


def shot_to_ros(shot: Shot) -> ShotMsg:
    """Return what a plan says of one shot."""
    return ShotMsg(**vars(shot))


def camera_focus_from_ros(message: CameraFocusMsg) -> CameraFocus:
    """Return what a message says of one camera."""
    return CameraFocus(
        name=message.name,
        status=CameraStatus(message.status),
        focus_distance=message.focus_distance,
        near_limit=message.near_limit,
        far_limit=message.far_limit,
        assigned_samples=message.assigned_samples,
        in_focus_samples=message.in_focus_samples,
        shots=tuple(shot_from_ros(shot) for shot in message.shots),
    )


def camera_focus_to_ros(focus: CameraFocus, header: Header) -> CameraFocusMsg:
    """Return the message that a lens driver obeys."""
    return CameraFocusMsg(
        header=header,
        name=focus.name,
        status=int(focus.status),
        focus_distance=focus.focus_distance,
        dioptres=1.0 / focus.focus_distance,
        near_limit=focus.near_limit,
        far_limit=focus.far_limit,
        assigned_samples=focus.assigned_samples,
        in_focus_samples=focus.in_focus_samples,
        bracket=[shot.focus_distance for shot in focus.shots],
        shots=[shot_to_ros(shot) for shot in focus.shots],
    )


def plan_from_ros(message: FocusPlanMsg) -> FocusPlan:
    """Return the plan; a message does not hold the problem that was solved."""
    return FocusPlan(
        method=message.method,
        cost=message.cost,
        lower_bound=None if math.isnan(message.lower_bound) else message.lower_bound,
        converged=message.converged,
        samples=message.samples,
        seed=message.seed,
        depth_tolerance=message.depth_tolerance,
        fresh_cost=message.fresh_cost,
        fresh_standard_error=message.fresh_standard_error,
        fresh_samples=message.fresh_samples,
        surface_area=message.surface_area,
        covered_area=message.covered_area,
        in_focus_area=message.in_focus_area,
        in_focus_standard_error=message.in_focus_standard_error,
        solve_seconds=message.solve_seconds,
        total_seconds=message.total_seconds,
        cameras=tuple(camera_focus_from_ros(focus) for focus in message.cameras),
    )


def plan_to_ros(plan: FocusPlan, frame_id: str, stamp: Time, plan_id: str) -> FocusPlanMsg:
    """Return the plan as it is published and answered."""
    header = Header(frame_id=frame_id, stamp=stamp)
    return FocusPlanMsg(
        header=header,
        plan_id=plan_id,
        method=plan.method,
        cost=plan.cost,
        lower_bound=math.nan if plan.lower_bound is None else plan.lower_bound,
        converged=plan.converged,
        samples=plan.samples,
        seed=plan.seed,
        shots=plan.shots,
        depth_tolerance=plan.depth_tolerance,
        fresh_cost=plan.fresh_cost,
        fresh_standard_error=plan.fresh_standard_error,
        fresh_samples=plan.fresh_samples,
        surface_area=plan.surface_area,
        covered_area=plan.covered_area,
        in_focus_area=plan.in_focus_area,
        in_focus_standard_error=plan.in_focus_standard_error,
        solve_seconds=plan.solve_seconds,
        total_seconds=plan.total_seconds,
        cameras=[camera_focus_to_ros(focus, header) for focus in plan.cameras],
    )


@contextmanager
def _named(prefix: str) -> Iterator[None]:
    """Put ``prefix`` before the argument that an error names."""
    try:
        yield
    except InputError as error:
        raise InputError(prefix + error.argument, error.expected, error.got, error.remedy) from None


def _read_fields(message: PointCloud2, names: tuple[str, ...]) -> FloatArray:
    """Return the (n, len(names)) values of these fields.

    Raises
    ------
    InputError
        If a field is missing or the message's sizes contradict each other.
    """
    row = _point_dtype(message, names)
    size = message.height * message.row_step
    if message.row_step < message.width * message.point_step or len(message.data) != size:
        raise InputError(
            "cloud",
            "height × row_step bytes of data in rows of at least width × point_step",
            f"{len(message.data)} bytes for {message.height} rows of {message.row_step},"
            f" {message.width} points of {message.point_step} each",
        )
    if size == 0:
        return np.empty((0, len(names)))
    points: Any = np.ndarray(
        (message.height, message.width),
        row,
        message.data,
        strides=(message.row_step, message.point_step),
    )
    return np.stack([points[name].ravel().astype(np.float64) for name in names], axis=1)


def _point_dtype(message: PointCloud2, names: tuple[str, ...]) -> np.dtype[np.void]:
    fields = {field.name: field for field in message.fields}
    order = ">" if message.is_bigendian else "<"
    formats = []
    for name in names:
        if name not in fields:
            raise InputError(
                "cloud fields", "x, y and z", ", ".join(fields) or "none", "they are the points"
            )
        field = fields[name]
        kinds = _NUMBERS if name in IMPORTANCE_NAMES else _FLOATS
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
                f"an end within point_step ({message.point_step} bytes)",
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
