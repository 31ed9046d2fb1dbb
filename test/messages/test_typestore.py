# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Messages without ROS, compared with those of ROS."""

from __future__ import annotations

import array
import json
import math
import os
import re
import sys
from functools import cache
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from ament_index_python.packages import get_package_share_directory
from hypothesis import given, settings
from hypothesis import strategies as st
from rclpy.serialization import deserialize_message, serialize_message

from focus_planner.core.validation import InputError
from focus_planner.messages.typestore import (
    PACKAGE,
    definition_of,
    deserialize,
    fields_of,
    serialize,
    type_hash,
)

ROOT = Path(__file__).parents[2]
OWN = sorted(f"{PACKAGE}/msg/{file.stem}" for file in (ROOT / "msg_defs" / "msg").glob("*.msg"))
OTHERS = [
    "shape_msgs/msg/Mesh",
    "sensor_msgs/msg/PointCloud2",
    "geometry_msgs/msg/PoseArray",
    "visualization_msgs/msg/MarkerArray",
    "rcl_interfaces/msg/Parameter",
]
REQUEST, RIG = f"{PACKAGE}/msg/PlanRequest", f"{PACKAGE}/msg/CameraRig"
RULER = "=" * 80 + "\n"


@cache
def ros_type(name):
    package, _, message = name.split("/")
    return getattr(import_module(f"{package}.msg"), message)


# --- any message -------------------------------------------------------------------------------

_FLOATS = {"float": 32, "double": 64}
_TEXT = st.text(st.characters(blacklist_categories=["Cs"], blacklist_characters="\0"), max_size=9)

_SIMPLE = {
    "string": _TEXT,
    "boolean": st.booleans(),
    # Above, the library reads negative numbers; the planner has none of these.
    "octet": st.integers(0, 127),
    **{kind: st.floats(width=bits) for kind, bits in _FLOATS.items()},
}


def values_of(kind):
    """Values of a field by what rclpy says of its type."""
    if match := re.fullmatch(r"sequence<(.*?)(, \d+)?>", kind):
        return st.lists(values_of(match[1]), max_size=3)
    if match := re.fullmatch(r"(.*)\[(\d+)\]", kind):
        return st.lists(values_of(match[1]), min_size=int(match[2]), max_size=int(match[2]))
    if kind in _SIMPLE:
        return _SIMPLE[kind]
    if match := re.fullmatch(r"(u?)int(\d+)", kind):
        bits = int(match[2])
        low, high = (0, 2**bits - 1) if match[1] else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
        return st.integers(low, high)
    package, name = kind.split("/")
    return fields(f"{package}/msg/{name}")


@cache
def fields(name):
    """Dictionaries with all fields of a message."""
    kinds = ros_type(name).get_fields_and_field_types()
    return st.fixed_dictionaries({field: values_of(kind) for field, kind in kinds.items()})


def from_ros(value):
    """What a message of rclpy says; NaN is None."""
    if hasattr(value, "get_fields_and_field_types"):
        names = value.get_fields_and_field_types()
        return {name: from_ros(getattr(value, name)) for name in names}
    if isinstance(value, (list, tuple, array.array, np.ndarray)):
        return [from_ros(item) for item in value]
    if isinstance(value, bytes):
        return value[0] if len(value) == 1 else list(value)
    value = value.item() if isinstance(value, np.generic) else value
    return None if isinstance(value, float) and math.isnan(value) else value


def plain(value):
    """The same of what this package reads and writes."""
    if isinstance(value, dict):
        return {name: plain(item) for name, item in value.items()}
    return [plain(item) for item in value] if isinstance(value, list) else from_ros(value)


