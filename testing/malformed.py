# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Malformed messages: absurd ones of the right type, and bytes of no type at all.

All of it is drawn from a generator that the caller seeds. Some of it happens to be a good message.
"""

from __future__ import annotations

import math
import struct
from copy import deepcopy
from dataclasses import replace
from datetime import datetime, timezone
from functools import partial

import numpy as np

from focus_planner.core.rig.camera import CameraIntrinsics
from focus_planner.core.rig.layouts import cylinder_rig
from focus_planner.core.rig.lens import Lens
from focus_planner.core.rig.lens_table import LensTable
from focus_planner.core.surface.surface import Mesh, PointCloud
from focus_planner.messages.cdr import write_mesh
from focus_planner.messages.reading import (
    cloud_from_message,
    mesh_from_bytes,
    poses_from_message,
    rig_from_message,
)
from focus_planner.messages.typestore import deserialize, serialize
from focus_planner.messages.writing import cloud_to_fields, poses_to_fields, rig_to_fields
from focus_planner.parameters.planner_settings import Settings
from focus_planner.runtime.inputs import Arrival
from focus_planner.runtime.planner import NotReady, Planner
from testing.messages import Log

#: By the input's topic; the types of what is sent there.
TYPES = {
    "mesh": "shape_msgs/msg/Mesh",
    "cloud": "sensor_msgs/msg/PointCloud2",
    "camera_poses": "geometry_msgs/msg/PoseArray",
    "rig": "focus_planner_msgs/msg/CameraRig",
    "lens_states": "focus_planner_msgs/msg/LensState",
}

#: The type of an order to a lens, which no planner subscribes to.
_ORDER = {"focus": "focus_planner_msgs/msg/CameraFocus"}


def mixed_rig():
    """Cameras of all kinds in turn: plain, distorted with a region, with steps, with a table."""
    steps = LensTable("steps", whole=True, distances=(0.3, 1.0, math.inf), values=(9.0, 60.0, 90.0))
    intrinsics = CameraIntrinsics(
        distortion_model="plumb_bob", distortion=(-0.1, 0.02, 0.001, -0.001, 0.0), binning=(2, 2)
    )
    changes = (
        {},
        {"intrinsics": replace(intrinsics, region=(8, 4, 500, 800))},
        {"lens": Lens(focus_distances=(0.5, 0.7, 0.9))},
        {"lens": Lens(min_focus=0.3, focus_steps=200)},
        {"lens": Lens(table=LensTable("dioptres"))},
        {"lens": Lens(table=steps)},
    )
    rig = cylinder_rig(rows=2, columns=6, radius=1.0, bottom=-0.1, top=0.1)
    return replace(
        rig, cameras=tuple(replace(c, **changes[i % 6]) for i, c in enumerate(rig.cameras))
    )


RIG = mixed_rig()


def ball(rings=10, radius=0.3):
    """A closed surface of few triangles, around the origin."""
    polar = np.linspace(0, np.pi, rings)[1:-1]
    around = np.arange(rings) * 2 * np.pi / rings
    sines = np.outer(np.sin(polar), np.ones(rings))
    middle = np.stack([sines * np.cos(around), sines * np.sin(around)], axis=-1)
    heights = np.repeat(np.cos(polar)[:, None, None], rings, axis=1)
    points = np.concatenate([[[0.0, 0.0, 1.0]], np.dstack([middle, heights]).reshape(-1, 3)])
    points = np.concatenate([points, [[0.0, 0.0, -1.0]]])
    at = 1 + np.arange(len(polar))[:, None] * rings + np.arange(rings)
    beside = np.roll(at, -1, axis=1)
    ends = [np.stack([0 * at[0], at[0], beside[0]], 1)]
    ends += [np.stack([0 * at[0] + len(points) - 1, beside[-1], at[-1]], 1)]
    upper = np.stack([at[:-1], at[1:], beside[1:]], -1).reshape(-1, 3)
    lower = np.stack([at[:-1], beside[1:], beside[:-1]], -1).reshape(-1, 3)
    return Mesh(radius * points, np.concatenate([*ends, upper, lower]))


BALL = ball()
CLOUD = PointCloud(BALL.vertices, BALL.vertices, np.linspace(0.5, 1.0, len(BALL.vertices)))
_FIELDS = {
    "cloud": cloud_to_fields(CLOUD, "world"),
    "camera_poses": poses_to_fields(RIG),
    "rig": rig_to_fields(RIG),
    "lens_states": {
        "name": "cam_0_00",
        "plan_id": "20261124T090332.683911Z-b0a0a366",
        "status": 2,
        "planned_distance": 0.7,
        "unit": "dioptres",
        "sent_value": 1.4,
        "read_value": 1.4,
        "read_distance": 0.7,
        "message": "",
    },
    "focus": {
        "name": "cam_0_00",
        "plan_id": "20261124T090332.683911Z-b0a0a366",
        "status": 1,
        "focus_distance": 0.5,
        "dioptres": 2.0,
        "device_value": 100.0,
        "device_unit": "steps",
        "near_limit": 0.4,
        "far_limit": 0.6,
        "bracket": [0.5],
        "device_bracket": [100.0],
    },
}
_FLOATS = (np.nan, np.inf, -np.inf, 1e308, -1e308, 5e-324, -1.0, 0.0, 1e9, 1e-9)
_WHOLES = (0, 1, 2, 3, 7, 8, 255, 65_536, 2**31 - 1, 2**31, 2**32 - 1, 2**63, 2**64 - 1, -1)
_TEXTS = (
    "",
    "/",
    "base",
    "../../etc/passwd",
    "a b",
    "0",
    "%s%n{}{0}",
    "\x1b[31mred\r\n[ERROR] forged",
    "é😀\u202e",
    "a\0b",
    "x",
    "weight",
    "x" * 101,
    "y" * 100_000,
)


def good(topic, **changes):
    """Return a serialized valid message with some fields changed."""
    if topic == "mesh":
        return write_mesh(BALL.triangles, BALL.vertices)
    return serialize(_type_of(topic), _FIELDS[topic] | changes)


def absurd(topic, random, **changes):
    """Return the bytes of a message of the topic's type with one to three absurd values."""
    if topic == "mesh":
        return _absurd_mesh(random)
    while True:
        fields = deepcopy(_FIELDS[topic] | changes)
        for _ in range(random.integers(1, 4)):
            _spoil(fields, random)
        try:
            return serialize(_type_of(topic), fields)
        except (struct.error, OverflowError, ValueError, TypeError, AttributeError):
            pass  # no such message: another one


