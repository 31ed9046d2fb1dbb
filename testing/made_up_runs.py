# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Runs of made-up messages of every type that runs contain, without any planning."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from focus_planner.core.notes import Note
from focus_planner.core.planning.fingerprint import Fingerprint
from focus_planner.core.planning.plan import CameraFocus, CameraStatus, FocusPlan, Shot, WarmStart
from focus_planner.core.planning.request import PlanRequest
from focus_planner.core.planning.stop_log import StopLog
from focus_planner.core.progress import Progress
from focus_planner.core.rig.camera import Camera, CameraIntrinsics
from focus_planner.core.rig.lens import Lens
from focus_planner.core.rig.rig import Rig
from focus_planner.core.surface.surface import Mesh, PointCloud
from focus_planner.messages.typestore import PLAN, POSES, fields_of, serialize
from focus_planner.messages.writing import poses_to_fields
from focus_planner.recording.bag import BagMessage, BagWriter
from focus_planner.recording.naming import PARTIAL
from focus_planner.recording.run import Beginning, Ending
from focus_planner.recording.run_inputs import rig_message, surface_messages
from focus_planner.recording.run_writing import (
    beginning_messages,
    beginning_of,
    ending_messages,
    plan_message,
    progress_message,
)

PLANNER = "/made/up"
AT = 1_700_000_000_123_456_000
MARKERS = "visualization_msgs/msg/MarkerArray"
_RIG = Rig(
    tuple(
        Camera(f"cam_{k}", (0.1 * k, -1.0, 1.5), (0.5, 0.5, -0.5, 0.5), CameraIntrinsics(), Lens())
        for k in range(3)
    ),
    "world",
)


def run_id(number=1):
    return f"20250102T030405.{number:06d}Z-0123abcd"


def input_messages(seed=1, points=60):
    """A mesh with vertex data, a cloud, poses and a rig."""
    random = np.random.default_rng(seed)
    vertices, normals = random.normal(size=(2, points, 3))
    triangles = (np.arange(points)[:, None] + [0, 1, 2]) % points
    mesh = Mesh(vertices, triangles, normals, random.random(points))
    cloud = PointCloud(vertices, normals, random.random(points))
    poses = serialize(POSES, poses_to_fields(_RIG))
    return [
        *surface_messages(PLANNER, mesh, "world", AT),
        *surface_messages(PLANNER, cloud, "world", AT + 1000),
        BagMessage(f"{PLANNER}/camera_poses", POSES, poses, AT),
        rig_message(PLANNER, _RIG, AT + 2000),
    ]


def beginning(number=1) -> Beginning:
    request = PlanRequest(seed=2**63 - 25, time_budget=1.5)
    software = {"python": "3.11.2", "processor": "Ünïcode® with\n2 lines"}
    warm_start = WarmStart(
        ("cam_0", "cam_1"), np.array([0.7, 0.8]), np.eye(3), np.array([0.1, 0.2, 1.0])
    )
    made = beginning_of(run_id(number), PLANNER, request, "world", software)
    return replace(made, warm_start=warm_start, at=AT + 10**6)


def progress_messages(number=1, count=5):
    steps = [Progress("k_view", k, 300.0 / (k + 1), 0.1 * k if k else None) for k in range(count)]
    begun = beginning(number)
    return [progress_message(begun, 0.25 * k, step) for k, step in enumerate(steps)]


def ending(seed=1) -> Ending:
    random = np.random.default_rng(seed)
    shot = Shot(0.75, 0.7, math.inf, 17, 12)
    cameras = tuple(
        CameraFocus(f"cam_{k}", CameraStatus.PLANNED, 0.75, 0.7, math.inf, 17, 12, (shot,))
        for k in range(3)
    )
    numbers = iter(random.random(9).tolist())
    plan = FocusPlan(
        method="k_view",
        cost=next(numbers),
        lower_bound=None,
        converged=True,
        samples=4096,
        seed=2**64 - 59,
        depth_tolerance=next(numbers),
        fresh_cost=next(numbers),
        fresh_standard_error=next(numbers),
        fresh_samples=2**32 - 1,
        surface_area=next(numbers),
        covered_area=next(numbers),
        in_focus_area=next(numbers),
        in_focus_standard_error=next(numbers),
        solve_seconds=next(numbers),
        total_seconds=0.5,
        notes=(Note("winding", "half of it"), Note("noise", "1 mm")),
        cameras=cameras,
    )
    prints = tuple(
        Fingerprint(stage, (7, 2**40), tuple(random.integers(2**63, size=2).tolist()))
        for stage in ("samples", "visibility")
    )
    log = StopLog.from_counts((3, 1, 2**32 - 1))
    return Ending(True, "a plan", plan, log, prints, (1_700_000_001, 5))


