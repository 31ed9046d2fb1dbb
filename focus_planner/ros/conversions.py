"""The core's types as ROS messages: the opposites of :mod:`focus_planner.messages.reading`."""

from __future__ import annotations

import math
from typing import TypeVar

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
from focus_planner.core.plans import CameraFocus, FocusPlan, PlanRequest, Shot
from focus_planner.core.types import Camera, Image, Lens, Mesh, PointCloud, Rig
from focus_planner.io.importance import IMPORTANCE_NAMES
from focus_planner.messages.cdr import write_mesh
from focus_planner.messages.reading import NORMAL, POINT, Orientation, Position

Message = TypeVar("Message")


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


def mesh_to_ros(mesh: Mesh, *, big_endian: bool = False) -> bytes:
    """Return the serialized ``shape_msgs/msg/Mesh``, which a publisher takes as it is.

    It has no place for the normals and the importance of vertices: they are left out.
    """
    return write_mesh(mesh.triangles, mesh.vertices, big_endian=big_endian)


def cloud_to_ros(cloud: PointCloud, frame_id: str) -> PointCloud2:
    """Return the points as FLOAT64 fields, with normals and importance if the cloud has them."""
    names, parts = [*POINT], [cloud.points]
    if cloud.normals is not None:
        names += NORMAL
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


def pose_to_ros(position: Position, orientation: Orientation) -> Pose:
    """Return the pose of a position and an orientation x, y, z, w."""
    x, y, z, w = orientation
    return Pose(
        position=Point(x=position[0], y=position[1], z=position[2]),
        orientation=Quaternion(x=x, y=y, z=z, w=w),
    )


def poses_to_ros(rig: Rig) -> PoseArray:
    """Return the poses of a rig's cameras; names, images, lenses and grid are left out."""
    poses = [pose_to_ros(camera.position, camera.orientation) for camera in rig.cameras]
    return PoseArray(header=Header(frame_id=rig.frame_id), poses=poses)


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


def image_to_ros(image: Image) -> CameraInfo:
    """Return an undistorted image's camera info."""
    k = [image.fx, 0.0, image.cx, 0.0, image.fy, image.cy, 0.0, 0.0, 1.0]
    return CameraInfo(width=image.width, height=image.height, k=k)


def camera_to_ros(camera: Camera) -> RigCameraMsg:
    """Return the camera with all it has."""
    return RigCameraMsg(
        name=camera.name,
        pose=pose_to_ros(camera.position, camera.orientation),
        camera_info=image_to_ros(camera.image),
        lens=lens_to_ros(camera.lens),
    )


def rig_to_ros(rig: Rig) -> CameraRigMsg:
    """Return the rig with all its cameras have."""
    return CameraRigMsg(
        header=Header(frame_id=rig.frame_id),
        cameras=[camera_to_ros(camera) for camera in rig.cameras],
        grid_rows=rig.grid.rows if rig.grid else 0,
        grid_columns=rig.grid.columns if rig.grid else 0,
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


def shot_to_ros(shot: Shot) -> ShotMsg:
    """Return what a plan says of one shot."""
    return ShotMsg(**vars(shot))


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
