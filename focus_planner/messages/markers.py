# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""3D markers of a plan: its cameras, where each is focused, and what it holds in focus there.

A marker holds the lines or triangles of all cameras, so that a rig of a thousand is a few markers,
and viewers stay fluent. Namespaces are what a viewer can show and hide:

- ``chosen_cameras``, ``other_cameras``: a small pyramid each; the others image no sample best.
- ``frusta``: of every chosen picture, from the centre of projection to the plane of focus.
- ``focal_planes``: of every plane of focus, the part where the camera images the surface best.
- ``depth_of_field``: the same part from the near to the far limit.
- ``names``: of cameras, with their distances, unless there are too many to read.

Chosen cameras are blue if all that they image best is in focus, orange if nothing is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from focus_planner.core.arrays import FloatArray, IntArray
from focus_planner.core.planning.plan import CameraFocus, CameraStatus, FocusPlan, Shot
from focus_planner.core.planning.sampled_quality import SampledQuality
from focus_planner.core.rig.geometry import camera_positions, camera_rotations, corner_directions
from focus_planner.core.rig.rig import Rig
from focus_planner.messages.cdr import CdrWriter
from focus_planner.messages.writing import Stamp
from focus_planner.palette import BLURRED, SHARP

#: A text is a marker of its own, and more of them nobody can read.
MAX_NAMES = 256
# A camera's pyramid, as a part of the distance that cameras are mostly focused at.
_PYRAMID = 0.14
# As parts of that pyramid's length.
_THICK_LINE, _THIN_LINE, _TEXT = 0.02, 0.007, 0.2
# A slab is drawn up to this many times as far as the camera is focused: its end may be infinite.
_FARTHEST = 2.0
_GREY = (0.55, 0.55, 0.58, 1.0)
_TEXT_COLOUR = (0.8, 0.8, 0.82, 1.0)
_FRUSTUM_ALPHA, _PLANE_ALPHA, _SLAB_ALPHA = 0.35, 0.35, 0.12
# Corners 0 to 3 are the image's, 4 is the camera.
_PYRAMID_EDGES = [[4, 0], [4, 1], [4, 2], [4, 3], [0, 1], [1, 2], [2, 3], [3, 0]]
_RECTANGLE = [[0, 1, 2], [0, 2, 3]]
# Corners 0 to 3 are near, 4 to 7 far.
_SLAB = [
    *_RECTANGLE,
    *([4, 6, 5], [4, 7, 6]),
    *([i, j, j + 4] for i, j in ((0, 1), (1, 2), (2, 3), (3, 0))),
    *([i, j + 4, i + 4] for i, j in ((0, 1), (1, 2), (2, 3), (3, 0))),
]


class _Kind(IntEnum):
    """Equal to the constants of ``Marker.msg``."""

    LINE_LIST = 5
    TEXT_VIEW_FACING = 9
    TRIANGLE_LIST = 11


_ADD, _DELETE_ALL = 0, 3

Colour = tuple[float, float, float, float]


@dataclass(frozen=True)
class _Marker:
    """What differs from marker to marker.

    Attributes
    ----------
    scale : float
        Width of lines or height of text, metres.
    points, colours : (n, 3) and (n, 4) arrays
        Ends of lines or corners of triangles, metres; red, green, blue and opacity.
    position : tuple of 3 floats
        Of a text.
    """

    namespace: str = ""
    number: int = 0
    kind: int = 0
    action: int = _ADD
    scale: float = 1.0
    colour: Colour = (1.0, 1.0, 1.0, 1.0)  # as opaque as each of its own colours
    points: FloatArray = field(default_factory=lambda: np.empty((0, 3)))
    colours: FloatArray = field(default_factory=lambda: np.empty((0, 4)))
    position: Sequence[float] = (0.0, 0.0, 0.0)
    text: str = ""


class _Pictures(NamedTuple):
    """P pictures of a plan.

    Attributes
    ----------
    taken : (P,) array of bool
        Whether the picture images any sample best; otherwise it need not be taken.
    camera : (P,) array
        Index into the rig's cameras.
    focus_distance, near_limit, far_limit : (P,) arrays
        Metres; far may be inf.
    share : (P,) array
        Of the samples that it images best, how many are in focus, 0 to 1.
    """

    taken: NDArray[np.bool_]
    camera: IntArray
    focus_distance: FloatArray
    near_limit: FloatArray
    far_limit: FloatArray
    share: FloatArray

    def where(self, chosen: NDArray[np.bool_]) -> _Pictures:
        """Return those of them that are chosen."""
        return _Pictures(
            self.taken[chosen],
            self.camera[chosen],
            self.focus_distance[chosen],
            self.near_limit[chosen],
            self.far_limit[chosen],
            self.share[chosen],
        )


