# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Made-up messages with their expected contents."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from focus_planner.core.planning.plan import CameraFocus, CameraStatus, FocusPlan, Shot
from focus_planner.core.planning.request import (
    BOUNDS,
    MAX_SAMPLES,
    MAX_SHOTS,
    MAX_VIEWS,
    METHODS,
    PlanRequest,
)
from focus_planner.core.planning.sharp_views import Resolution, SharpArea
from focus_planner.core.rig.camera import Camera, CameraIntrinsics
from focus_planner.core.rig.lens import Lens
from focus_planner.core.rig.lens_table import LensTable
from focus_planner.core.rig.rig import MAX_CAMERAS, Grid, Rig
from focus_planner.core.surface.surface import PointCloud
from focus_planner.messages.reading import Datatype, Optics
from focus_planner.messages.writing import cloud_to_fields
from testing.intrinsics import varied

OPTICS = Optics(CameraIntrinsics(64, 48, 50.0, 51.0, 31.5, 23.5), Lens(0.035, 5.0, 0.2, 4.0))


# --- messages ----------------------------------------------------------------------------------


def message(fields):
    """What can be read like a message of these fields; bytes and numbers in a row are arrays."""
    return SimpleNamespace(**{name: _value(value) for name, value in fields.items()})


def _value(value):
    if isinstance(value, dict):
        return message(value)
    if isinstance(value, bytes):
        return np.frombuffer(value, np.uint8)
    if isinstance(value, (list, tuple)):
        nested = any(isinstance(item, dict) for item in value)
        return [message(item) for item in value] if nested else np.array(value)
    return value


# What is read of messages in which nothing was set.
EMPTY_POSE = {
    "position": {"x": 0.0, "y": 0.0, "z": 0.0},
    "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0},
}
EMPTY_INFO = {
    "width": 0,
    "height": 0,
    "distortion_model": "",
    "d": [],
    "k": [0.0] * 9,
    "binning_x": 0,
    "binning_y": 0,
    "roi": {"x_offset": 0, "y_offset": 0, "width": 0, "height": 0, "do_rectify": False},
}
EMPTY_TABLE = {"unit": "", "whole": False, "distances": [], "values": [], "step": 0.0}
EMPTY_LENS = {
    "focal_length": 0.0,
    "hyperfocal_distance": 0.0,
    "f_number": 0.0,
    "circle_of_confusion": 0.0,
    "min_focus": 0.0,
    "max_focus": 0.0,
    "focus_distances": [],
    "focus_steps": 0,
    "table": EMPTY_TABLE,
    "hiatus": 0.0,
}
EMPTY_CAMERA = {"name": "", "pose": EMPTY_POSE, "camera_info": EMPTY_INFO, "lens": EMPTY_LENS}
EMPTY_REQUEST = {
    "method": "",
    "samples": 0,
    "seed": 0,
    "time_budget": 0.0,
    "k": 0,
    "scope": "",
    "shots": 0,
    "views": 0,
    "depth_tolerance": 0.0,
    "max_mm_per_pixel": 0.0,
    "bound": "",
    "gap": 0.0,
}


def cloud_fields(columns, *, dtype="f4", big_endian=False, gap=0, row_gap=0, rows=1, order="xyz"):
    """A cloud whose fields stand in any order, with gaps between and behind them."""
    points = np.asarray(columns, dtype=np.float64)
    size = np.dtype(dtype).itemsize
    step = (size + gap) * 3 + gap
    offsets = {name: gap + i * (size + gap) for i, name in enumerate(order)}
    width = len(points) // rows
    row_step = width * step + row_gap
    data = np.full((rows, row_step), 0xAB, dtype=np.uint8)
    packed = np.dtype(
        {
            "names": list(order),
            "formats": [(">" if big_endian else "<") + dtype] * 3,
            "offsets": [offsets[name] for name in order],
            "itemsize": step,
        }
    )
    view = np.ndarray((rows, width), packed, data, strides=(row_step, step))
    for column, name in enumerate("xyz"):
        view[name] = points[:, column].reshape(rows, width)
    datatype = Datatype.FLOAT32 if dtype == "f4" else Datatype.FLOAT64
    return {
        "header": {"frame_id": "world"},
        "height": rows,
        "width": width,
        "fields": [
            {"name": name, "offset": offsets[name], "datatype": datatype, "count": 1}
            for name in order
        ],
        "is_bigendian": big_endian,
        "point_step": step,
        "row_step": row_step,
        "data": data.tobytes(),
        "is_dense": True,
    }


#: What ``cloud_fields`` takes but points.
cloud_layouts = st.fixed_dictionaries(
    {
        "dtype": st.sampled_from(["f4", "f8"]),
        "big_endian": st.booleans(),
        "gap": st.integers(0, 5),
        "row_gap": st.integers(0, 9),
        "rows": st.sampled_from([1, 2, 4]),
        "order": st.permutations("xyz").map("".join),
    }
)