def plan_fields(number, names=("cam_0", "cam_1")):
    """A plan that can be put in force, and recognised by its cost."""
    shot = {"focus_distance": 0.75, "near_limit": 0.7, "far_limit": math.inf, "assigned_samples": 9}
    camera = shot | {"status": 1, "dioptres": 1 / 0.75, "bracket": [0.75], "shots": [shot]}
    return {
        "plan_id": run_id(number),
        "cost": float(number),
        "lower_bound": math.nan,
        "samples": 100,
        "cameras": [{"name": name} | camera for name in names],
    }


def plan_payload(number):
    """The same, serialized."""
    return serialize(PLAN, plan_fields(number))


def markers():
    header = {"frame_id": "world", "stamp": {"sec": 1, "nanosec": 2}}
    point = {"x": 1.0, "y": -2.0, "z": 0.5}
    colour = {"r": 0.25, "g": 0.5, "b": 0.75, "a": 1.0}
    marker = {"header": header, "ns": "surface", "type": 8, "points": [point], "colors": [colour]}
    payload = serialize(MARKERS, {"markers": [marker, marker | {"colors": []}]})
    return BagMessage(f"{PLANNER}/markers", MARKERS, payload, AT + 10**9)


def parts(number=1, seed=1):
    """The messages of a run, in the groups in which they are written."""
    begun = beginning(number)
    steps = progress_messages(number)
    return [
        input_messages(seed),
        beginning_messages(begun),
        steps[:3],
        steps[3:],
        [markers(), *ending_messages(begun, ending(seed), AT + 2 * 10**9)],
    ]


def messages(number=1, seed=1):
    return [message for part in parts(number, seed) for message in part]


def write(directory: Path, number=1, seed=1) -> Path:
    """Write a run as the recorder does: inputs in memory first, each part as a chunk."""
    bag = BagWriter()
    inputs, begun, *others = parts(number, seed)
    for message in inputs:
        bag.add(message)
    bag.flush()
    bag.open(directory / run_id(number))
    for message in begun:
        bag.add(message)
    bag.sync()
    for part in others:
        for message in part:
            bag.add(message)
        bag.flush()
    return bag.close()


def write_with_plan(directory, number, *, published=True, whole=True, planner=PLANNER, plan=True):
    """Write a run whose plan was kept, as the node does; partial if it was killed then."""
    begun = replace(beginning(number), planner=planner)
    bag = BagWriter()
    for message in input_messages(points=20):
        bag.add(message)
    bag.open(directory / run_id(number))
    for message in beginning_messages(begun):
        bag.add(message)
    if plan:
        bag.add(plan_message(begun, plan_payload(number), published=published))
    bag.flush()
    if not whole:
        bag.abandon()
        return directory / f"{run_id(number)}{PARTIAL}"
    for message in ending_messages(begun, replace(ending(), plan=None), AT):
        bag.add(message)
    return bag.close()


def without_definitions(bag_messages):
    """The messages' contents, without their definitions."""
    return [(m.topic, m.type_name, m.payload, m.at) for m in bag_messages]


def message_as_json(message):
    """A message of any library in JSON's types; NaN is None, inf is text."""
    if hasattr(message, "__msgtype__"):
        message = fields_of(message)
    if isinstance(message, dict):
        return {name: message_as_json(value) for name, value in message.items()}
    if isinstance(message, np.ndarray):
        return [message_as_json(item) for item in message.tolist()]
    if isinstance(message, (list, tuple, bytes)):
        return [message_as_json(item) for item in message]
    if isinstance(message, float) and not math.isfinite(message):
        return None if math.isnan(message) else str(message)
    return message


def record_ends(data: bytes) -> list[int]:
    """The offsets of the ends of a file's records, by their own lengths."""
    ends, at = [8], 8
    while at < len(data) - 8:
        at += 9 + int.from_bytes(data[at + 1 : at + 9], "little")
        ends.append(at)
    return ends


def chunk_ends(data: bytes) -> list[int]:
    """The offsets of the ends of its chunks."""
    ends = record_ends(data)
    return [end for start, end in pairwise(ends) if data[start] == 6]