@pytest.mark.parametrize("name", OWN + OTHERS)
def test_ros_reads_and_writes_the_same_bytes(name):
    @settings(max_examples=12)
    @given(fields(name))
    def check(given_fields):
        payload = serialize(name, given_fields)
        message = deserialize_message(payload, ros_type(name))
        assert from_ros(message) == plain(given_fields)
        again = serialize_message(message)  # other bytes between the values: those are not set
        assert plain(fields_of(deserialize(name, again))) == plain(given_fields)

    check()


@pytest.mark.parametrize("name", OWN + OTHERS)
def test_what_is_left_out_is_zero_or_empty(name):
    found = plain(fields_of(deserialize(name, serialize(name, {}))))
    assert found == from_ros(deserialize_message(serialize(name, {}), ros_type(name)))

    def check(value):
        if isinstance(value, dict):
            for item in value.values():
                check(item)
        elif isinstance(value, list):
            assert not any(value)
        else:
            assert not value

    check(found)


@pytest.mark.parametrize("name", OWN + OTHERS)
def test_numbers_of_an_empty_message_are_of_the_fields_types(name):
    """As every other library takes them."""
    kinds = ros_type(name).get_fields_and_field_types()
    message = deserialize(name, serialize(name, {}))
    for field, kind in kinds.items():
        value = getattr(message, field)
        if kind in _FLOATS:
            assert type(value) is float
        elif "int" in kind and "<" not in kind and "[" not in kind and "/" not in kind:
            assert type(value) is int
        elif kind == "boolean":
            assert type(value) is bool


def test_a_field_that_is_not_there_is_a_type_error():
    with pytest.raises(TypeError, match=r"PlanRequest: expected fields among method, samples.*'x'"):
        serialize(REQUEST, {"x": 1})
    with pytest.raises(TypeError, match=r"Lens: expected fields among .*, got 'focus'"):
        serialize(RIG, {"cameras": [{"lens": {"focus": 1.0}}]})


# --- payloads of something else ----------------------------------------------------------------


@pytest.mark.parametrize("name", OWN + OTHERS)
def test_random_bytes_are_an_input_error_or_a_message(name):
    heads = st.sampled_from([b"", b"\0\1\0\0", b"\0\0\0\0"])

    @settings(max_examples=40)
    @given(heads, st.binary(max_size=200) | st.lists(st.sampled_from(_WORDS)).map(b"".join))
    def check(head, body):
        try:
            deserialize(name, head + body)
        except InputError as error:
            text = str(error)
        else:
            return
        assert text.startswith(f"{name} message: expected its serialized form, got other bytes")
        assert "\n" not in text

    check()


_WORDS = [n.to_bytes(4, "little") for n in (0, 1, 2, 5, 2**31 - 1, 2**31, 2**32 - 1, 0x80818283)]


@pytest.mark.parametrize("name", OWN + OTHERS)
def test_every_cut_is_an_input_error_or_ends_in_zeros(name):
    payload = serialize(name, _some(name))
    shortest = len(payload)
    while shortest > 4:
        try:
            deserialize(name, payload[: shortest - 1])
        except InputError:
            break
        shortest -= 1
    assert not any(payload[shortest:])
    for length in range(shortest):
        with pytest.raises(InputError):
            deserialize(name, payload[:length])


@cache
def _some(name):
    """Fields of a message with one of everything in every sequence."""
    kinds = ros_type(name).get_fields_and_field_types()
    return {field: _some_value(kind) for field, kind in kinds.items()}


def _some_value(kind):
    if match := re.fullmatch(r"sequence<(.*?)(, \d+)?>", kind):
        return [_some_value(match[1])]
    if match := re.fullmatch(r"(.*)\[(\d+)\]", kind):
        return [_some_value(match[1])] * int(match[2])
    if kind in {"string", "boolean", *_FLOATS}:
        return {"string": "text", "boolean": True}.get(kind, 1.5)
    if "/" not in kind:
        return 7
    return _some("/msg/".join(kind.split("/")))


# --- definitions -------------------------------------------------------------------------------


