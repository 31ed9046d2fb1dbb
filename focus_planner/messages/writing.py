# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""From the core's types to the fields of messages: ``x_to_fields``.

The inverse functions, ``x_from_message``, are in :mod:`focus_planner.messages.reading`. Fields go
by their names in the message's definition; one that is left out keeps its default. A nested message
is again a dict, and a sequence of messages a list, so that any library's classes can be filled.
"""

from __future__ import annotations

import math
from dataclasses import fields
from datetime import datetime, timedelta, timezone
from typing import Any

import numpy as np

from focus_planner.core.notes import Note
from focus_planner.core.planning.plan import CameraFocus, FocusPlan, Shot
from focus_planner.core.planning.subject_quality import SubjectQuality
from focus_planner.core.rig.camera import Camera, CameraIntrinsics
from focus_planner.core.rig.lens import Lens
from focus_planner.core.rig.lens_table import LensTable
from focus_planner.core.rig.rig import Rig
from focus_planner.core.surface.surface import Mesh, PointCloud
from focus_planner.io.formats.colours import packed_colours
from focus_planner.io.importance import IMPORTANCE
from focus_planner.messages.cdr import write_mesh
from focus_planner.messages.reading import NORMAL, PACKED, POINT, Datatype, Orientation, Position

Fields = dict[str, Any]

#: Seconds and nanoseconds since the epoch.
Stamp = tuple[int, int]

# Of a plan whose inputs came from no topic.
_NO_INPUTS: Fields = {"surface": {"age": math.nan}, "rig": {"age": math.nan}}

_EPOCH = datetime(1970, 1, 1, tzinfo=timezone.utc)


def mesh_to_bytes(mesh: Mesh, *, big_endian: bool = False) -> bytes:
    """Return the serialized ``shape_msgs/msg/Mesh``, which publishers accept in place of a message.

    The message has no place for vertex normals and vertex importance: they are left out.
    """
    return write_mesh(mesh.triangles, mesh.vertices, big_endian=big_endian)


def cloud_to_fields(cloud: PointCloud, frame_id: str) -> Fields:
    """Return the points as FLOAT64 fields, with normals and importance if the cloud has them.

    Colours follow as ``rgb``, packed as PCL and RViz have them.
    """
    names, parts = [*POINT], [cloud.points]
    if cloud.normals is not None:
        names += NORMAL
        parts.append(cloud.normals)
    if cloud.importance is not None:
        names.append(IMPORTANCE)
        parts.append(cloud.importance[:, None])
    columns = np.ascontiguousarray(np.hstack(parts), dtype="<f8")
    step = 8 * len(names)
    described = [
        {"name": name, "offset": 8 * i, "datatype": int(Datatype.FLOAT64), "count": 1}
        for i, name in enumerate(names)
    ]
    data = columns.tobytes()
    if cloud.colours is not None:
        described.append(
            {"name": PACKED[0], "offset": step, "datatype": int(Datatype.FLOAT32), "count": 1}
        )
        packed = packed_colours(cloud.colours).astype("<u4")[:, None]
        data = np.hstack([columns.view(np.uint8), packed.view(np.uint8)]).tobytes()
        step += packed.itemsize
    return {
        "header": {"frame_id": frame_id},
        "height": 1,
        "width": len(columns),
        "fields": described,
        "is_bigendian": False,
        "point_step": step,
        "row_step": step * len(columns),
        "data": data,
        "is_dense": True,
    }


def pose_to_fields(position: Position, orientation: Orientation) -> Fields:
    """Return the pose of a position and an orientation, given as x, y, z, w."""
    return {
        "position": dict(zip("xyz", position, strict=True)),
        "orientation": dict(zip("xyzw", orientation, strict=True)),
    }


def poses_to_fields(rig: Rig) -> Fields:
    """Return the poses of the cameras, without names, images, lenses and grid."""
    poses = [pose_to_fields(camera.position, camera.orientation) for camera in rig.cameras]
    return {"header": {"frame_id": rig.frame_id}, "poses": poses}


def lens_table_to_fields(table: LensTable | None) -> Fields:
    """Return the lens table; an empty one for None."""
    if table is None:
        return {"unit": "", "whole": False, "distances": (), "values": (), "step": 0.0}
    return {field.name: getattr(table, field.name) for field in fields(table)}


def lens_to_fields(lens: Lens) -> Fields:
    """Return the lens, specified by its hyperfocal distance."""
    return {
        "focal_length": lens.focal_length,
        "hyperfocal_distance": lens.hyperfocal_distance,
        "circle_of_confusion": lens.circle_of_confusion or 0.0,
        "min_focus": lens.min_focus,
        "max_focus": 0.0 if math.isinf(lens.max_focus) else lens.max_focus,
        "focus_distances": lens.focus_distances or (),
        "focus_steps": lens.focus_steps or 0,
        "table": lens_table_to_fields(lens.table),
        "hiatus": lens.hiatus,
    }


def intrinsics_to_fields(intrinsics: CameraIntrinsics) -> Fields:
    """Return camera info without R and P, which are for rectified images."""
    columns, rows = intrinsics.binning if intrinsics.binning != (1, 1) else (0, 0)
    region = intrinsics.region or (0, 0, 0, 0)
    return {
        "width": intrinsics.width,
        "height": intrinsics.height,
        "distortion_model": intrinsics.distortion_model,
        "d": list(intrinsics.distortion),
        "k": [intrinsics.fx, 0.0, intrinsics.cx, 0.0, intrinsics.fy, intrinsics.cy, 0.0, 0.0, 1.0],
        "binning_x": columns,
        "binning_y": rows,
        "roi": dict(zip(("x_offset", "y_offset", "width", "height"), region, strict=True)),
    }


def camera_to_fields(camera: Camera) -> Fields:
    """Return the camera in full."""
    return {
        "name": camera.name,
        "pose": pose_to_fields(camera.position, camera.orientation),
        "camera_info": intrinsics_to_fields(camera.intrinsics),
        "lens": lens_to_fields(camera.lens),
    }


def rig_to_fields(rig: Rig) -> Fields:
    """Return the rig in full."""
    return {
        "header": {"frame_id": rig.frame_id},
        "cameras": [camera_to_fields(camera) for camera in rig.cameras],
        "grid_rows": rig.grid.rows if rig.grid else 0,
        "grid_columns": rig.grid.columns if rig.grid else 0,
    }


def shot_to_fields(shot: Shot) -> Fields:
    """Return the shot; its device value goes into its camera's bracket."""
    fields = {name: value for name, value in vars(shot).items() if name != "device_value"}
    return fields | {"from_sensor": _or_nan(shot.from_sensor)}


