# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What bags hold, whoever reads them, and whatever is left of them."""

from __future__ import annotations

import fcntl
import json
import os
import random
import shutil
import stat
import struct
import subprocess
import sys
import zlib
from functools import cache
from itertools import pairwise
from pathlib import Path

import pytest
import yaml
from mcap.reader import make_reader
from mcap.stream_reader import StreamReader
from mcap_ros2.decoder import DecoderFactory
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from focus_planner.core.validation import InputError
from focus_planner.messages.typestore import definition_of, serialize, type_hash
from focus_planner.recording.bag import BagMessage, BagWriter
from focus_planner.recording.bag_reading import read_bag
from focus_planner.recording.folders import bag_size, being_written
from focus_planner.recording.run_reading import read_run
from testing.forked import PIPE, ForkedProcess, run_forked
from testing.made_up_runs import (
    MARKERS,
    chunk_ends,
    ending,
    input_messages,
    message_as_json,
    messages,
    parts,
    record_ends,
    run_id,
    without_definitions,
    write,
)

TRUE = without_definitions(messages())


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return write(tmp_path_factory.mktemp("runs"))


@pytest.fixture(scope="module")
def data(run):
    return (run / f"{run.name}_0.mcap").read_bytes()


@pytest.fixture
def reads(tmp_path):
    """Read bytes as a bag and as a run; check what always holds, and return both."""
    file = tmp_path / "damaged.mcap"

    def read(content):
        file.write_bytes(content)
        bag = read_bag(file)
        found = without_definitions(bag.messages)
        assert found == TRUE[: len(found)]
        assert bag.whole is (bag.fault == "")
        assert not bag.whole or found == TRUE
        assert "\n" not in bag.fault
        try:
            read = read_run(file)
        except InputError as error:
            read = error
        if isinstance(read, InputError):
            assert len(found) < len(TRUE)
            assert "\n" not in str(read)
            return bag, None
        assert without_definitions(read.inputs) == without_definitions(input_messages())
        assert read.beginning.run_id == run_id()
        if bag.whole:
            assert (read.ending, read.fault) == (ending(), "")
        else:
            assert read.ending is None
            assert read.fault == bag.fault
        return bag, read

    return read


# --- writing and reading -----------------------------------------------------------------------


def test_what_is_written_is_read(run):
    bag = read_bag(run)
    assert (bag.whole, bag.fault) == (True, "")
    assert without_definitions(bag.messages) == TRUE
    assert all(m.definition == definition_of(m.type_name) for m in bag.messages)
    assert read_bag(run / f"{run.name}_0.mcap") == bag
    assert bag_size(run) == sum(file.stat().st_size for file in run.iterdir())


def test_payloads_are_kept_as_they_came_even_what_is_no_message(tmp_path):
    odd = [b"", b"\0", b"\0\0\0\0", b"\0\1\0\0" + bytes(3), os.urandom(3_000_000)]
    bag = BagWriter()
    for k, payload in enumerate(odd):
        bag.add(BagMessage("/odd", "shape_msgs/msg/Mesh", payload, k))
    bag.open(tmp_path / "odd")
    assert [m.payload for m in read_bag(bag.close()).messages] == odd


def test_it_is_the_same_whether_written_in_memory_first_or_not(tmp_path):
    files = []
    for early in (True, False):
        bag = BagWriter()
        folder = tmp_path / str(early) / "run"
        if early:
            bag.open(folder)
        for message in messages():
            bag.add(message)
        if not early:
            bag.open(folder)
        files.append((bag.close() / "run_0.mcap").read_bytes())
    assert files[0] == files[1]


def test_a_message_keeps_the_definition_that_it_was_written_with(tmp_path):
    older = "string method\nuint32 samples\n"
    payload = b"\0\1\0\0" + struct.pack("<I3sxI", 3, b"em\0", 70)
    bag = BagWriter()
    name = "focus_planner_msgs/msg/PlanRequest"
    bag.add(BagMessage("/old", name, payload, 1, older))
    bag.add(BagMessage("/new", name, serialize(name, {"gap": 0.5}), 2))
    bag.open(tmp_path / "run")
    old, new = read_bag(bag.close()).messages
    assert old.definition == older
    assert (old.read().method, old.read().samples, old.read().gap) == ("em", 70, 0.0)
    assert new.read().gap == 0.5


