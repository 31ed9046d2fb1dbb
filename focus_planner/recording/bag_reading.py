# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Reading bags, whoever wrote them: sizes that a file declares are capped before they are believed.

What is kept in memory is at most what :class:`Limits` allows, and so is what a chunk unpacks to
while it is read.
"""

from __future__ import annotations

import os
import struct
import zlib
from collections.abc import Callable, Generator, Iterator
from contextlib import suppress
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import BinaryIO

import lz4.frame
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import EndOfFile, InvalidMagic, McapError
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    Channel,
    Chunk,
    DataEnd,
    Header,
    McapRecord,
    MessageIndex,
    Metadata,
    Schema,
)
from mcap.stream_reader import read_magic

from focus_planner.core.validation import InputError
from focus_planner.io.files import open_regular
from focus_planner.recording.bag import BagMessage
from focus_planner.recording.naming import A_RUN

# The records of a file's data section, except chunks and messages.
_READERS: dict[int, Callable[[ReadDataStream], McapRecord]] = {
    Opcode.HEADER: Header.read,
    Opcode.SCHEMA: Schema.read,
    Opcode.CHANNEL: Channel.read,
    Opcode.CHUNK: Chunk.read,
    Opcode.MESSAGE_INDEX: MessageIndex.read,
    Opcode.ATTACHMENT: Attachment.read,
    Opcode.METADATA: Metadata.read,
    Opcode.DATA_END: DataEnd.read,
}
_LONG = {Opcode.CHUNK, Opcode.MESSAGE, Opcode.ATTACHMENT}
_HEAD = struct.Struct("<BQ")  # of a record: opcode, length
_MESSAGE_HEAD = struct.Struct("<HIQQ")  # channel, sequence, log_time, publish_time
_PIECE = 2**20
# Longest record of another kind than those that hold messages or files, in bytes.
_MAX_OTHER = 2**24
# Of all definitions of a file together, and of a name, in bytes.
_MAX_SCHEMAS, _MAX_NAME = 2**24, 1000
_MAX_CHANNELS = 10_000
_MIB = 2**20


class TooLargeError(ValueError):
    """A file declares, or unpacks to, more than is read."""


@dataclass(frozen=True)
class Limits:
    """How much of a file is read.

    Attributes
    ----------
    file : int
        Longest file, bytes.
    piece : int
        Longest record, and longest chunk once it is unpacked, bytes.
    unpacked : int
        All chunks of a file once they are unpacked, bytes.
    ratio, small : int
        The same as a multiple of the file's size, which holds above so many bytes.
    records : int
        Number of records, messages in chunks included.
    passed_over : int
        Longest chunk that is passed over where it is longer than ``piece``, bytes; the first that
        is longer than both is where reading ends.
    """

    file: int = 4096 * _MIB
    piece: int = 1024 * _MIB
    unpacked: int = 4096 * _MIB
    ratio: int = 20
    small: int = 512 * _MIB
    records: int = 1_000_000
    passed_over: int = 0

    def most_unpacked(self, size: int) -> int:
        """Return what a file of this size may unpack to."""
        return min(self.unpacked, max(self.small, self.ratio * size))


#: For a run of any size that is recorded: two surfaces of five million triangles take 1 GB.
RUNS = Limits()


@dataclass(frozen=True)
class Bag:
    """The readable contents of a bag.

    Attributes
    ----------
    messages : tuple of BagMessage
        In the order in which they were written.
    whole : bool
        Whether the file is complete and undamaged.
    fault : str
        What is wrong with it otherwise.
    """

    messages: tuple[BagMessage, ...]
    whole: bool
    fault: str = ""


def read_bag(path: Path) -> Bag:
    """Read a bag up to its end or the first error; checksums are verified.

    Parameters
    ----------
    path : Path
        The bag's folder, or the MCAP file itself.

    Raises
    ------
    InputError
        If there is no such file, or it is larger than any run. A file of another format gives a bag
        without messages and with a fault.
    """
    messages: list[BagMessage] = []
    with open_regular(_mcap_file(path), A_RUN, RUNS.file, may_be_empty=True) as stream:
        reading = BagReading(stream)
        messages.extend(reading)
    return Bag(tuple(messages), not reading.fault, reading.fault)


class BagReading:
    """Iterates over the messages in a stream of MCAP.

    Parameters
    ----------
    stream : BinaryIO
        A file.
    limits : Limits
    wanted : callable, optional
        Returns whether to yield the messages of a topic and type name; all by default.

    Attributes
    ----------
    fault : str
        Once iteration has ended: why that was before the end of the file; empty if it was there.
    cut_off : bool
        Whether the file is that of a writer that was killed: it ends early, and nothing else is
        wrong with it.
    """

    def __init__(
        self,
        stream: BinaryIO,
        limits: Limits = RUNS,
        wanted: Callable[[str, str], bool] = lambda *_: True,
    ) -> None:
        self.fault = ""
        self.cut_off = False
        self._stream = stream
        self._limits = limits
        self._wanted = wanted
        self._size = os.fstat(stream.fileno()).st_size
        self._schemas: dict[int, tuple[str, str]] = {}
        # Topic, type name, definition, and whether its messages are wanted.
        self._channels: dict[int, tuple[str, str, str, bool]] = {}
        self._unpacked = self._records = self._schema_bytes = 0

    @property
    def cost(self) -> int:
        """Return how much work it was so far, about in bytes."""
        return self._unpacked + 1000 * self._records

    def __iter__(self) -> Iterator[BagMessage]:
        """Yield the messages in order, up to the end or the first error."""
        ended = False
        try:
            ended = yield from self._messages()
        except OSError:
            raise
        except Exception as error:  # noqa: BLE001 - the library raises anything for broken bytes
            self.cut_off = isinstance(error, (EndOfFile, struct.error)) or self._size == 0
            self.fault = _fault(error) if self._size else "an empty file"
            return
        if not ended:
            self.cut_off, self.fault = True, "a file without an end"

    def _messages(self) -> Generator[BagMessage, None, bool]:
        chunked = ended = False
        for opcode, body, checksum in self._file_records():
            if ended:  # the summary section repeats schemas and channels
                continue
            if opcode == Opcode.MESSAGE:
                if chunked:
                    raise ValueError("a message outside of a chunk")
                self._take(len(body))
                yield from self._message(memoryview(body))
                continue
            record = _parsed(opcode, body)
            if isinstance(record, DataEnd):
                if checksum is not None and record.data_section_crc not in {0, checksum}:
                    raise ValueError("the checksum of the data section does not match")
                ended = True
            elif isinstance(record, Chunk):
                chunked = True
                yield from self._chunk_messages(record)
            else:
                self._note(record)
        return ended

    def _file_records(self) -> Iterator[tuple[int, bytes, int | None]]:
        """Yield each record's opcode and body, and the checksum of all bytes before it.

        The checksum is None once something was passed over.

        The library's own reader skips unknown records and excess bytes, and would thus overlook
        damage, and lose a chunk with it.
        """
        data = ReadDataStream(self._stream, calculate_crc=True)
        read_magic(data)
        skipped = opcode = 0
        while opcode != Opcode.FOOTER:
            self._count()
            checksum = data.checksum()
            opcode, length = data.read1(), data.read8()
            if length > self._size - data.count - skipped:
                raise EndOfFile
            if opcode == Opcode.CHUNK and self._is_passed_over(length):
                self._stream.seek(length, os.SEEK_CUR)
                skipped += length
                continue
            longest = self._limits.piece if opcode in _LONG else _MAX_OTHER
            if length > longest:
                raise TooLargeError(f"a record of {length:,} bytes, not up to {longest:,}")
            yield opcode, data.read(length), None if skipped else checksum
        read_magic(data)

    def _chunk_messages(self, chunk: Chunk) -> Iterator[BagMessage]:
        declared = chunk.uncompressed_size
        if self._is_passed_over(declared):
            return
        longest = max(self._limits.piece, self._limits.passed_over)
        if declared > longest:
            raise TooLargeError(f"a chunk that declares {declared:,} bytes, not up to {longest:,}")
        self._take(declared)
        content = memoryview(_unpacked(chunk))
        if chunk.uncompressed_crc not in {0, zlib.crc32(content)}:
            raise ValueError("the checksum of a chunk does not match")
        at = 0
        while at < len(content):
            self._count()
            opcode, length = _HEAD.unpack_from(content, at)
            at += _HEAD.size
            body = content[at : at + length]
            if len(body) != length:
                raise EndOfFile
            at += length
            if opcode == Opcode.MESSAGE:
                yield from self._message(body)
            elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                self._note(_parsed(opcode, bytes(body)))

    def _is_passed_over(self, size: int) -> bool:
        return self._limits.piece < size <= self._limits.passed_over

    def _message(self, body: memoryview) -> Iterator[BagMessage]:
        channel, _, at, _ = _MESSAGE_HEAD.unpack_from(body)
        topic, type_name, definition, wanted = self._channels[channel]
        if wanted:
            payload = bytes(body[_MESSAGE_HEAD.size :])
            yield BagMessage(topic, type_name, payload, at, definition)

    def _note(self, record: McapRecord) -> None:
        """Keep a schema or a channel."""
        if isinstance(record, Schema):
            self._schema_bytes += len(record.data)
            if self._schema_bytes > _MAX_SCHEMAS:
                raise TooLargeError(f"definitions of more than {_MAX_SCHEMAS:,} bytes")
            _check_name(record.name)
            self._schemas[record.id] = record.name, record.data.decode()
        elif isinstance(record, Channel):
            _check_name(record.topic)
            name, definition = self._schemas[record.schema_id]
            wanted = self._wanted(record.topic, name)
            self._channels[record.id] = record.topic, name, definition, wanted
            if len(self._channels) > _MAX_CHANNELS:
                raise TooLargeError(f"more than {_MAX_CHANNELS:,} topics")

    def _take(self, size: int) -> None:
        """Count bytes before they are unpacked."""
        self._unpacked += size
        most = self._limits.most_unpacked(self._size)
        if self._unpacked > most:
            raise TooLargeError(f"{self._size:,} bytes that unpack to more than {most:,}")

    def _count(self) -> None:
        self._records += 1
        if self._records > self._limits.records:
            raise TooLargeError(f"more than {self._limits.records:,} records")


def _check_name(name: str) -> None:
    if len(name) > _MAX_NAME:
        raise TooLargeError(f"a name of {len(name):,} characters")


def _unpacked(chunk: Chunk) -> bytes:
    """Return the content of a chunk; no more of it is made than the chunk declares."""
    if chunk.compression == "":
        content = chunk.data
    elif chunk.compression == "zstd":
        content = _unzstd(chunk.data, chunk.uncompressed_size)
    elif chunk.compression == "lz4":
        content = _unlz4(chunk.data, chunk.uncompressed_size)
    else:
        raise ValueError(f"a chunk of unknown compression {chunk.compression[:20]!r}")
    if len(content) != chunk.uncompressed_size:
        raise ValueError(f"a chunk of another size than the {chunk.uncompressed_size:,} declared")
    return content


def _unzstd(data: bytes, size: int) -> bytes:
    # Not decompress(), which takes the size that the data itself declares.
    with zstandard.ZstdDecompressor().stream_reader(data) as reader:
        return _joined(reader.read, size)


def _unlz4(data: bytes, size: int) -> bytes:
    with lz4.frame.LZ4FrameFile(BytesIO(data)) as reader:
        return _joined(reader.read, size)


def _joined(read: Callable[[int], bytes], size: int) -> bytes:
    """Return what can be read, up to one byte more than ``size``."""
    pieces = []
    left = size + 1
    while left and (piece := read(min(left, _PIECE))):
        pieces.append(piece)
        left -= len(piece)
    return b"".join(pieces)


def _parsed(opcode: int, body: bytes) -> McapRecord:
    """Parse a record of the data section."""
    data = ReadDataStream(BytesIO(body))
    if opcode not in _READERS:
        raise ValueError(f"a record of unknown kind {opcode}")
    record = _READERS[opcode](data)
    if data.count != len(body):
        raise ValueError("a record with a wrong length")
    return record


def _fault(error: Exception) -> str:
    if isinstance(error, InvalidMagic):
        return "a file that is damaged, or not an MCAP file"
    if isinstance(error, (EndOfFile, struct.error)):
        return "a truncated file"
    if isinstance(error, TooLargeError):
        return f"more than is read: {error}"
    kind = "" if isinstance(error, (McapError, ValueError)) else f"{type(error).__name__}: "
    return " ".join(f"a damaged file: {kind}{error}".split())[:200]


def _mcap_file(path: Path) -> Path:
    """Return the MCAP file of a run's folder; another path as it is."""
    try:
        files = sorted(path.glob("*.mcap")) if path.is_dir() else None
        if files is None and not path.exists():
            raise InputError(str(path), "a recorded run", "no such folder or file")
    except OSError as error:
        raise InputError(str(path), "a recorded run", error.strerror or str(error)) from None
    if files is None:
        return path
    if len(files) != 1:
        what = f"a folder with {len(files)} of them" if files else "a folder without one"
        raise InputError(str(path), "the folder of a run with one .mcap file", what, _within(path))
    return files[0]


def _within(path: Path) -> str:
    """Return what to do about a folder of runs; nothing if it is none."""
    with suppress(OSError):
        runs = sorted(file.parent.name for file in path.glob("[!.]*/*.mcap"))
        if runs:
            return f"name one of the runs in it, such as {path / runs[-1]}"
    return ""
