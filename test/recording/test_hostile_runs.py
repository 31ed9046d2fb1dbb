# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Runs made to harm whoever reads them: each is skipped or refused, and told of."""

from __future__ import annotations

import os
import struct
from io import BytesIO

import lz4.frame
import pytest
import zstandard
from mcap.writer import CompressionType, Writer

from focus_planner.core.validation import InputError
from focus_planner.messages.typestore import (
    MAX_DEFINITION,
    PLAN,
    definition_of,
    deserialize,
    serialize,
)
from focus_planner.recording import bag_reading
from focus_planner.recording import last_plan as module
from focus_planner.recording.bag import BagWriter
from focus_planner.recording.bag_reading import read_bag
from focus_planner.recording.last_plan import last_plan
from focus_planner.recording.naming import METADATA
from focus_planner.recording.run_reading import read_run
from testing import made_up_runs as made_up
from testing.damaged_runs import MUTANTS
from testing.forked import run_forked
from testing.made_up_runs import AT, PLANNER, plan_fields, plan_payload, run_id, write_with_plan

TOPIC = f"{PLANNER}/focus_plan"
MAGIC = b"\x89MCAP0\r\n"
MIB = 2**20


@pytest.fixture
def good(tmp_path):
    """A good run, older than the hostile ones."""
    return write_with_plan(tmp_path, 1)


def put(directory, data, metadata=None):
    """Write a hostile run, newer than the good one."""
    folder = directory / run_id(2)
    folder.mkdir()
    (folder / f"{folder.name}_0.mcap").write_bytes(data)
    text = "rosbag2_bagfile_information:\n  topics_with_message_count:\n" + TOPIC
    (folder / METADATA).write_text(text if metadata is None else metadata)
    return folder


def mcap(payload, definition=None, type_name=PLAN, times=1):
    stream = BytesIO()
    writer = Writer(stream, compression=CompressionType.NONE)
    writer.start(profile="ros2")
    text = definition_of(PLAN) if definition is None else definition
    schema = writer.register_schema(type_name, "ros2msg", text.encode())
    channel = writer.register_channel(TOPIC, "cdr", schema)
    for _ in range(times):
        writer.add_message(channel, log_time=AT, data=payload, publish_time=AT)
    writer.finish()
    return stream.getvalue()


def plan_with(**changed):
    fields = plan_fields(2)
    for name, value in changed.items():
        where = fields if name in OF_PLANS else fields["cameras"][0]
        where[name] = value
    return mcap(serialize(PLAN, fields))


def check_skipped(directory, good, why=""):
    """The good run's plan is found; the hostile one is told of; a replay refuses it in a line."""
    search = last_plan(directory, PLANNER)
    assert search.plan is not None
    assert search.plan.run == good
    (skipped,) = search.skipped
    assert skipped.run.name == run_id(2)
    assert why in skipped.why
    assert "\n" not in skipped.why
    with pytest.raises(InputError) as error:
        read_run(directory / run_id(2))
    assert "\n" not in str(error.value)


def test_what_is_good_is_not_skipped(tmp_path, good):
    folder = put(tmp_path, mcap(plan_payload(2)))
    search = last_plan(tmp_path, PLANNER)
    assert (search.plan.run, search.skipped) == (folder, ())