@pytest.mark.parametrize("name", OWN)
def test_definitions_are_those_of_msg_defs_with_all_within_them(name):
    first, *others = definition_of(name).split(RULER)
    file = ROOT / "msg_defs" / "msg" / (name.rsplit("/", 1)[1] + ".msg")
    assert first == file.read_text()
    assert "#" in first
    within = {}
    for other in others:
        head, _, text = other.partition("\n")
        within[head.removeprefix("MSG: ")] = text
    needed, found = [name], set()
    while needed:
        for kind in ros_type(needed.pop()).get_fields_and_field_types().values():
            inner = re.sub(r"sequence<(.*?)(, \d+)?>|(.*)\[\d+\]", r"\1\3", kind)
            if "/" in inner and inner not in found:
                found.add(inner)
                needed.append(inner.replace("/", "/msg/"))
    assert within.keys() == found
    for inner, text in within.items():
        package, message = inner.split("/")
        if package == PACKAGE:
            assert text.strip() == (ROOT / "msg_defs/msg" / f"{message}.msg").read_text().strip()


@pytest.mark.parametrize("name", OWN + OTHERS)
def test_fields_are_those_that_ros_has(name):
    found = list(fields_of(deserialize(name, serialize(name, {}))))
    assert found == list(ros_type(name).get_fields_and_field_types())


@pytest.mark.parametrize("name", OWN + OTHERS)
def test_hashes_are_those_that_ros_installs(name):
    package, _, message = name.split("/")
    file = Path(sys.prefix) / "share" / package / "msg" / f"{message}.json"
    if "AMENT_PREFIX_PATH" in os.environ:  # a ROS that is installed elsewhere
        file = Path(get_package_share_directory(package)) / "msg" / f"{message}.json"
    hashes = {
        each["type_name"]: each["hash_string"]
        for each in json.loads(file.read_text())["type_hashes"]
    }
    assert type_hash(name) == hashes[name]
    for within, expected in hashes.items():
        assert type_hash(within) == expected


def _fields_in(text):
    lines = [line.partition("#")[0].split() for line in text.splitlines()]
    return [tuple(line) for line in lines if line]


def test_a_recorded_request_has_the_fields_of_the_service_and_of_the_action():
    recorded = _fields_in((ROOT / "msg_defs/msg/PlanRequest.msg").read_text())
    for file in ("srv/PlanFocus.srv", "action/PlanFocus.action"):
        request, *_ = (ROOT / "msg_defs" / file).read_text().split("\n---\n")
        assert _fields_in(request) == recorded
    service = import_module(f"{PACKAGE}.srv").PlanFocus.Request
    goal = import_module(f"{PACKAGE}.action").PlanFocus.Goal
    own = ros_type(REQUEST).get_fields_and_field_types()
    for other in (service, goal):
        assert list(other.get_fields_and_field_types().items()) == list(own.items())


# --- older and newer ones ----------------------------------------------------------------------


@pytest.mark.parametrize("name", OWN + OTHERS)
def test_another_text_of_the_same_definition_reads_the_same(name):
    payload = serialize(name, _some(name))
    read = deserialize(name, payload, definition_of(name) + "\n# with another comment\n")
    assert plain(fields_of(read)) == plain(fields_of(deserialize(name, payload)))
    assert serialize(name, fields_of(read)) == payload


def test_what_an_older_definition_lacks_is_zero_or_empty():
    lacking = (
        "float64 gap",
        "uint32 k",
        "uint32 views",
        "uint32 images",
        "float64 max_mm_per_pixel",
        "bool worst",
    )
    older = definition_of(REQUEST)
    for line in lacking:
        older = older.replace(f"{line}\n", "")
    assert older.count("\n") == definition_of(REQUEST).count("\n") - len(lacking)
    whole = {"method": "em", "seed": 5, "scope": "all", "bound": "none"}
    # Without its last fields, and without one whose absence leaves no gap before the next.
    payload = b"\0\1\0\0" + b"\3\0\0\0em\0\0" + bytes(4) + bytes(4) + (5).to_bytes(8, "little")
    payload += bytes(8) + b"\4\0\0\0all\0" + bytes(12) + bytes(4) + b"\5\0\0\0none\0"
    read = fields_of(deserialize(REQUEST, payload, older))
    for field, value in whole.items():
        assert read[field] == value
    assert (read["gap"], read["k"], read["worst"]) == (0.0, 0, False)
    assert (read["views"], read["max_mm_per_pixel"]) == (0, 0.0)