def importance_fields(values, *, name="importance", kind="f4", datatype=Datatype.FLOAT32):
    """A cloud of random points with a field that is not aligned."""
    points = np.random.default_rng(4).normal(size=(len(values), 3))
    record = np.zeros(len(values), np.dtype([("xyz", "<f8", 3), ("_", "u1"), ("value", kind)]))
    record["xyz"], record["value"] = points, values
    fields = cloud_to_fields(PointCloud(points), "world")
    fields["fields"].append({"name": name, "offset": 25, "datatype": datatype, "count": 1})
    return fields | {
        "point_step": record.itemsize,
        "row_step": record.nbytes,
        "data": record.tobytes(),
    }


#: Every type of number, and how NumPy calls it.
NUMBERS = [
    ("i1", Datatype.INT8),
    ("u1", Datatype.UINT8),
    ("<i2", Datatype.INT16),
    ("<u2", Datatype.UINT16),
    ("<i4", Datatype.INT32),
    ("<u4", Datatype.UINT32),
    ("<f4", Datatype.FLOAT32),
    ("<f8", Datatype.FLOAT64),
]
#: What makes a cloud of 20 points contradict itself, and what is then said.
BAD_CLOUDS = [
    ({"data": bytes(10)}, "height × row_step bytes of data .*, got 10 bytes"),
    ({"row_step": 1}, "rows of at least width × point_step"),
    ({"width": 10_000}, "rows of at least width × point_step"),
    ({"height": 2**32 - 1}, "got 240 bytes for 4294967295 rows"),
    ({"point_step": 8}, "cloud field z: expected a field that ends within point_step"),
    ({"fields": []}, "cloud fields: expected x, y and z, got none"),
    (
        {
            "fields": [
                {"name": name, "offset": 0, "datatype": Datatype.INT16, "count": 1}
                for name in "xyz"
            ]
        },
        "cloud field x: expected one FLOAT32 or FLOAT64, got 1 of datatype 3",
    ),
    ({"header": {"frame_id": "base"}}, "header.frame_id: expected 'world'.*, got 'base'"),
    ({"header": {"frame_id": ""}}, "header.frame_id: expected 'world'.*, got ''"),
    ({"width": 0, "row_step": 0, "data": b""}, "at least 16 points, got an empty cloud"),
]


# --- what they say -----------------------------------------------------------------------------

numbers = st.floats(-1e6, 1e6)
positions = st.tuples(numbers, numbers, numbers)
positive = st.floats(1e-3, 1e3)
far_limits = st.one_of(positive, st.just(math.inf))
from_sensor = st.none() | positive
counts = st.integers(0, 2**32 - 1)

triangle_arrays = st.integers(0, 7).flatmap(
    lambda n: arrays.arrays(np.int32, (n, 3), elements=st.integers(0, 2**31 - 1))
)
vertex_arrays = st.integers(0, 7).flatmap(lambda n: arrays.arrays(np.float64, (n, 3)))


@st.composite
def clouds(draw):
    """50 points, with or without normals, with or without importance."""
    random = np.random.default_rng(1)
    points, normals = random.normal(size=(2, 50, 3))
    return PointCloud(
        points,
        normals if draw(st.booleans()) else None,
        random.random(50) if draw(st.booleans()) else None,
    )


@st.composite
def unit_quaternions(draw):
    q = np.array(draw(st.tuples(*[st.floats(-1, 1)] * 4)))
    norm = np.linalg.norm(q)
    return tuple((q / norm).tolist()) if norm > 1e-3 else (0.0, 0.0, 0.0, 1.0)


@st.composite
def lens_tables(draw, kinds=(False, True)):
    """Tables that hold 1 m, with and without infinity, or of a unit that needs none."""
    is_whole = draw(st.sampled_from(kinds))
    if not is_whole and draw(st.booleans()):
        return LensTable(draw(st.sampled_from(["m", "dioptres"])))
    nearer = np.cumsum(draw(st.lists(st.floats(0.05, 2.0), min_size=1, max_size=3)))
    farther = draw(st.sampled_from([(), (3.0,), (2.5, math.inf)]))
    distances = (*(1 / (1 + nearer[::-1])), 1.0, *farther)
    count = len(distances) - 1
    gaps = draw(st.lists(st.floats(1.5, 300.0), min_size=count, max_size=count))
    values = draw(st.sampled_from([-1, 1])) * (draw(st.floats(-1e3, 1e3)) + np.cumsum([0.0, *gaps]))
    unit, step = draw(st.sampled_from(["steps", "m"])), draw(st.sampled_from([0, 1, 2]))
    return LensTable(unit, is_whole, distances, values, step if is_whole else 0)


