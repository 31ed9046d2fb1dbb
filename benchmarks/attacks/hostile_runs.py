# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Runs made to harm whoever reads them: each a folder with an MCAP file and ``metadata.yaml``."""

from __future__ import annotations

import os
import struct
from collections.abc import Callable
from io import BytesIO
from pathlib import Path

import lz4.frame
import yaml
import zstandard
from mcap.writer import CompressionType, Writer

from focus_planner.messages.typestore import PLAN, definition_of, serialize

_MAGIC = b"\x89MCAP0\r\n"
_CHUNK = 6
_SCHEMA = 1
_PLAN_ID = "20990102T030405.000001Z-0123abcd"
_AT = 4_070_995_445_000_001_000
_BOMB = 3 * 2**30
_CAMERA = {
    "name": "cam_0_00",
    "plan_id": _PLAN_ID,
    "status": 1,
    "focus_distance": 0.7,
    "dioptres": 1.4,
    "near_limit": 0.6,
    "far_limit": 0.9,
    "bracket": [0.7],
}


def write(kind: str, directory: Path, planner: str) -> Path:
    """Write a run of a kind, newer than any other, as of a planner; return its folder."""
    folder = directory / _PLAN_ID
    folder.mkdir(parents=True)
    KINDS[kind](folder, f"{planner}/focus_plan")
    return folder


def _plan(camera: dict[str, object], **fields: object) -> bytes:
    fields = {"plan_id": _PLAN_ID, "method": "em", "cost": 1.0, "samples": 200} | fields
    return serialize(PLAN, {**fields, "cameras": [_CAMERA | camera]})


def _mcap(topic: str, payload: bytes, definition: str = "", type_name: str = PLAN) -> bytes:
    stream = BytesIO()
    writer = Writer(stream, compression=CompressionType.NONE)
    writer.start(profile="ros2")
    text = definition or definition_of(PLAN)
    schema = writer.register_schema(type_name, "ros2msg", text.encode())
    channel = writer.register_channel(topic, "cdr", schema)
    writer.add_message(channel, log_time=_AT, data=payload, publish_time=_AT)
    writer.finish()
    return stream.getvalue()


def _metadata(topic: str) -> str:
    topics = [{"topic_metadata": {"name": topic, "type": PLAN}, "message_count": 1}]
    information = {"version": 9, "storage_identifier": "mcap", "topics_with_message_count": topics}
    return yaml.safe_dump({"rosbag2_bagfile_information": information})


def _put(folder: Path, topic: str, data: bytes, metadata: str = "") -> None:
    (folder / f"{folder.name}_0.mcap").write_bytes(data)
    (folder / "metadata.yaml").write_text(metadata or _metadata(topic))


def _with_camera(**camera: object) -> Callable[[Path, str], None]:
    return lambda folder, topic: _put(folder, topic, _mcap(topic, _plan(camera)))


def _with_plan(**plan: object) -> Callable[[Path, str], None]:
    return lambda folder, topic: _put(folder, topic, _mcap(topic, _plan({}, **plan)))


def _with_definition(line: str) -> Callable[[Path, str], None]:
    """Embed a definition of the plan whose field ``cameras`` is another."""

    def make(folder: Path, topic: str) -> None:
        text = definition_of(PLAN).replace("CameraFocus[] cameras", line)
        lines = [
            line if one.endswith("] cameras") and "CameraFocus" in one else one
            for one in text.splitlines()
        ]
        payload = _plan({}) + b"\xff\xff\xff\x7f" * 64
        _put(folder, topic, _mcap(topic, payload, "\n".join(lines)))

    return make


def _with_metadata(text: str) -> Callable[[Path, str], None]:
    return lambda folder, topic: _put(folder, topic, _mcap(topic, _plan({})), text)


def _aliases() -> str:
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]" for i in range(1, 9)]
    return "\n".join([*lines, "rosbag2_bagfile_information: *a8", ""])


def _fifo(which: str) -> Callable[[Path, str], None]:
    def make(folder: Path, topic: str) -> None:
        _put(folder, topic, _mcap(topic, _plan({})))
        path = folder / which.format(folder.name)
        path.unlink()
        os.mkfifo(path)

    return make