NAN, INF = float("nan"), float("inf")
SHOT = plan_fields(2)["cameras"][0]["shots"][0]
OF_PLANS = {
    *("plan_id", "cost", "lower_bound", "samples", "surface_area", "total_seconds", "cameras"),
    *("max_mm_per_pixel", "sharp_views", "sharp_area", "sharp_standard_error"),
    *("median_mm_per_pixel", "percentile_90_mm_per_pixel"),
}
VALUES = {
    "name": ["a b/../é\n", "", "y" * 100_000, "9lives", "cam_1"],
    "status": [0, 5, 250],
    "focus_distance": [NAN, INF, -5.0, 0.0, 0.76, 1e-320],
    "near_limit": [NAN, INF, -1.0, 0.0, 0.8],
    "far_limit": [NAN, -INF, 0.0, 0.7],
    "dioptres": [NAN, INF, 0.0, 1.0],
    "bracket": [[], [NAN], [-INF], [0.75, 0.75], [0.7]],
    "shots": [[], [SHOT, SHOT], [SHOT | {"near_limit": NAN}], [SHOT | {"assigned_samples": 8}]],
    "assigned_samples": [2**32 - 1, 8, 101],
    "in_focus_samples": [10],
    "device_unit": ["x" * 65, "a\x1b[31m"],
    "device_bracket": [[NAN], [1.0, 2.0]],
    "from_sensor": [INF],
    "plan_id": ["", "../../etc", run_id(3)],
    "cost": [NAN, INF, -1.0],
    "lower_bound": [INF, -INF],
    "samples": [0],
    "surface_area": [NAN],
    "total_seconds": [INF],
    "max_mm_per_pixel": [NAN, INF, -1.0],
    "sharp_views": [[1], [0]],
    "sharp_area": [[NAN], [1.0]],
    "sharp_standard_error": [[-1.0]],
    "median_mm_per_pixel": [INF, -1.0],
    "percentile_90_mm_per_pixel": [INF, -1.0],
    "cameras": [[]],
}
#: Of one number of views, what cannot be.
SHARP = {"sharp_views": [1], "sharp_area": [0.5], "sharp_standard_error": [0.1]}


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("sharp_views", 0),
        ("sharp_area", NAN),
        ("sharp_area", -0.5),
        ("sharp_standard_error", INF),
    ],
)
def test_a_plan_with_an_area_that_cannot_be_is_not_put_in_force(tmp_path, good, name, value):
    put(tmp_path, plan_with(**SHARP | {name: [value]}))
    check_skipped(tmp_path, good)


def test_a_plan_with_areas_that_can_be_is_put_in_force(tmp_path):
    folder = put(tmp_path, plan_with(**SHARP))
    assert last_plan(tmp_path, PLANNER).plan.run == folder


@pytest.mark.parametrize(
    ("name", "value"), [(name, value) for name, values in VALUES.items() for value in values]
)
def test_a_plan_with_a_value_that_no_plan_has_is_not_put_in_force(tmp_path, good, name, value):
    put(tmp_path, plan_with(**{name: value}))
    check_skipped(tmp_path, good)


def test_a_message_that_declares_more_cameras_than_there_are_bytes(tmp_path, good):
    payload = serialize(PLAN, {"plan_id": run_id(2)})
    put(tmp_path, mcap(payload[:-4] + b"\xff\xff\xff\xff"))
    check_skipped(tmp_path, good)


# --- definitions -------------------------------------------------------------------------------


def with_cameras(line):
    text = definition_of(PLAN)
    assert text.count("focus_planner_msgs/CameraFocus[] cameras") == 0
    return text.replace("\nCameraFocus[] cameras", f"\n{line}")


DEFINITIONS = {
    "another type": with_cameras("uint8[] cameras"),
    "a long array": with_cameras("string[100000000] cameras"),
    "numbers": with_cameras("float64[2000000000] cameras"),
    "itself": with_cameras("FocusPlan[] cameras"),
    "one cyclic": with_cameras("A[] cameras") + "=" * 80 + "\nMSG: focus_planner_msgs/A\nA[] a\n",
    "twice": definition_of(PLAN).replace("float64 cost\n", "float64 cost\nfloat64 cost\n"),
    "a missing one": definition_of(PLAN).partition("=" * 80)[0],
    "not text": "\x00" * 500,
    "long": "# " + "x" * MAX_DEFINITION + "\n" + definition_of(PLAN),
    "code": with_cameras("int32 X=1") + "\n'''\nimport os; os.abort()\n",
}


@pytest.mark.parametrize("what", DEFINITIONS)
def test_a_definition_means_no_more_than_todays(tmp_path, good, what):
    assert DEFINITIONS[what] != definition_of(PLAN)
    payload = plan_payload(2) + b"\xff\xff\xff\x7f" * 64
    put(tmp_path, mcap(payload, DEFINITIONS[what]))
    check_skipped(tmp_path, good)
    with pytest.raises(InputError):
        deserialize(PLAN, payload, DEFINITIONS[what])


def test_a_definition_in_another_order_and_with_less_is_read():
    text = "float64 cost\nstring plan_id\n"
    payload = b"\x00\x01\x00\x00" + struct.pack("<dI", 7.5, 2) + b"x\x00"
    plan = deserialize(PLAN, payload, text)
    assert (plan.cost, plan.plan_id, plan.cameras) == (7.5, "x", [])


# --- files -------------------------------------------------------------------------------------