def broken(topic, random, **changes):
    """Return bytes that may once have been a message of the topic."""
    how = random.choice((_noise, _cut, _flipped, _lying, _spliced, _longer))
    return how(good(topic, **changes), random)


def _type_of(topic):
    return (TYPES | _ORDER)[topic]


def _absurd_mesh(random):
    triangles, vertices = BALL.triangles.astype(np.uint32), BALL.vertices.copy()
    rows = random.integers(0, len(vertices), random.integers(1, 4))
    kind = random.integers(8)
    if kind == 0:
        vertices[rows, random.integers(3)] = random.choice(_FLOATS)
    elif kind == 1:
        triangles[rows] = random.integers(0, 2**32, dtype=np.uint32)
    elif kind == 2:
        triangles[rows] = triangles[rows][:, [0, 0, 1]]
    elif kind == 3:
        triangles = triangles[:0]
    elif kind == 4:
        vertices = vertices[: random.integers(len(vertices))]
    elif kind == 5:
        vertices *= 10.0 ** random.integers(-300, 300)
    elif kind == 6:
        triangles = triangles[:, ::-1]
    else:
        vertices += 10.0 ** random.integers(2, 12)
    return write_mesh(triangles, vertices, big_endian=bool(random.integers(2)))


def _spoil(fields, random):
    """Make one value absurd, anywhere in a message."""
    name = random.choice(list(fields))
    value = fields[name]
    if isinstance(value, dict):
        _spoil(value, random)
    elif isinstance(value, list) and value and isinstance(value[0], dict):
        if random.integers(3):
            _spoil(value[random.integers(len(value))], random)
        else:
            fields[name] = _other_list(value, random)
    else:
        fields[name] = _other_value(value, random)