def test_chunks_are_compressed_and_checked_and_the_profile_is_of_ros2(run, data):
    with (run / f"{run.name}_0.mcap").open("rb") as file:
        assert make_reader(file, validate_crcs=True).get_header().profile == "ros2"
    with (run / f"{run.name}_0.mcap").open("rb") as file:
        chunks = [
            record
            for record in StreamReader(file, emit_chunks=True, validate_crcs=True).records
            if type(record).__name__ == "Chunk"
        ]
    assert len(chunks) == len(parts()) == len(chunk_ends(data))
    assert {chunk.compression for chunk in chunks} == {"zstd"}
    assert all(chunk.uncompressed_crc for chunk in chunks)
    assert sum(len(chunk.data) for chunk in chunks) < sum(c.uncompressed_size for c in chunks) / 2


def test_no_bag_is_ever_written_over(run, tmp_path):
    bag = BagWriter()
    before = (run / f"{run.name}_0.mcap").read_bytes()
    with pytest.raises(FileExistsError):
        bag.open(run)
    assert (run / f"{run.name}_0.mcap").read_bytes() == before
    assert not run.with_name(run.name + ".partial").exists()
    one, other = BagWriter(), BagWriter()
    one.open(tmp_path / "run")
    one.add(messages()[0])
    one.sync()
    with pytest.raises(FileExistsError):
        other.open(tmp_path / "run")
    other.abandon()
    assert without_definitions(read_bag(tmp_path / "run.partial").messages) == TRUE[:1]
    one.close()
    assert without_definitions(read_bag(tmp_path / "run").messages) == TRUE[:1]


def test_a_bag_is_partial_until_it_is_closed(tmp_path):
    bag = BagWriter()
    bag.open(tmp_path / "new" / "run")
    partial = tmp_path / "new" / "run.partial"
    assert [p.name for p in partial.parent.iterdir()] == ["run.partial"]
    assert being_written(partial)
    bag.add(messages()[0])
    bag.sync()
    assert [p.name for p in partial.iterdir()] == ["run_0.mcap"]
    assert not read_bag(partial).whole
    assert bag.close() == tmp_path / "new" / "run"
    assert [p.name for p in partial.parent.iterdir()] == ["run"]
    assert sorted(p.name for p in (tmp_path / "new" / "run").iterdir()) == [
        "metadata.yaml",
        "run_0.mcap",
    ]
    assert not being_written(tmp_path / "new" / "run")


def test_an_abandoned_bag_stays_partial_and_is_nobodys(tmp_path):
    bag = BagWriter()
    bag.open(tmp_path / "run")
    bag.add(messages()[0])
    bag.flush()
    bag.abandon()
    assert without_definitions(read_bag(tmp_path / "run.partial").messages) == TRUE[:1]
    assert not being_written(tmp_path / "run.partial")


def is_folder(descriptor):
    return stat.S_ISDIR(os.fstat(descriptor).st_mode)


@pytest.mark.processes
def test_whoever_looks_at_a_bag_just_then_does_not_keep_its_writer_from_marking_it(
    tmp_path, monkeypatch
):
    mark = fcntl.flock
    looking = []
    path = tmp_path / "run.partial" / "run_0.mcap"

    def flock(file, how):
        if not looking and not is_folder(file):
            looking.append(0)
            code = "import fcntl, sys, time; f = open(sys.argv[1]); fcntl.flock(f, fcntl.LOCK_EX);"
            code += "print(flush=True); time.sleep(0.3)"
            process = ForkedProcess("testing.source", code, str(path), stdout=PIPE)
            process.stdout.readline()
            looking.append(process)
        mark(file, how)

    monkeypatch.setattr(fcntl, "flock", flock)
    bag = BagWriter()
    bag.open(tmp_path / "run")
    looking[1].stdout.close()
    assert looking[1].wait(240) == 0
    assert being_written(tmp_path / "run.partial")
    bag.abandon()


def test_a_bag_is_being_written_before_its_file_is_marked(tmp_path, monkeypatch):
    mark = fcntl.flock
    seen = []

    def flock(file, how):
        if not is_folder(file) and how == fcntl.LOCK_EX:
            seen.append(being_written(tmp_path / "run.partial"))
        mark(file, how)

    monkeypatch.setattr(fcntl, "flock", flock)
    bag = BagWriter()
    bag.open(tmp_path / "run")
    assert seen == [True]
    assert being_written(tmp_path / "run.partial")
    bag.abandon()
    assert not being_written(tmp_path / "run.partial")