def _huge(which: str) -> Callable[[Path, str], None]:
    """Put a file of 40 GB that takes no room on the disk."""

    def make(folder: Path, topic: str) -> None:
        _put(folder, topic, _mcap(topic, _plan({})))
        with (folder / which.format(folder.name)).open("r+b") as file:
            file.truncate(40 * 10**9)

    return make


def _record(opcode: int, content: bytes) -> bytes:
    return struct.pack("<BQ", opcode, len(content)) + content


def _text(text: str) -> bytes:
    return struct.pack("<I", len(text)) + text.encode()


def _with_chunk(compression: str, declared: int, data: bytes) -> Callable[[Path, str], None]:
    """Put a chunk that unpacks to more than a machine's memory, or says so."""

    def make(folder: Path, topic: str) -> None:
        chunk = struct.pack("<QQQI", 0, _AT, declared, 0) + _text(compression)
        chunk += struct.pack("<Q", len(data)) + data
        header = _record(1, _text("ros2") + _text("attack"))
        end = _record(15, struct.pack("<I", 0)) + _record(2, struct.pack("<QQI", 0, 0, 0))
        _put(folder, topic, _MAGIC + header + _record(_CHUNK, chunk) + end + _MAGIC)

    return make


def _zeros(compressor: Callable[[], object]) -> bytes:
    """Return zeros, compressed piece by piece."""
    pack = compressor()
    piece = bytes(2**24)
    parts = [pack.begin()] if hasattr(pack, "begin") else []
    parts += [pack.compress(piece) for _ in range(_BOMB // len(piece))]
    return b"".join([*parts, pack.flush()])


def _bomb(compression: str, declared: int = _BOMB) -> Callable[[Path, str], None]:
    makers = {
        "zstd": lambda: zstandard.ZstdCompressor(level=3).compressobj(),
        "lz4": lz4.frame.LZ4FrameCompressor,
    }

    def make(folder: Path, topic: str) -> None:
        _with_chunk(compression, declared, _zeros(makers[compression]))(folder, topic)

    return make


#: By what makes them hostile.
KINDS: dict[str, Callable[[Path, str], None]] = {
    "a camera's name that makes no topic": _with_camera(name="a b/../é\n"),
    "an empty name of a camera": _with_camera(name=""),
    "a name of 100,000 letters": _with_camera(name="y" * 100_000),
    "a distance of NaN": _with_camera(focus_distance=float("nan")),
    "a distance of -5 m": _with_camera(focus_distance=-5.0, near_limit=-5.0),
    "an infinite cost and a bracket of -inf": _with_camera(bracket=[float("-inf")]),
    "an unknown status": _with_camera(status=250),
    "a plan of another id": _with_plan(plan_id="../../etc"),
    "a definition with uint8[] cameras": _with_definition("uint8[] cameras"),
    "a definition with string[100000000] cameras": _with_definition("string[100000000] cameras"),
    "a definition with float64[2000000000] cameras": _with_definition(
        "float64[2000000000] cameras"
    ),
    "a definition that holds itself": _with_definition("FocusPlan[] cameras"),
    "a metadata.yaml of 100,000 [": _with_metadata("[" * 100_000),
    "a metadata.yaml of 100,000 {a: ": _with_metadata("{a: " * 100_000),
    "a metadata.yaml of nine levels of aliases": _with_metadata(_aliases()),
    "a FIFO as the MCAP file": _fifo("{}_0.mcap"),
    "a FIFO as metadata.yaml": _fifo("metadata.yaml"),
    "an MCAP file of 40 GB": _huge("{}_0.mcap"),
    "a metadata.yaml of 40 GB": _huge("metadata.yaml"),
    "a zstd chunk that unpacks to 3 GB": _bomb("zstd"),
    "a zstd chunk that unpacks to 3 GB and declares 1 kB": _bomb("zstd", 1000),
    "an lz4 chunk that unpacks to 3 GB": _bomb("lz4"),
    "a chunk that declares 2^62 bytes": _with_chunk("zstd", 2**62, b"\x28\xb5\x2f\xfd" * 9),
    "a message that declares 2^32 - 1 cameras": lambda folder, topic: _put(
        folder, topic, _mcap(topic, serialize(PLAN, {"plan_id": _PLAN_ID})[:-4] + b"\xff" * 4)
    ),
}