ALIASES = "\n".join(
    ["a0: &a0 [x, x]", *(f"a{i}: &a{i} [*a{i - 1}, *a{i - 1}]" for i in range(1, 60))]
)


@pytest.mark.parametrize("text", ["[" * 100_000, "{a: " * 100_000, ALIASES, "", "\x00" * 99])
def test_metadata_that_are_none(tmp_path, good, text):
    put(tmp_path, mcap(plan_payload(2)), text)
    check_skipped(tmp_path, good, METADATA)


def test_metadata_are_never_parsed(tmp_path, good):
    text = "rosbag2_bagfile_information:\n  topics_with_message_count:\n" + "[" * 100_000
    put(tmp_path, mcap(plan_payload(2)), text)
    assert last_plan(tmp_path, PLANNER).plan.run == good


@pytest.mark.processes
@pytest.mark.parametrize("which", [f"{run_id(2)}_0.mcap", METADATA])
@pytest.mark.parametrize("kind", ["fifo", "folder", "link", "huge"])
def test_what_is_no_file_of_a_run(tmp_path, good, which, kind):
    path = put(tmp_path, mcap(plan_payload(2))) / which
    path.unlink()
    if kind == "fifo":
        os.mkfifo(path)
    elif kind == "folder":
        path.mkdir()
    elif kind == "link":
        path.symlink_to("/dev/zero")
    else:
        with path.open("wb") as file:
            file.truncate(40 * 10**9)
    check_skipped(tmp_path, good, which)


# --- sizes -------------------------------------------------------------------------------------


def record(opcode, content):
    return struct.pack("<BQ", opcode, len(content)) + content


def unknown(size):
    """A record that is passed over where it is in a chunk."""
    return record(99, bytes(size))


def text(value):
    return struct.pack("<I", len(value)) + value.encode()


def with_chunks(compression, declared, data, times=1):
    chunk = struct.pack("<QQQI", 0, AT, declared, 0) + text(compression)
    chunk = record(6, chunk + struct.pack("<Q", len(data)) + data)
    end = record(15, struct.pack("<I", 0)) + record(2, struct.pack("<QQI", 0, 0, 0))
    return MAGIC + record(1, text("ros2") + text("test")) + chunk * times + end + MAGIC


def zeros(compression, mebibytes):
    """Zeros, compressed piece by piece; with zstd, their number is declared or not."""
    if compression == "lz4":
        pack = lz4.frame.LZ4FrameCompressor()
        begun = pack.begin()
    else:
        size = mebibytes * MIB if compression == "zstd" else -1
        pack, begun = zstandard.ZstdCompressor().compressobj(size=size), b""
    return b"".join([begun, *(pack.compress(bytes(MIB)) for _ in range(mebibytes)), pack.flush()])