def _other_list(items, random):
    return (
        [],
        items[:1] * random.integers(2, 300),
        items[: random.integers(len(items))],
        items + deepcopy(items),
        [items[i] for i in random.permutation(len(items))],
    )[random.integers(5)]


def _other_value(value, random):
    if isinstance(value, bool):
        return not value
    if isinstance(value, int):
        return int(_WHOLES[random.integers(len(_WHOLES))])
    if isinstance(value, float):
        return float(random.choice(_FLOATS))
    if isinstance(value, str):
        return _TEXTS[random.integers(len(_TEXTS))]
    if isinstance(value, bytes):
        return (b"", value[:-1], value + b"\0", random.bytes(len(value)))[random.integers(4)]
    values = [float(one) for one in value] or [1.0, 2.0]
    values[random.integers(len(values))] = float(random.choice(_FLOATS))
    return values


def _noise(_, random):
    # rclpy, or what is below it, wants the four bytes of the encapsulation.
    return (b"\0\1\0\0" if random.integers(2) else b"") + random.bytes(random.integers(4, 3000))


def _cut(payload, random):
    return payload[: random.integers(4, len(payload))]


def _flipped(payload, random):
    flipped = np.frombuffer(payload, np.uint8).copy()
    for at in random.integers(0, 8 * len(payload), random.integers(1, 9)):
        flipped[at // 8] ^= 1 << (at % 8)
    return flipped.tobytes()


def _lying(payload, random):
    """Return the message with one number changed, probably a length."""
    at = 4 * int(random.integers(1, min(len(payload) // 4, 100)))
    number = random.choice([0, 1, 2**16, 2**24, 2**31 - 1, 2**31, 2**32 - 1])
    return payload[:at] + struct.pack("<I", number) + payload[at + 4 :]


def _spliced(payload, random):
    other = good(random.choice(list(TYPES)))
    return payload[: random.integers(4, len(payload))] + other[random.integers(len(other)) :]


def _longer(payload, random):
    return payload + random.bytes(random.integers(4, 3000))


# --- who reads them ----------------------------------------------------------------------------

SETTINGS = Settings.from_values({"method": "em", "samples": 200, "fresh_samples": 200})
LIMITS = SETTINGS.limits


def read_poses(payload, optics):
    LIMITS.check_rig(payload)
    return poses_from_message(deserialize(TYPES["camera_poses"], payload), optics, "world")


def read_rig(payload, optics):
    LIMITS.check_rig(payload)
    return rig_from_message(deserialize(TYPES["rig"], payload), optics, "world")


READ = {
    "mesh": lambda payload, _: mesh_from_bytes(payload, LIMITS),
    "cloud": lambda payload, _: cloud_from_message(
        deserialize(TYPES["cloud"], payload), "world", LIMITS
    ),
    "camera_poses": read_poses,
    "rig": read_rig,
}


class Bench:
    """A planner with a good mesh and a good rig in force, and a clock that is set by hand."""

    def __init__(self):
        self.log = Log()
        self.now = datetime(2026, 1, 1, tzinfo=timezone.utc)
        self.planner = Planner(self.log)
        self.put_good()

    def put_good(self):
        self.offer("mesh", good("mesh"))
        self.offer("rig", good("rig"))

    def refuses(self, topic, payload):
        """Return whether a message leaves what was in force in force."""
        before = self.in_force
        self.offer(topic, payload)
        if self.in_force == before:
            return True
        self.put_good()
        return False

    def offer(self, topic, payload):
        where = self.planner.surface if topic in {"mesh", "cloud"} else self.planner.rig
        read = partial(READ[topic], payload)
        where.receive(Arrival(topic, TYPES[topic], payload, read, self.now))
        self.planner.digest(SETTINGS.optics)

    @property
    def in_force(self):
        return self.planner.surface.in_force, self.planner.rig.in_force

    def plan(self):
        """Return the plan, retrying once as a caller would that is told to."""
        try:
            return self.planner.plan(SETTINGS.request)[0]
        except NotReady:
            return self.planner.plan(SETTINGS.request)[0]