# --- what the system refuses -------------------------------------------------------------------


def test_a_folder_that_cannot_be_made_is_an_os_error(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(OSError, match="file"):
        BagWriter().open(tmp_path / "file" / "run")


@pytest.mark.processes
def test_a_full_disk_is_an_os_error_and_what_is_there_is_read(tmp_path):
    code = """
import resource, signal, sys
from pathlib import Path
from testing.made_up_runs import messages
from focus_planner.recording.bag import BagWriter
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
bag = BagWriter()
bag.open(Path(sys.argv[1]))
resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))
try:
    for message in messages():
        bag.add(message)
        bag.sync()
    bag.close()
except OSError as error:
    print(error.strerror)
bag.abandon()
"""
    done = run_forked("testing.source", code, str(tmp_path / "run"))
    assert (done.stdout, done.stderr) == ("File too large\n", "")
    bag = read_bag(tmp_path / "run.partial")
    found = without_definitions(bag.messages)
    assert 0 < len(found) < len(TRUE)
    assert found == TRUE[: len(found)]
    assert bag.fault == "a truncated file"
    assert not being_written(tmp_path / "run.partial")


@pytest.mark.parametrize("failing", ["fsync", "rename"])
def test_what_fails_at_the_end_leaves_a_partial_bag(failing, tmp_path, monkeypatch):
    bag = BagWriter()
    bag.open(tmp_path / "run")
    for message in messages():
        bag.add(message)

    def fail(*arguments):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(*((os, "fsync") if failing == "fsync" else (Path, "rename")), fail)
    with pytest.raises(OSError, match="No space left"):
        bag.close()
    bag.abandon()
    assert [path.name for path in tmp_path.iterdir()] == ["run.partial"]
    assert without_definitions(read_bag(tmp_path / "run.partial").messages) == TRUE


def test_what_is_no_bag_is_refused_in_one_line(tmp_path):
    with pytest.raises(InputError, match="expected a recorded run, got no such folder or file"):
        read_bag(tmp_path / "none")
    with pytest.raises(InputError, match=r"with one \.mcap file, got a folder without one"):
        read_bag(tmp_path)
    for run in ("1", "2", ".hidden"):
        (tmp_path / run).mkdir()
        (tmp_path / run / "run.mcap").write_bytes(b"")
    with pytest.raises(InputError, match=r"; name one of the runs in it, such as \S+/2$"):
        read_bag(tmp_path)
    for name in ("a.mcap", "b.mcap"):
        (tmp_path / name).write_bytes(b"")
    with pytest.raises(InputError, match="got a folder with 2 of them"):
        read_bag(tmp_path)


# --- other readers -----------------------------------------------------------------------------


def test_metadata_says_what_is_in_the_bag(run):
    text = (run / "metadata.yaml").read_text()
    assert "&id" not in text
    info = yaml.safe_load(text)["rosbag2_bagfile_information"]
    times = [message.at for message in messages()]
    assert info["message_count"] == len(times)
    assert info["starting_time"]["nanoseconds_since_epoch"] == min(times)
    assert info["duration"]["nanoseconds"] == max(times) - min(times)
    assert info["storage_identifier"] == "mcap"
    assert info["relative_file_paths"] == [f"{run.name}_0.mcap"]
    (file,) = info["files"]
    assert file["path"] == f"{run.name}_0.mcap"
    assert file["message_count"] == len(times)
    topics = {}
    for message in messages():
        topics.setdefault(message.topic, [message.type_name, 0])[1] += 1
    for each in info["topics_with_message_count"]:
        topic = each["topic_metadata"]
        assert topics.pop(topic["name"]) == [topic["type"], each["message_count"]]
        assert topic["serialization_format"] == "cdr"
        assert topic["type_description_hash"] == type_hash(topic["type"])
        (qos,) = topic["offered_qos_profiles"]
        assert (qos["reliability"], qos["durability"]) == ("reliable", "transient_local")
    assert topics == {}
    with (run / f"{run.name}_0.mcap").open("rb") as file:
        (inside,) = make_reader(file).iter_metadata()
    assert inside.name == "rosbag2"
    assert yaml.safe_load(inside.metadata["serialized_metadata"]) == info


def test_rosbags_reads_every_message_by_the_definitions_in_the_bag(run):
    with Reader(run) as reader:
        assert reader.message_count == len(TRUE)
        assert reader.start_time == min(m.at for m in messages())
        assert reader.end_time == max(m.at for m in messages()) + 1
        stores = {}
        for connection in reader.connections:
            store = get_typestore(Stores.EMPTY)
            text = connection.msgdef.data
            store.register(get_types_from_msg(text, connection.msgtype))
            assert store.hash_rihs01(connection.msgtype) == type_hash(connection.msgtype)
            assert connection.digest == type_hash(connection.msgtype)
            stores[connection.topic] = store
        found = [
            (c.topic, c.msgtype, bytes(raw), at, stores[c.topic].deserialize_cdr(raw, c.msgtype))
            for c, at, raw in reader.messages()
        ]
    assert sorted(each[:4] for each in found) == sorted(TRUE)
    by_payload = {m.payload: m for m in messages()}
    for *_, payload, _, message in found:
        assert message_as_json(message) == message_as_json(by_payload[payload].read())


def test_mcap_ros2_reads_the_same_values(run):
    found = []
    with (run / f"{run.name}_0.mcap").open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        decoded = reader.iter_decoded_messages(log_time_order=False)
        for _, channel, message, content in decoded:
            found.append((channel.topic, message.log_time, _slots(content)))
    assert found == [(m.topic, m.at, message_as_json(m.read())) for m in messages()]


def _slots(value):
    if hasattr(value, "__slots__"):
        return {name: _slots(getattr(value, name)) for name in value.__slots__}
    if isinstance(value, (list, tuple)) and value and hasattr(value[0], "__slots__"):
        return [_slots(item) for item in value]
    return message_as_json(list(value) if isinstance(value, memoryview) else value)


_PACKAGES = (
    "@mcap/core@2.2.2",
    "@foxglove/rosmsg2-serialization@3.1.0",
    "@foxglove/rosmsg@5.0.5",
    "fzstd@0.1.1",
)
_READER = """
const { McapIndexedReader } = require("@mcap/core");
const { MessageReader } = require("@foxglove/rosmsg2-serialization");
const { parse } = require("@foxglove/rosmsg");
const { decompress } = require("fzstd");
const { readFileSync } = require("fs");

function plain(value) {
  if (typeof value === "bigint") return { big: value.toString() };
  if (typeof value === "number" && !Number.isFinite(value))
    return Number.isNaN(value) ? null : value > 0 ? "inf" : "-inf";
  if (ArrayBuffer.isView(value) || Array.isArray(value)) return Array.from(value, plain);
  if (value && typeof value === "object")
    return Object.fromEntries(Object.entries(value).map(([k, v]) => [k, plain(v)]));
  return value;
}

async function main() {
  const data = new Uint8Array(readFileSync(process.argv[2]));
  const readable = {
    size: async () => BigInt(data.length),
    read: async (offset, size) => data.slice(Number(offset), Number(offset + size)),
  };
  const zstd = (bytes, size) => decompress(bytes, new Uint8Array(Number(size)));
  const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers: { zstd } });
  const readers = new Map();
  const found = [];
  for await (const message of reader.readMessages({ validateCrcs: true })) {
    const channel = reader.channelsById.get(message.channelId);
    const schema = reader.schemasById.get(channel.schemaId);
    if (!readers.has(schema.id)) {
      const text = new TextDecoder().decode(schema.data);
      readers.set(schema.id, new MessageReader(parse(text, { ros2: true })));
    }
    const content = plain(readers.get(schema.id).readMessage(message.data));
    found.push([channel.topic, schema.name, message.logTime.toString(), content]);
  }
  console.log(JSON.stringify({ profile: reader.header.profile, found }));
}

main().catch((error) => { console.error(error); process.exit(1); });
"""


@pytest.fixture(scope="session")
def node_modules(tmp_path_factory):
    """A folder where what Foxglove reads bags with is installed."""
    npm, node = shutil.which("npm"), shutil.which("node")
    if npm is None or node is None:
        pytest.skip("there is no node and npm")
    folder = tmp_path_factory.mktemp("npm")
    (folder / "package.json").write_text('{"private": true}')
    quiet = ["--no-audit", "--no-fund", "--no-package-lock", "--ignore-scripts"]
    command = [npm, "install", "--fetch-retries=1", "--fetch-timeout=20000", *quiet, *_PACKAGES]
    try:
        done = subprocess.run(
            command, cwd=folder, capture_output=True, text=True, timeout=60, check=False
        )
    except subprocess.TimeoutExpired:
        pytest.skip("npm did not install within a minute")
    if done.returncode:
        unreachable = ("ENOTFOUND", "EAI_AGAIN", "ETIMEDOUT", "ECONN", "E403", "EIDLETIMEOUT")
        if any(code in done.stderr for code in unreachable):
            pytest.skip("npm cannot reach its registry")
        pytest.fail(done.stderr)
    return folder


@pytest.mark.processes
def test_foxgloves_readers_read_the_same_values(run, node_modules):
    (node_modules / "read.js").write_text(_READER)
    command = ["node", "read.js", str(run / f"{run.name}_0.mcap")]
    done = subprocess.run(
        command, cwd=node_modules, capture_output=True, text=True, timeout=240, check=False
    )
    assert done.returncode == 0, done.stderr
    read = json.loads(done.stdout)
    assert read["profile"] == "ros2"
    expected = [[m.topic, m.type_name, str(m.at), message_as_json(m.read())] for m in messages()]
    assert MARKERS in {each[1] for each in read["found"]}
    found, expected = (
        sorted(json.dumps(_as_python(each), sort_keys=True) for each in values)
        for values in (read["found"], expected)
    )
    assert found == expected


def _as_python(value):
    """Values as JavaScript has them: stamps, large numbers, and one kind of number."""
    if isinstance(value, dict):
        if value.keys() == {"big"}:
            return int(value["big"])
        if value.keys() == {"sec", "nsec"}:
            value = {"sec": value["sec"], "nanosec": value["nsec"]}
        return {name: _as_python(item) for name, item in value.items()}
    if isinstance(value, list):
        return [_as_python(item) for item in value]
    return int(value) if isinstance(value, float) and value.is_integer() else value


# --- cut off -----------------------------------------------------------------------------------


def test_what_is_cut_off_is_read_up_to_the_last_whole_chunk(data, reads):
    drawn = random.Random(5)
    ends = record_ends(data)
    lengths = {*ends, *(end + 1 for end in ends), *(end - 1 for end in ends)}
    lengths |= {drawn.randrange(len(data)) for _ in range(200)}
    chunks = chunk_ends(data)
    sizes = [len(part) for part in parts()]
    for length in sorted(lengths - {len(data)}):
        bag, run = reads(data[:length])
        complete = sum(end <= length for end in chunks)
        assert len(bag.messages) == sum(sizes[:complete])
        assert not bag.whole
        assert bag.fault in {"a truncated file", "an empty file"}
        assert (run is None) is (complete < 2)
        if run is not None:
            assert len(run.progress) == sum(sizes[2:complete][:2])
    bag, run = reads(data)
    assert bag.whole
    assert run.ending.success


def test_something_behind_the_end_is_not_read(data, reads):
    assert reads(data + b"more")[0].whole


def test_empty_and_random_files_are_no_runs(reads):
    drawn = random.Random(6)
    for length in (0, 1, 7, 8, 9, 17, 100, 5000):
        for head in (b"", b"\x89MCAP0\r\n"):
            bag, run = reads((head + drawn.randbytes(length))[:length])
            assert (bag.messages, bag.whole, run) == ((), False, None)


def test_zeros_behind_a_chunk_are_where_it_ends(data, reads):
    for end in chunk_ends(data):
        bag, _ = reads(data[:end] + bytes(3000))
        assert not bag.whole
        assert len(bag.messages) > 0


# --- damaged -----------------------------------------------------------------------------------


def test_damage_anywhere_never_reads_as_something_else(data, reads):
    drawn = random.Random(7)
    for _ in range(200):
        damaged = bytearray(data)
        damaged[drawn.randrange(len(data))] ^= 1 << drawn.randrange(8)
        reads(bytes(damaged))
    for _ in range(100):
        damaged = bytearray(data)
        start, count = drawn.randrange(len(data)), drawn.choice([2, 4, 8, 100, 4096])
        new = drawn.choice([bytes(count), b"\xff" * count, drawn.randbytes(count)])
        damaged[start : start + count] = new[: len(data) - start]
        reads(bytes(damaged))


def test_damage_in_the_head_of_any_record_never_reads_as_something_else(data, reads):
    drawn = random.Random(8)
    for start in record_ends(data)[:-1]:
        for bit in range(8):
            damaged = bytearray(data)
            damaged[start] ^= 1 << bit
            bag, _ = reads(bytes(damaged))
            assert not bag.whole or start >= _data_end(data)
        for place in drawn.sample(range(start + 1, start + 9), 2):
            damaged = bytearray(data)
            damaged[place] = drawn.choice([0x00, 0x01, 0x7F, 0xFF])
            reads(bytes(damaged))


def test_a_chunk_that_is_lost_is_noticed_without_an_end_too(data, reads):
    for start, end in pairwise([0, *chunk_ends(data)]):
        ends = [each for each in record_ends(data) if start <= each < end]
        lost = ends[-1]
        before = len(reads(data[:lost])[0].messages)
        for kind in (*range(16), 0x86, 0xFF):
            if kind == 6:
                continue
            damaged = bytearray(data[: _data_end(data)])
            damaged[lost] = kind
            assert len(reads(bytes(damaged))[0].messages) == before


def _data_end(data):
    """Where the data ends, and its summary begins."""
    ends = record_ends(data)
    return next(end for start, end in pairwise(ends) if data[start] == 0x0F)


@pytest.mark.processes
def test_a_broken_length_takes_no_memory(data, tmp_path):
    files = []
    for k, content in enumerate(_greedy(data)):
        file = tmp_path / f"{k}.mcap"
        file.write_bytes(content)
        files.append(str(file))
    code = """
import resource, sys
from pathlib import Path
from focus_planner.core.validation import InputError
from focus_planner.recording.bag_reading import read_bag
from focus_planner.recording.run_reading import read_run
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
for limit in (None, 1 << 30):
    if limit:
        size = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (size + limit, size + limit))
    for file in sys.argv[1:]:
        assert not read_bag(Path(file)).whole
        try:
            assert read_run(Path(file)).ending is None
        except InputError:
            pass
after = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
print(after - before)
"""
    assert int(_python(code, *files)) < 100_000  # kilobytes


def _greedy(data):
    """Yield the file with lengths that promise gigabytes."""
    chunk = next(start for start, _ in pairwise(record_ends(data)) if data[start] == 6)
    # Where a chunk says: its own length, that of what it holds, and that of its data.
    compressed = chunk + 9 + 8 + 8 + 8 + 4 + 4 + 4
    for place in (chunk + 1, chunk + 9 + 16, compressed):
        for size in (2**31 - 1, 2**33, 2**40, 2**62, 2**63, 2**64 - 1):
            yield data[:place] + struct.pack("<Q", size) + data[place + 8 :]
    start = compressed + 8
    assert data[start : start + 4] == b"\x28\xb5\x2f\xfd"
    for size in (2**33, 2**40, 2**62, 2**64 - 1):
        # A frame in one segment whose size is told in eight bytes, and one with a window.
        yield _with_chunk(data, chunk, b"\x28\xb5\x2f\xfd\xe0" + struct.pack("<Q", size) + bytes(9))
        yield _with_chunk(
            data, chunk, b"\x28\xb5\x2f\xfd\xc0\x60" + struct.pack("<Q", size) + bytes(9)
        )


def _with_chunk(data, start, frame):
    """Return a file whose first chunk is this frame, with all that is before it."""
    body = struct.pack("<QQQI", 0, 0, 2**31, zlib.crc32(b"")) + struct.pack(
        "<I4sQ", 4, b"zstd", len(frame)
    )
    body += frame
    return data[:start] + b"\x06" + struct.pack("<Q", len(body)) + body + data[start:]


@cache
def _environment():
    return {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}


def _python(code, *arguments):
    done = subprocess.run(
        [sys.executable, "-c", code, *arguments],
        capture_output=True,
        text=True,
        timeout=240,
        check=False,
        env=_environment(),
    )
    assert done.returncode == 0, done.stderr
    return done.stdout