class _Views(NamedTuple):
    """Where the C cameras are, and what they see.

    Attributes
    ----------
    positions : (C, 3) array
    rotations : (C, 3, 3) array
        Columns are a camera's axes.
    corners : (C, 4, 3) array
        Rays through the corners of images, of depth 1.
    """

    positions: FloatArray
    rotations: FloatArray
    corners: FloatArray

    def pyramids(self, camera: IntArray, depth: FloatArray) -> FloatArray:
        """Return (P, 5, 3) the corners of images at a depth, and the camera."""
        apex = self.positions[camera][:, None]
        return np.concatenate([apex + depth[:, None, None] * self.corners[camera], apex], axis=1)

    def at_depth(self, camera: IntArray, flat: FloatArray, depth: FloatArray) -> FloatArray:
        """Return (P, n, 3) points on rays, given as (P, n, 2) x, y at depth 1, at a depth."""
        rays = np.concatenate([flat, np.ones((*flat.shape[:2], 1))], axis=2)
        turned = rays @ self.rotations[camera].transpose(0, 2, 1)
        points: FloatArray = self.positions[camera][:, None] + depth[:, None, None] * turned
        return points

    def project(self, camera: IntArray, points: FloatArray) -> FloatArray:
        """Return (n, 2) x, y at depth 1 of points, each before its camera."""
        away = points - self.positions[camera]
        local = np.einsum("nij,ni->nj", self.rotations[camera], away)
        flat: FloatArray = local[:, :2] / local[:, 2:]
        return flat


def markers_to_bytes(plan: FocusPlan, rig: Rig, quality: SampledQuality, stamp: Stamp) -> bytes:
    """Return the serialized markers of a plan, which replace all that were there before.

    Parameters
    ----------
    plan : FocusPlan
    rig : Rig
        Its cameras are those of the plan, in the same order.
    quality : SampledQuality
        Of the plan.
    stamp : tuple of int
        Seconds and nanoseconds.
    """
    views = _Views(camera_positions(rig), camera_rotations(rig), corner_directions(rig))
    chosen = np.array([focus.status == CameraStatus.PLANNED for focus in plan.cameras])
    length = _PYRAMID * _usual_distance(plan, chosen)
    pictures = _pictures(plan)
    markers = [
        _Marker(action=_DELETE_ALL),
        *_cameras(plan, views, chosen, length),
        *_frusta(views, pictures, length),
        *_patches(views, pictures, quality),
        *_names(plan, views, length),
    ]
    writer = CdrWriter()
    writer.numbers("I", len(markers))
    for marker in markers:
        _write(writer, marker, rig.frame_id, stamp)
    return writer.payload()


def _usual_distance(plan: FocusPlan, chosen: NDArray[np.bool_]) -> float:
    distances = np.array([focus.focus_distance for focus in plan.cameras])
    return float(np.median(distances[chosen] if chosen.any() else distances))


def _pictures(plan: FocusPlan) -> _Pictures:
    """Return all pictures of the plan, in the order of ``SampledQuality.picture``."""
    # A shot that is not taken, which no sample is assigned to, is not drawn.
    cameras = [focus for focus in plan.cameras for _ in range(plan.shots)]
    shots = [
        Shot(camera.focus_distance, camera.near_limit, camera.far_limit, 0, 0)
        if shot is None
        else shot
        for shot, camera in zip(plan.slots, cameras, strict=True)
    ]
    assigned = np.array([shot.assigned_samples for shot in shots])
    in_focus = np.array([shot.in_focus_samples for shot in shots])
    return _Pictures(
        taken=assigned > 0,
        camera=np.repeat(np.arange(len(plan.cameras), dtype=np.int32), plan.shots),
        focus_distance=np.array([shot.focus_distance for shot in shots]),
        near_limit=np.array([shot.near_limit for shot in shots]),
        far_limit=np.array([shot.far_limit for shot in shots]),
        share=_share(in_focus, assigned),
    )


def _share(in_focus: NDArray[np.int_], assigned: NDArray[np.int_]) -> FloatArray:
    share: FloatArray = in_focus / np.maximum(assigned, 1)
    return share


def _cameras(
    plan: FocusPlan, views: _Views, chosen: NDArray[np.bool_], length: float
) -> list[_Marker]:
    every = np.arange(len(plan.cameras), dtype=np.int32)
    ends = views.pyramids(every, np.full(len(every), length))[:, _PYRAMID_EDGES]
    share = _share(
        np.array([focus.in_focus_samples for focus in plan.cameras]),
        np.array([focus.assigned_samples for focus in plan.cameras]),
    )
    width = _THICK_LINE * length
    return [
        *_lines("chosen_cameras", ends[chosen], width, colours=_colours(share[chosen], 1.0)),
        *_lines("other_cameras", ends[~chosen], width, colour=_GREY),
    ]


def _frusta(views: _Views, pictures: _Pictures, length: float) -> list[_Marker]:
    used = pictures.where(pictures.taken)
    ends = views.pyramids(used.camera, used.focus_distance)[:, _PYRAMID_EDGES]
    colours = _colours(used.share, _FRUSTUM_ALPHA)
    return _lines("frusta", ends, _THIN_LINE * length, colours=colours)