@pytest.fixture
def small(monkeypatch):
    """Has limits that are a thousandth of the real ones, and counts what is unpacked."""
    unpacked = []
    limits = bag_reading.Limits(piece=MIB, unpacked=4 * MIB, small=MIB // 2)
    monkeypatch.setattr(bag_reading, "RUNS", limits)
    joined = bag_reading._joined

    def counted(*of):
        content = joined(*of)
        unpacked.append(len(content))
        return content

    monkeypatch.setattr(bag_reading, "_joined", counted)
    return unpacked


def fault(tmp_path, data):
    path = tmp_path / "one.mcap"
    path.write_bytes(data)
    with path.open("rb") as stream:
        reading = bag_reading.BagReading(stream, bag_reading.RUNS)
        assert list(reading) == []
    return reading.fault


@pytest.mark.parametrize("compression", ["zstd", "lz4", "zstd, undeclared"])
def test_a_chunk_that_says_how_large_it_is_is_not_unpacked(small, tmp_path, compression):
    data = zeros(compression, 3)
    kind = compression.partition(",")[0]
    declared = "more than is read: a chunk that declares 3,145,728 bytes, not up to 1,048,576"
    assert fault(tmp_path, with_chunks(kind, 3 * MIB, data)) == declared
    assert small == []


@pytest.mark.parametrize("compression", ["zstd", "lz4", "zstd, undeclared"])
def test_a_chunk_that_does_not_is_unpacked_up_to_what_it_says(small, tmp_path, compression):
    data = zeros(compression, 3)
    kind = compression.partition(",")[0]
    assert fault(tmp_path, with_chunks(kind, 1000, data)) == (
        "a damaged file: a chunk of another size than the 1,000 declared"
    )
    assert small == [1001]


def test_what_chunks_unpack_to_together_is_limited_by_the_files_size(small, tmp_path):
    content = unknown(MIB // 5)
    size = len(content)
    data = zstandard.compress(content)
    found = fault(tmp_path, with_chunks("zstd", size, data, times=9))
    assert "bytes that unpack to more than 524,288" in found
    assert small == [size, size]


@pytest.mark.parametrize("declared", [2**31, 2**62, 2**64 - 1])
def test_a_size_is_not_believed(tmp_path, declared):
    assert "a chunk that declares" in fault(tmp_path, with_chunks("zstd", declared, b"\x28\xb5"))


def test_long_records_and_names_and_definitions_and_many_records(small, tmp_path, monkeypatch):
    monkeypatch.setattr(bag_reading, "_MAX_OTHER", 5000)
    monkeypatch.setattr(bag_reading, "_MAX_SCHEMAS", 3000)
    limits = bag_reading.Limits(records=100)
    monkeypatch.setattr(bag_reading, "RUNS", limits)
    head = MAGIC + record(1, text("ros2") + text("test"))
    assert "a record of 5,016 bytes" in fault(tmp_path, head + record(12, bytes(5016)))
    schema = [
        record(3, struct.pack("<H", k) + text("a/B") + text("ros2msg") + text("x" * 1600))
        for k in (1, 2)
    ]
    assert "definitions of more than 3,000" in fault(tmp_path, head + b"".join(schema))
    channel = struct.pack("<HH", 1, 1) + text("t" * 1001) + text("cdr") + struct.pack("<I", 0)
    assert "a name of 1,001 characters" in fault(tmp_path, head + schema[0] + record(4, channel))
    assert "more than 100 records" in fault(tmp_path, head + record(7, bytes(6)) * 200)


def test_one_definition_is_kept_once_however_many_messages_have_it(tmp_path):
    path = tmp_path / "many.mcap"
    path.write_bytes(mcap(b"\x00\x01\x00\x00", "# " + "y" * 40_000, times=500))
    messages = read_bag(path).messages
    assert len(messages) == 500
    assert len({id(message.definition) for message in messages}) == 1


def test_large_chunks_of_surfaces_are_passed_over_in_the_search(tmp_path, monkeypatch):
    bag = BagWriter()
    for message in made_up.input_messages(points=4000):
        bag.add(message)
    bag.flush()
    bag.open(tmp_path / run_id(2))
    bag.add(made_up.plan_message(made_up.beginning(2), plan_payload(2), published=True))
    bag.close()
    monkeypatch.setattr(module, "_LIMITS", bag_reading.Limits(piece=12_000, passed_over=1 << 30))
    search = last_plan(tmp_path, PLANNER)
    assert (search.plan.message.plan_id, search.skipped) == (run_id(2), ())


@pytest.mark.parametrize("declared", [3 << 30, 2**62])
def test_a_chunk_that_no_run_has_is_told_in_the_search(tmp_path, good, declared):
    folder = tmp_path / run_id(9)
    folder.mkdir()
    data = with_chunks("zstd", declared, b"\x28\xb5")
    (folder / f"{folder.name}_0.mcap").write_bytes(data)
    search = last_plan(tmp_path, PLANNER)
    (skipped,) = search.skipped
    assert skipped.run == folder
    assert f"a chunk that declares {declared:,} bytes" in skipped.why
    assert search.plan is not None


def test_a_search_among_runs_that_take_long_ends(tmp_path, good, monkeypatch):
    monkeypatch.setattr(module, "_MAX_COST", 3 * MIB)
    content = unknown(MIB)
    data = with_chunks("zstd", len(content), zstandard.compress(content))
    for number in range(2, 12):
        folder = tmp_path / run_id(number)
        folder.mkdir()
        (folder / f"{folder.name}_0.mcap").write_bytes(data)
    search = last_plan(tmp_path, PLANNER)
    assert search.plan is None
    assert search.skipped[-1].why == "older runs were not searched: these took too long"
    assert search.skipped[-1].run.name == run_id(11 - 2)


# --- all of it ---------------------------------------------------------------------------------


@pytest.mark.processes
def test_damaged_runs_cost_neither_the_process_nor_its_memory(tmp_path):
    done = run_forked("testing.damaged_runs", str(tmp_path))
    assert (done.stderr, done.stdout) == ("", f"{MUTANTS} True\n")