def test_what_an_older_definition_lacks_deep_within_is_zero_or_empty():
    older = definition_of(RIG).replace("uint32 focus_steps\n", "")
    older = older.replace("float64[] focus_distances\n", "").replace("LensTable table\n", "")
    cameras = [{"name": "a", "lens": {"focal_length": 0.05, "max_focus": 3.0}}]
    payload = serialize(RIG, {"cameras": cameras, "grid_rows": 1, "grid_columns": 1})
    older = older.replace("float64 hiatus\n", "")
    # At the end of the only lens: two fields of four bytes, both zero, an empty table, a number.
    end = payload[-8:]
    table, hiatus = b"\1" + bytes(23), bytes(8)
    assert payload[-48:-8] == bytes(8) + table + hiatus
    read = deserialize(RIG, payload[:-48] + end, older)
    (camera,) = read.cameras
    assert (camera.lens.focal_length, camera.lens.max_focus) == (0.05, 3.0)
    assert len(camera.lens.focus_distances) == camera.lens.focus_steps == 0
    assert camera.lens.table.unit == ""
    assert camera.lens.hiatus == 0.0
    assert (read.grid_rows, read.grid_columns) == (1, 1)


def test_a_newer_definition_is_told_to_need_a_newer_version():
    newer = definition_of(REQUEST) + "\nuint8 colour\n"
    payload = serialize(REQUEST, {}) + b"\1"
    with pytest.raises(InputError, match=r"PlanRequest.*got 'colour'; update focus_planner$") as e:
        deserialize(REQUEST, payload, newer)
    assert "\n" not in str(e.value)
    newer = definition_of(RIG).replace("LensTable table", "LensTable table\nbool zoom")
    payload = serialize(RIG, {})
    # The flag, what fills up the hiatus's eight bytes, and more than there is.
    with_camera = serialize(RIG, {"cameras": [{}]})[:-8] + bytes(16) + bytes(8)
    for each in (payload, with_camera):
        with pytest.raises(InputError, match=r"Lens: .*got 'zoom'; update focus_planner$"):
            deserialize(RIG, each, newer)


@pytest.mark.parametrize(
    "broken",
    [
        "float64",
        "!!",
        "\0",
        "Lost child",
        "PlanRequest child",
        "float64 x\nfloat64 x",
        "float64[99999999999999999999] x",
        "float64 x\n" + RULER,
        "float64 x\n" + RULER + "MSG: nothing",
        "wstring x",
    ],
)
def test_a_broken_definition_is_an_input_error(broken):
    with pytest.raises(InputError, match="PlanRequest") as error:
        deserialize(REQUEST, serialize(REQUEST, {}), broken)
    assert "\n" not in str(error.value)


@settings(max_examples=60)
@given(st.data())
def test_damaged_definitions_are_input_errors_or_read(data):
    text = definition_of(f"{PACKAGE}/msg/Shot")
    place = data.draw(st.integers(0, len(text)))
    end = data.draw(st.integers(place, min(len(text), place + 20)))
    new = data.draw(st.text("aF 4[]\n#=:/_\"'<", max_size=4))
    try:
        deserialize(f"{PACKAGE}/msg/Shot", bytes(40), text[:place] + new + text[end:])
    except InputError as error:
        said = str(error)
    else:
        return
    assert "\n" not in said