def _patches(views: _Views, pictures: _Pictures, quality: SampledQuality) -> list[_Marker]:
    """Return planes and slabs, cut to where a picture is the best one of some sample."""
    seen = quality.picture >= 0
    picture = quality.picture[seen]
    flat = views.project(pictures.camera[picture], quality.points[seen])
    low = np.full((len(pictures.camera), 2), np.inf)
    high = -low
    np.minimum.at(low, picture, flat)
    np.maximum.at(high, picture, flat)
    there = low[:, 0] <= high[:, 0]
    used, low, high = pictures.where(there), low[there], high[there]
    # A sample stands for the surface around it.
    margin = 0.5 * quality.spacing / used.focus_distance[:, None]
    low, high = low - margin, high + margin
    left, top, right, bottom = low[:, 0], low[:, 1], high[:, 0], high[:, 1]
    outline = np.stack([[left, top], [right, top], [right, bottom], [left, bottom]])
    corners = outline.transpose(2, 0, 1)
    far = np.minimum(used.far_limit, _FARTHEST * used.focus_distance)
    plane, front, back = (
        views.at_depth(used.camera, corners, depth)
        for depth in (used.focus_distance, used.near_limit, far)
    )
    slabs = np.concatenate([front, back], axis=1)[:, _SLAB]
    return [
        *_triangles("focal_planes", plane[:, _RECTANGLE], _colours(used.share, _PLANE_ALPHA)),
        *_triangles("depth_of_field", slabs, _colours(used.share, _SLAB_ALPHA)),
    ]


def _names(plan: FocusPlan, views: _Views, length: float) -> list[_Marker]:
    if len(plan.cameras) > MAX_NAMES:
        return []
    behind = views.positions - length * views.rotations[:, :, 2]
    return [
        _Marker(
            namespace="names",
            number=number,
            kind=_Kind.TEXT_VIEW_FACING,
            scale=_TEXT * length,
            colour=_TEXT_COLOUR,
            position=behind[number].tolist(),
            text=_name(focus),
        )
        for number, focus in enumerate(plan.cameras)
    ]


def _name(focus: CameraFocus) -> str:
    taken = [shot for shot in focus.shots if shot.assigned_samples]
    if not taken:
        return focus.name
    return f"{focus.name}\n{', '.join(f'{shot.focus_distance:.3f}' for shot in taken)} m"


def _colours(share: FloatArray, alpha: float) -> FloatArray:
    """Return (n, 4) colours from orange, of a share of 0, to blue, of 1."""
    sharp, blurred = (np.array(each) / 255.0 for each in (SHARP, BLURRED))
    mixed = share[:, None] * sharp + (1.0 - share[:, None]) * blurred
    return np.column_stack([mixed, np.full(len(share), alpha)])


def _lines(
    namespace: str,
    ends: FloatArray,
    width: float,
    *,
    colour: Colour = (1.0, 1.0, 1.0, 1.0),
    colours: FloatArray | None = None,
) -> list[_Marker]:
    """Return a marker of the lines of n cameras, each in a colour of its own, if there are any.

    Viewers object to markers without points.
    """
    if not len(ends):
        return []
    marker = _of_all(namespace, _Kind.LINE_LIST, ends, colours)
    return [replace(marker, scale=width, colour=colour)]


def _triangles(namespace: str, corners: FloatArray, colours: FloatArray) -> list[_Marker]:
    """Return a marker of the triangles of n cameras, if there are any."""
    return [_of_all(namespace, _Kind.TRIANGLE_LIST, corners, colours)] if len(corners) else []


def _of_all(namespace: str, kind: _Kind, points: FloatArray, colours: FloatArray | None) -> _Marker:
    of_each = points[0].size // 3
    many = np.empty((0, 4)) if colours is None else np.repeat(colours, of_each, axis=0)
    return _Marker(namespace, kind=kind, points=points.reshape(-1, 3), colours=many)


def _write(writer: CdrWriter, marker: _Marker, frame_id: str, stamp: Stamp) -> None:
    """Write a ``visualization_msgs/msg/Marker``, field by field."""
    writer.numbers("i", stamp[0])
    writer.numbers("I", stamp[1])
    writer.string(frame_id)
    writer.string(marker.namespace)
    writer.numbers("i", marker.number, marker.kind, marker.action)
    writer.numbers("d", *marker.position, 0.0, 0.0, 0.0, 1.0)
    writer.numbers("d", marker.scale, marker.scale, marker.scale)
    writer.numbers("f", *marker.colour)
    writer.numbers("I", 0, 0)  # lifetime: for ever
    writer.numbers("?", False)  # frame_locked
    writer.rows(marker.points, "f8")
    writer.rows(marker.colours, "f4")
    writer.string("")  # texture_resource
    writer.numbers("I", 0, 0)  # texture: its stamp,
    writer.string("")  # frame,
    writer.string("")  # format
    writer.numbers("I", 0)  # and data
    writer.numbers("I", 0)  # uv_coordinates
    writer.string(marker.text)
    writer.string("")  # mesh_resource
    writer.string("")  # mesh_file: its name
    writer.numbers("I", 0)  # and data
    writer.numbers("?", False)  # mesh_use_embedded_materials
