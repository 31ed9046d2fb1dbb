# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The planner's parameters: what they mean, and their ranges."""

from __future__ import annotations

from typing import Any

from focus_planner.core.planning.field_spec import NO_LIMIT, SpecifiedField, specified_fields
from focus_planner.core.planning.request import MAX_SUBJECTS, PlanRequest
from focus_planner.core.problem.cost_model import CostModel
from focus_planner.core.rig.camera import CameraIntrinsics
from focus_planner.core.rig.lens import MAX_HIATUS, Lens
from focus_planner.core.rig.lens_table import MAX_FOCUS_STEPS
from focus_planner.io.importance import IMPORTANCE
from focus_planner.messages.requests import (
    request_message_fields,
    request_to_values,
)
from focus_planner.parameters.declaration import (
    FAR,
    MAX_INTEGER,
    Declaration,
    one_of,
)

_MAX_COUNT = 2**31 - 1

#: What happens to a goal that arrives while other requests are being planned or waiting.
OVERLAPS = ("queue", "preempt", "refuse")

#: When to plan without being asked.
REPLANS = ("never", "on_surface", "rate")

#: Who may read what is recorded.
ACCESSES = ("owner", "group", "all")

#: Stands for a lens that focuses at any distance: rclpy takes an empty list for a list of bytes.
ANY_DISTANCE = (0.0,)

_IMAGE, _LENS, _MODEL = CameraIntrinsics(), Lens(), CostModel()

_OVERRIDE = " Requests can override it."

_NEXT_CALL = " A change applies from the next request on."

_POSES = " Applies to cameras that do not bring their own." + _NEXT_CALL

_COST = " in the paper's Eq. 1"


def request_declarations(request_type: type[PlanRequest] = PlanRequest) -> tuple[Declaration, ...]:
    """Return the parameters that give requests their defaults, one for each field."""
    defaults = request_to_values(request_type())
    return tuple(
        _request_declaration(each, defaults[each.name]) for each in specified_fields(request_type)
    )


def _request_declaration(field: SpecifiedField, default: Any) -> Declaration:
    spec = field.spec
    if isinstance(default, bool):
        return Declaration(field.name, default, _description(field))
    numbers = [choice for choice in spec.choices if isinstance(choice, int)]
    low = min(numbers, default=spec.at_least or spec.above or 0)
    high = max(numbers, default=spec.at_most)
    if high is None:
        high = MAX_INTEGER if isinstance(default, int) else FAR
    return Declaration(field.name, default, _description(field), low=low, high=high)


def _description(field: SpecifiedField) -> str:
    spec = field.spec
    text = spec.help_with(lambda name: name)
    parts = [f"{text[0].upper()}{text[1:]}."]
    if spec.unit:
        parts.append(f"In {spec.unit}; {NO_LIMIT}." if spec.unlimited else f"In {spec.unit}.")
    elif spec.above is not None:
        parts.append(f"Must be above {spec.above:g}.")
    if isinstance(field.default, str):
        parts.append(one_of(map(str, spec.choices)))
    override = _OVERRIDE if field.name in request_message_fields() else ""
    return " ".join(parts) + override + _NEXT_CALL