def camera_focus_to_fields(focus: CameraFocus, frame_id: str, stamp: Stamp, plan_id: str) -> Fields:
    """Return the focus of one camera, as published for its lens driver."""
    device_bracket = [shot.device_value for shot in focus.shots if shot.device_value is not None]
    return {
        "header": header_fields(frame_id, stamp),
        "plan_id": plan_id,
        "name": focus.name,
        "status": int(focus.status),
        "focus_distance": focus.focus_distance,
        "dioptres": 1.0 / focus.focus_distance,
        "device_value": _or_nan(focus.device_value),
        "device_unit": focus.device_unit or "",
        "near_limit": focus.near_limit,
        "far_limit": focus.far_limit,
        "assigned_samples": focus.assigned_samples,
        "in_focus_samples": focus.in_focus_samples,
        "bracket": [shot.focus_distance for shot in focus.shots],
        "device_bracket": device_bracket,
        "shots": [shot_to_fields(shot) for shot in focus.shots],
        "from_sensor": _or_nan(focus.from_sensor),
    }


def plan_to_fields(
    plan: FocusPlan,
    frame_id: str,
    stamp: Stamp,
    plan_id: str,
    inputs: Fields | None = None,
) -> Fields:
    """Return the plan as it is published, and returned to callers.

    Parameters
    ----------
    plan : FocusPlan
    frame_id : str
        The rig's.
    stamp : tuple of int
        When the plan was made: seconds and nanoseconds since the epoch.
    plan_id : str
        Its name in logs and in recorded runs.
    inputs : dict, optional
        The inputs that it was made from, ``surface`` and ``rig``, as
        :func:`focus_planner.runtime.status.plan_input_to_fields` returns them, and ``subjects``,
        those of each of several; by default they are of no topic and no age.
    """
    told = plan.resolution
    return {
        "header": header_fields(frame_id, stamp),
        "plan_id": plan_id,
        **{name: (inputs or _NO_INPUTS)[name] for name in _NO_INPUTS},
        "method": plan.method,
        "cost": plan.cost,
        "lower_bound": _or_nan(plan.lower_bound),
        "converged": plan.converged,
        "samples": plan.samples,
        "seed": plan.seed,
        "shots": plan.shots,
        "views": plan.views,
        "images": plan.images,
        "depth_tolerance": plan.depth_tolerance,
        "max_mm_per_pixel": 0.0 if math.isinf(plan.max_mm_per_pixel) else plan.max_mm_per_pixel,
        "fresh_cost": plan.fresh_cost,
        "fresh_standard_error": plan.fresh_standard_error,
        "fresh_samples": plan.fresh_samples,
        "surface_area": plan.surface_area,
        "covered_area": plan.covered_area,
        "in_focus_area": plan.in_focus_area,
        "in_focus_standard_error": plan.in_focus_standard_error,
        "sharp_views": [each.views for each in plan.sharp_areas],
        "sharp_area": [each.area for each in plan.sharp_areas],
        "sharp_standard_error": [each.standard_error for each in plan.sharp_areas],
        "median_mm_per_pixel": told.median if told else math.nan,
        "percentile_90_mm_per_pixel": told.percentile_90 if told else math.nan,
        "solve_seconds": plan.solve_seconds,
        "total_seconds": plan.total_seconds,
        "notes": [note_to_fields(note) for note in plan.notes],
        "cameras": [
            camera_focus_to_fields(focus, frame_id, stamp, plan_id) for focus in plan.cameras
        ],
        "subjects": [
            subject_to_fields(subject, given)
            for subject, given in zip(plan.subjects, _inputs_of(plan, inputs), strict=True)
        ],
    }