@st.composite
def lenses(draw):
    focal_length = draw(st.floats(0.01, 0.2))
    min_focus = draw(st.floats(0.0, 1.0))
    max_focus = draw(st.one_of(st.just(math.inf), st.floats(1.0, 50.0)))
    hyperfocal_distance = draw(st.floats(0.5, 100.0))
    hiatus = draw(st.sampled_from([0.0, -0.004, 0.02]))
    circle = draw(st.none() | st.floats(1e-6, 1e-3))
    if draw(st.booleans()):
        table = draw(lens_tables())
        # All tables hold 1 m; whole values need not be near it.
        limits = (0.0, math.inf) if table.whole else (0.92, 1e4)
        return Lens(
            focal_length,
            hyperfocal_distance,
            *limits,
            table=table,
            hiatus=hiatus,
            circle_of_confusion=circle,
        )
    steps = draw(st.none() | st.integers(2, 65_536)) if min_focus > focal_length else None
    listed = draw(st.none() | st.lists(st.just(1.0), min_size=1)) if steps is None else None
    values = (focal_length, hyperfocal_distance, min_focus, max_focus, listed, steps)
    return Lens(*values, hiatus=hiatus, circle_of_confusion=circle)


plain_images = st.builds(
    CameraIntrinsics,
    st.integers(1, 10_000),
    st.integers(1, 10_000),
    positive,
    positive,
    numbers,
    numbers,
)
images = plain_images | varied(plain_images)


@st.composite
def rigs(draw):
    count = draw(st.integers(1, 4))
    cameras = tuple(
        Camera(
            f"cam_{i}",
            draw(positions),
            draw(unit_quaternions()),
            draw(images),
            draw(lenses()),
        )
        for i in range(count)
    )
    return Rig(cameras, "world", draw(st.sampled_from([None, Grid(1, count), Grid(count, 1)])))


requests = st.builds(
    PlanRequest,
    method=st.sampled_from(METHODS),
    samples=st.integers(1, MAX_SAMPLES),
    seed=st.integers(1, 2**64 - 1),
    k=st.sampled_from([2, 3]),
    scope=st.sampled_from(["all", "assigned"]),
    time_budget=st.one_of(st.just(math.inf), positive),
    shots=st.integers(1, MAX_SHOTS),
    views=st.integers(1, MAX_VIEWS),
    images=st.integers(0, MAX_CAMERAS),
    depth_tolerance=positive,
    max_mm_per_pixel=st.one_of(st.just(math.inf), positive),
    bound=st.sampled_from(BOUNDS),
    gap=st.floats(1e-12, 1.0),
)
shots = st.builds(
    Shot,
    focus_distance=positive,
    near_limit=positive,
    far_limit=far_limits,
    assigned_samples=counts,
    in_focus_samples=counts,
    from_sensor=from_sensor,
)


@st.composite
def camera_foci(draw):
    """A plan for a camera whose lens may have a table."""
    focus = draw(
        st.builds(
            CameraFocus,
            name=st.just("left"),
            status=st.sampled_from(CameraStatus),
            focus_distance=positive,
            near_limit=positive,
            far_limit=far_limits,
            assigned_samples=counts,
            in_focus_samples=counts,
            shots=st.lists(shots, max_size=3).map(tuple),
            from_sensor=from_sensor,
        )
    )
    if draw(st.booleans()):
        return focus
    told = tuple(replace(shot, device_value=draw(numbers)) for shot in focus.shots)
    return replace(focus, shots=told, device_value=draw(numbers), device_unit="steps")


plans = st.builds(
    FocusPlan,
    method=st.sampled_from(METHODS),
    cost=positive,
    lower_bound=st.none() | positive,
    converged=st.booleans(),
    samples=counts,
    seed=st.integers(0, 2**64 - 1),
    depth_tolerance=positive,
    fresh_cost=positive,
    fresh_standard_error=positive,
    fresh_samples=counts,
    surface_area=positive,
    covered_area=positive,
    in_focus_area=positive,
    in_focus_standard_error=positive,
    solve_seconds=positive,
    total_seconds=positive,
    cameras=st.lists(camera_foci(), max_size=3).map(tuple),
    views=st.integers(1, MAX_VIEWS),
    images=counts,
    max_mm_per_pixel=st.one_of(st.just(math.inf), positive),
    sharp_areas=st.lists(st.builds(SharpArea, counts.filter(bool), positive, positive)).map(tuple),
    resolution=st.none() | st.builds(Resolution, positive, positive),
)


class Log:
    """Keeps all messages."""

    def __init__(self):
        self.warnings, self.errors = [], []

    def warning(self, message):
        self.warnings.append(message)

    def error(self, message):
        self.errors.append(message)