DECLARATIONS = (
    Declaration(
        "frame_id",
        "world",
        "Frame of the plan. Messages in another frame are transformed into it by what was heard on"
        " /tf_static, and refused where nothing there relates the two; a mesh has no frame of its"
        " own and is taken to be in this one.",
        read_only=True,
    ),
    Declaration(
        "camera_frames",
        "",
        "Frames of the cameras, for a rig that is put together from /tf_static and CameraInfo:"
        " names, or patterns such as cam*_optical_frame, separated by spaces; '' for none. Each"
        " becomes a camera, which is called like its frame without _optical_frame, as soon as"
        " /tf_static relates it to frame_id and its CameraInfo was heard. CameraInfo gives the"
        " image, whatever image.* is set to; the lens comes from lens.* and lens_tables.",
        read_only=True,
        plans=False,
    ),
    Declaration(
        "camera_convention",
        "",
        "How camera_frames are oriented. optical: z forward, x right, y down. body: x forward, y"
        " left, z up. '': told by their names, as in REP 103; those that end in _optical_frame or"
        " _optical are optical, all others body frames.",
        read_only=True,
        plans=False,
    ),
    Declaration(
        "camera_info_topics",
        "",
        "Topics of the CameraInfo of camera_frames: names, or patterns such as /*/camera_info,"
        " separated by spaces; '' for all topics of that type. A message is that of the frame which"
        " its header names, or of another frame of the same camera (cam0_link for"
        " cam0_optical_frame). In /{camera}/camera_info, {camera} stands for a camera's name: then"
        " the topic tells, whatever the header says.",
        read_only=True,
        plans=False,
    ),
    *request_declarations(),
    Declaration(
        "importance_field",
        IMPORTANCE,
        "Field of a cloud that holds the importance of its points, which is used where a cloud has"
        " it. One named otherwise, such as weight, must be there. A change applies"
        " from the next cloud on.",
    ),
    Declaration(
        "subjects",
        1,
        "Number of the newest surfaces that are planned for together, each a subject of its own,"
        " alone in front of the rig; all count the same. Of fewer, those that were received."
        + _NEXT_CALL,
        low=1,
        high=MAX_SUBJECTS,
    ),
    Declaration(
        "warm_start",
        False,
        "Whether to start from the last plan and its prices: faster after small changes of the"
        " surface or of the camera poses, but the same request need not give the same plan."
        + _NEXT_CALL,
    ),
    Declaration(
        "min_change",
        0.0,
        "Of plans that start from the last one: a lens whose focus would change by at most this"
        " fraction of its depth of field, both in dioptres, stays where it is, and the plan is one"
        " with it there; 0 for every change. For plans by replan such a lens is not told again."
        + _NEXT_CALL,
        high=1,
    ),
    Declaration(
        "image.width", _IMAGE.width, "Image width, in pixels." + _POSES, low=1, high=_MAX_COUNT
    ),
    Declaration(
        "image.height", _IMAGE.height, "Image height, in pixels." + _POSES, low=1, high=_MAX_COUNT
    ),
    Declaration("image.fx", _IMAGE.fx, "Horizontal focal length, in pixels, above 0." + _POSES),
    Declaration("image.fy", _IMAGE.fy, "Vertical focal length, in pixels, above 0." + _POSES),
    Declaration(
        "image.cx",
        _IMAGE.cx,
        "Horizontal coordinate of the principal point, in pixels from the left." + _POSES,
        low=-FAR,
    ),
    Declaration(
        "image.cy",
        _IMAGE.cy,
        "Vertical coordinate of the principal point, in pixels from the top." + _POSES,
        low=-FAR,
    ),
    Declaration(
        "lens.focal_length", _LENS.focal_length, "Focal length, in metres, above 0." + _POSES
    ),
    Declaration(
        "lens.hyperfocal_distance",
        _LENS.hyperfocal_distance,
        "Hyperfocal distance, in metres; 0 to compute it from lens.f_number and"
        " lens.circle_of_confusion." + _POSES,
    ),
    Declaration(
        "lens.f_number",
        0.0,
        "F-number: focal length over aperture diameter. Used only if lens.hyperfocal_distance is 0."
        + _POSES,
    ),
    Declaration(
        "lens.circle_of_confusion",
        0.0,
        "Circle of confusion: the largest blur spot on the sensor that counts as sharp, in metres;"
        " 0 if unknown: with lens.f_number two pixels are then assumed, or the sensor's diagonal"
        " / 1500. Beside lens.hyperfocal_distance only previews and masks depend on it." + _POSES,
    ),
    Declaration(
        "lens.min_focus",
        _LENS.min_focus,
        "Nearest distance at which the lens can focus, in metres." + _POSES,
    ),
    Declaration(
        "lens.max_focus",
        0.0,
        "Farthest distance at which the lens can focus, in metres; 0 for no limit." + _POSES,
    ),
    Declaration(
        "lens.focus_distances",
        ANY_DISTANCE,
        "The only distances at which the lens can focus, in metres; [0.0] for a lens that focuses"
        " at any distance between its limits." + _POSES,
    ),
    Declaration(
        "lens.focus_steps",
        0,
        "Number of focus positions from lens.min_focus to lens.max_focus, equally spaced in"
        " dioptres; 0 for a lens without steps." + _POSES,
        high=MAX_FOCUS_STEPS,
    ),
    Declaration(
        "lens.hiatus",
        _LENS.hiatus,
        "How far the rear principal plane is behind the front one, in metres; negative if they are"
        " crossed, 0 for a thin lens. Used only for distances from the sensor." + _POSES,
        low=-1,
        high=MAX_HIATUS,
    ),
    Declaration(
        "lens_tables",
        "",
        "YAML file of lens tables by camera, which map focus distances to the values that lens"
        " drivers take; for cameras that bring no table of their own. '' for none. The file is read"
        " when this parameter is set; set it again to reread the file. While the node runs it can"
        " be set to what it was at the start, or to a file in one of the data_directories."
        + _NEXT_CALL,
    ),
    Declaration(
        "cost.projected_area_weight",
        _MODEL.projected_area_weight,
        f"w1, the weight of the projected area{_COST}." + _NEXT_CALL,
        high=1,
    ),
    Declaration(
        "cost.axis_deviation_weight",
        _MODEL.axis_deviation_weight,
        f"w2, the weight of the distance from the optical axis{_COST}." + _NEXT_CALL,
        high=1,
    ),
    Declaration(
        "cost.focus_weight",
        _MODEL.focus_weight,
        f"w3, the weight of being out of focus{_COST}. The three weights sum to at most 1."
        + _NEXT_CALL,
        high=1,
    ),
    Declaration(
        "cost.projected_area_scale",
        _MODEL.projected_area_scale,
        f"epsilon1, the scale of the projected area{_COST}, in 1/m^2." + _NEXT_CALL,
    ),
    Declaration(
        "cost.axis_deviation_limit",
        _MODEL.axis_deviation_limit,
        f"epsilon2, the distance from the optical axis at which its cost{_COST} is full, in metres,"
        " above 0." + _NEXT_CALL,
    ),
    Declaration(
        "max_points",
        5_000_000,
        "Greatest number of points that a cloud may have; a larger one is refused before it is"
        " read. 0 for no limit. A change applies to clouds received afterwards.",
        high=_MAX_COUNT,
    ),
    Declaration(
        "max_triangles",
        5_000_000,
        "Greatest number of triangles that a mesh may have; it may have three times as many"
        " vertices. A larger mesh is refused before it is read. 0 for no limit. A change applies to"
        " meshes received afterwards.",
        high=_MAX_COUNT,
    ),
    Declaration(
        "max_cameras",
        20_000,
        "Greatest number of cameras that a rig may have, each of which gets a topic; a larger one"
        " is refused before it is read. 0 for no limit. A change applies to rigs received"
        " afterwards.",
        high=_MAX_COUNT,
    ),
    Declaration(
        "max_problem_size",
        1_000_000_000,
        "Greatest number of samples, times that of shots and of cameras, of a request; a larger one"
        " is refused before it is planned. 0 for no limit." + _NEXT_CALL,
        high=MAX_INTEGER,
    ),
    Declaration(
        "max_memory",
        4_000_000_000,
        "Memory that planning may take, in bytes, beyond some 300 MB for its programs. A request"
        " that needs more is refused; so is a surface. 0 for no limit." + _NEXT_CALL,
        high=MAX_INTEGER,
    ),
    Declaration(
        "record_directory",
        "",
        "Folder in which every run is recorded, each in a folder of its own; '' to record none. It"
        " is created if it does not exist. While the node runs it can be set to what it was at the"
        " start, or to a folder in one of the data_directories." + _NEXT_CALL,
        plans=False,
    ),
    Declaration(
        "record_markers",
        False,
        "Whether recorded runs include markers and a quality cloud, which show the plan in 3D."
        + _NEXT_CALL,
        plans=False,
    ),
    Declaration(
        "record_max_runs",
        0,
        "Number of whole runs to keep in record_directory: the oldest are deleted, never the newest"
        " nor the one with the plan in force; 0 for no limit." + _NEXT_CALL,
        high=_MAX_COUNT,
        plans=False,
    ),
    Declaration(
        "record_max_bytes",
        0,
        "Total size of the whole runs to keep in record_directory, in bytes: the oldest are"
        " deleted, never the newest nor the one with the plan in force; 0 for no limit."
        + _NEXT_CALL,
        high=MAX_INTEGER,
        plans=False,
    ),
    Declaration(
        "record_replan_period",
        10.0,
        "Of plans by replan, time from one that is recorded to the next, in seconds, so that a"
        " stream of surfaces does not fill the disk; 0 to record all. After a restart the last"
        " recorded one is in force again." + _NEXT_CALL,
        plans=False,
    ),
    Declaration(
        "data_directories",
        "",
        "Folders, separated by colons, within which lens_tables and record_directory may be changed"
        " while the node runs, by anyone on the network; links count as where they lead. '' for"
        " none.",
        read_only=True,
        plans=False,
    ),
    Declaration(
        "record_access",
        ACCESSES[0],
        "Who may read recorded runs, which are scans of people's bodies, whatever the umask. owner:"
        " the user of this process (folders 0700, files 0600). group: also the group (0750, 0640)."
        " all: everyone on this machine (0755, 0644). It holds for record_directory too if that is"
        " created. " + one_of(ACCESSES) + _NEXT_CALL,
        plans=False,
    ),
    Declaration(
        "autostart",
        True,
        "Whether the node configures and activates itself when it starts; false leaves this to a"
        " lifecycle manager.",
        read_only=True,
        plans=False,
    ),
    Declaration(
        "overlap",
        OVERLAPS[0],
        "What happens to a goal of ~/plan that arrives while other requests are being planned or"
        " waiting. queue: it waits for its turn. preempt: the goals before it end with their best"
        " plan so far, which is returned but not published. refuse: it is rejected. Calls of"
        " ~/plan_focus always wait for their turn. " + one_of(OVERLAPS) + _NEXT_CALL,
        plans=False,
    ),
    Declaration(
        "replan",
        REPLANS[0],
        "Whether to plan without being asked, for each new surface, with the defaults of requests"
        " and from the last plan on, as with warm_start. never: only requests are planned."
        " on_surface: a surface is planned for as soon as it arrives; while a plan is being made"
        " the newest waits, and takes the place of older ones. rate: the same, at most replan_rate"
        " times a second. Requests come first. " + one_of(REPLANS) + " A change applies from the"
        " next surface on.",
        plans=False,
    ),
    Declaration(
        "replan_rate",
        10.0,
        "With replan rate: the most plans in a second, in hertz, by a steady clock, whatever"
        " use_sim_time says. A change applies from the next surface on.",
        low=0.001,
        high=1000.0,
        plans=False,
    ),
    Declaration(
        "service_max_wait",
        5.0,
        "Longest time that a call of ~/plan_focus waits for its turn, in seconds; then the answer"
        " is that the planner is busy. Callers take turns." + _NEXT_CALL,
        plans=False,
    ),
    Declaration(
        "max_waiting",
        100,
        "Greatest number of requests of one caller that may wait for their turn; its further calls"
        " are answered that the planner is busy, its further goals are rejected." + _NEXT_CALL,
        low=1,
        high=100_000,
        plans=False,
    ),
    Declaration(
        "max_planning_time",
        600.0,
        "Longest time that planning for a request may take, in seconds: it is then ended with its"
        " best plan so far, or without one if that takes another second. 0 for no limit."
        + _NEXT_CALL,
        plans=False,
    ),
    Declaration(
        "status_period",
        1.0,
        "Period of ~/status and of /diagnostics, in seconds; ~/status is also published on every"
        " change, at most ten times a second. A change applies at once.",
        low=0.1,
        high=3600.0,
        plans=False,
    ),
    Declaration(
        "lens_tolerance",
        0.1,
        "By how much what was read back of a lens may differ from the planned distance, in dioptres"
        " (1/m), if whoever publishes ~/lens_states says that the lens is there. States that differ"
        " by more are refused, with a warning in /diagnostics. A change applies at once.",
        high=1000.0,
        plans=False,
    ),
    Declaration(
        "max_input_age",
        0.0,
        "Age from which /diagnostics reports a surface or a rig as old, in seconds; it is used all"
        " the same. 0 for no limit. A change applies at once.",
        plans=False,
    ),
)