def subject_to_fields(subject: SubjectQuality, given: Fields) -> Fields:
    """Return what a plan is worth for one of several subjects, and the input that it is."""
    return vars(subject) | {"input": given}


def _inputs_of(plan: FocusPlan, inputs: Fields | None) -> list[Fields]:
    """Return the input that each subject is; of no topic and no age if that is not told."""
    if not plan.subjects:
        return []
    told: list[Fields] = (inputs or {}).get("subjects", [])
    return told or [_NO_INPUTS["surface"]] * len(plan.subjects)


def note_to_fields(note: Note) -> Fields:
    """Return the note."""
    return dict(vars(note))


def datetime_stamp(at: datetime) -> Stamp:
    """Return the time in seconds and nanoseconds since the epoch."""
    seconds, rest = divmod(at - _EPOCH, timedelta(seconds=1))
    return seconds, rest // timedelta(microseconds=1) * 1000


def time_to_fields(stamp: Stamp) -> Fields:
    """Return the time message."""
    seconds, nanoseconds = stamp
    return {"sec": seconds, "nanosec": nanoseconds}


def header_fields(frame_id: str, stamp: Stamp) -> Fields:
    """Return the header message."""
    return {"frame_id": frame_id, "stamp": time_to_fields(stamp)}


def _or_nan(value: float | None) -> float:
    return math.nan if value is None else value
