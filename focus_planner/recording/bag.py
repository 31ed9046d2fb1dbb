"""Bags in rosbag2's format: a folder with one MCAP file and ``metadata.yaml``.

While a bag is being written its folder's name ends in ``.partial`` and it has no
``metadata.yaml``. After a crash or power failure it can be read up to its last complete chunk.
"""

from __future__ import annotations

import fcntl
import os
import shutil
import struct
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from textwrap import indent
from typing import IO, Any, BinaryIO, cast

import yaml
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
from mcap.records import Message as MessageRecord
from mcap.stream_reader import breakup_chunk, read_magic
from mcap.writer import CompressionType, Writer

from focus_planner.core.validation import InputError
from focus_planner.messages.reading import Message
from focus_planner.messages.typestore import definition_of, deserialize, type_hash

PARTIAL = ".partial"
METADATA = "metadata.yaml"
_ROSBAG2_VERSION = 9  # of ROS 2 Jazzy
# The records of a file's data section, except messages.
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
_FOREVER = {"sec": 9223372036, "nsec": 854775807}
#: The QoS of the planner's topics, with which a bag is played back: late subscribers get it all.
_LATCHED = {
    "history": "keep_last",
    "depth": 1,
    "reliability": "reliable",
    "durability": "transient_local",
    "deadline": _FOREVER,
    "lifespan": _FOREVER,
    "liveliness": "automatic",
    "liveliness_lease_duration": _FOREVER,
    "avoid_ros_namespace_conventions": False,
}
_LATCHED_YAML = yaml.safe_dump([_LATCHED], sort_keys=False)


@dataclass(frozen=True)
class BagMessage:
    """A message in a bag.

    Attributes
    ----------
    topic, type_name : str
    payload : bytes
        CDR.
    at : int
        When it was received or created, nanoseconds since the epoch.
    definition : str
        The definition of its type; the one known here if empty.
    """

    topic: str
    type_name: str
    payload: bytes = field(repr=False)
    at: int
    definition: str = field(default="", repr=False)

    def read(self) -> Message:
        """Return the deserialized message.

        Raises
        ------
        InputError
            If the payload is not of this type.
        """
        return deserialize(self.type_name, self.payload, self.definition or None)


class BagWriter:
    """Writes a bag, in memory until it is opened in a folder.

    Any method may raise ``OSError``; call :meth:`abandon` then.
    """

    def __init__(self) -> None:
        self._stream = _Stream()
        self._writer: Any = Writer(
            cast(IO[Any], self._stream), compression=CompressionType.ZSTD, enable_data_crcs=True
        )
        self._writer.start(profile="ros2")
        self._schemas: dict[tuple[str, str], int] = {}
        self._channels: dict[str, int] = {}
        self._types: dict[str, str] = {}
        self._counts: Counter[str] = Counter()
        self._first, self._last = 2**63 - 1, 0
        self._folder: Path | None = None

    def add(self, message: BagMessage) -> None:
        """Append a message."""
        if message.topic not in self._channels:
            self._channels[message.topic] = self._new_channel(message)
            self._types[message.topic] = message.type_name
        self._writer.add_message(
            self._channels[message.topic],
            log_time=message.at,
            data=message.payload,
            publish_time=message.at,
            sequence=self._counts[message.topic],
        )
        self._counts[message.topic] += 1
        self._first, self._last = min(self._first, message.at), max(self._last, message.at)

    def flush(self) -> None:
        """End the chunk: compress all messages added so far, and write them if there is a file."""
        self._writer.flush()
        self._stream.flush()

    def open(self, folder: Path) -> None:
        """Continue in a file, in a new folder with the suffix ``.partial`` for now.

        A bag that already has a folder is moved.

        Raises
        ------
        FileExistsError
            If the folder exists, partial or complete: nothing is ever overwritten.
        """
        if folder.exists():
            raise FileExistsError(f"{folder} exists")
        partial = folder.with_name(folder.name + PARTIAL)
        folder.parent.mkdir(parents=True, exist_ok=True)
        if self._folder is not None:
            self._move(self._folder, folder)
            return
        partial.mkdir()
        self._folder = folder
        # Locks tell other processes, for as long as this one lives, that the bag is being written:
        # that of the folder until there is a file with one.
        with _locked_folder(partial):
            file = (partial / _mcap_name(folder)).open("xb")
            with suppress(OSError):  # some file systems have no locks
                fcntl.flock(file, fcntl.LOCK_EX)  # waits while another process probes the lock
        self._stream.continue_in(file)

    def sync(self) -> None:
        """Return once all messages added so far are on the disk itself."""
        self.flush()
        self._stream.sync()
        _sync_folder(self._partial)
        _sync_folder(self._partial.parent)

    def close(self) -> Path:
        """Write indices and ``metadata.yaml``, and return the folder under its final name."""
        assert self._folder is not None
        partial, folder = self._partial, self._folder
        information = yaml.safe_dump(self._information(), sort_keys=False)
        self._writer.add_metadata("rosbag2", {"serialized_metadata": information})
        self._writer.finish()
        self._stream.sync()
        with (partial / METADATA).open("xb") as file:
            text = "rosbag2_bagfile_information:\n" + indent(information, "  ")
            file.write(text.encode())
            file.flush()
            os.fsync(file.fileno())
        _sync_folder(partial)
        partial.rename(folder)
        _sync_folder(folder.parent)
        self._stream.close()
        return folder

    def abandon(self) -> None:
        """Leave the bag as it is, partial."""
        with suppress(OSError):  # closing tries to write what could not be written before
            self._stream.close()

    def discard(self) -> None:
        """Delete the bag, which must not be used any more."""
        self.abandon()
        if self._folder is not None and self.exists:
            shutil.rmtree(self._partial)

    @property
    def exists(self) -> bool:
        """Whether the bag's partial folder still exists."""
        return self._folder is not None and self._partial.is_dir()

    @property
    def size(self) -> int:
        """Bytes written so far."""
        return self._stream.tell()

    def _move(self, old: Path, new: Path) -> None:
        partial = new.with_name(new.name + PARTIAL)
        if partial.exists():
            raise FileExistsError(f"{partial} exists")
        (self._partial / _mcap_name(old)).rename(self._partial / _mcap_name(new))
        self._partial.rename(partial)
        self._folder = new

    @property
    def _partial(self) -> Path:
        assert self._folder is not None
        return self._folder.with_name(self._folder.name + PARTIAL)

    def _new_channel(self, message: BagMessage) -> int:
        name = message.type_name
        definition = message.definition or definition_of(name)
        if (name, definition) not in self._schemas:
            schema = self._writer.register_schema(name, "ros2msg", definition.encode())
            self._schemas[name, definition] = schema
        metadata = {
            "offered_qos_profiles": _LATCHED_YAML,
            "topic_type_hash": type_hash(name),
        }
        schema = self._schemas[name, definition]
        channel: int = self._writer.register_channel(message.topic, "cdr", schema, metadata)
        return channel

    def _information(self) -> dict[str, Any]:
        """Return the contents of ``metadata.yaml``."""
        assert self._folder is not None
        times = {
            "starting_time": {"nanoseconds_since_epoch": min(self._first, self._last)},
            "duration": {"nanoseconds": max(self._last - self._first, 0)},
            "message_count": self._counts.total(),
        }
        name = _mcap_name(self._folder)
        return {
            "version": _ROSBAG2_VERSION,
            "storage_identifier": "mcap",
            **times,
            "topics_with_message_count": [
                {
                    "topic_metadata": {
                        "name": topic,
                        "type": type_name,
                        "serialization_format": "cdr",
                        # A copy, because YAML would turn repeated objects into references.
                        "offered_qos_profiles": [_deep_copy(_LATCHED)],
                        "type_description_hash": type_hash(type_name),
                    },
                    "message_count": self._counts[topic],
                }
                for topic, type_name in self._types.items()
            ],
            "compression_format": "",
            "compression_mode": "",
            "relative_file_paths": [name],
            "files": [{"path": name, **_deep_copy(times)}],
            "custom_data": None,
            "ros_distro": "jazzy",
        }


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
        If there is no such file. A file of another format gives a bag without messages and with a
        fault.
    """
    file = _mcap_file(path)
    messages: list[BagMessage] = []
    try:
        with file.open("rb") as stream:
            ended = _read_into(messages, stream)
    except OSError as error:
        raise InputError(
            str(file), "a file that can be read", error.strerror or str(error)
        ) from None
    except Exception as error:  # noqa: BLE001 - the library raises anything for broken bytes
        if not messages and file.stat().st_size == 0:
            return Bag((), False, "an empty file")
        return Bag(tuple(messages), False, _fault(error))
    if not ended:
        return Bag(tuple(messages), False, "a file without an end")
    return Bag(tuple(messages), True)


def bag_size(folder: Path) -> int:
    """Return the total size of a bag's files, bytes."""
    return sum(file.stat().st_size for file in folder.iterdir() if file.is_file())


def being_written(folder: Path) -> bool:
    """Return whether any process is writing this partial bag."""
    with _locked_folder(folder, fcntl.LOCK_NB) as locked:
        if not locked:
            return True
    for file in folder.glob("*.mcap"):
        with file.open("rb") as stream:
            try:
                fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                return True
    return False


@contextmanager
def _locked_folder(folder: Path, how: int = 0) -> Iterator[bool]:
    """Hold the lock of a folder; yield whether it could be locked."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | how)
    except BlockingIOError:
        yield False
    except OSError:  # some file systems have no locks
        yield True
    else:
        yield True
    finally:
        os.close(descriptor)


class _Stream:
    """The stream that the MCAP writer writes to: memory at first, later a file."""

    def __init__(self) -> None:
        self._target: BinaryIO = BytesIO()
        self._position = 0

    def write(self, data: bytes) -> int:
        self._position += len(data)
        self._target.write(data)
        return len(data)

    def tell(self) -> int:
        return self._position

    def flush(self) -> None:
        self._target.flush()

    def continue_in(self, file: BinaryIO) -> None:
        memory = self._target
        assert isinstance(memory, BytesIO)
        self._target = file
        file.write(memory.getbuffer())

    def sync(self) -> None:
        self._target.flush()
        os.fsync(self._target.fileno())

    def close(self) -> None:
        self._target.close()


def _read_into(messages: list[BagMessage], stream: BinaryIO) -> bool:
    """Append the messages of a stream; return whether its data section has an end."""
    schemas: dict[int, Schema] = {}
    channels: dict[int, Channel] = {}
    chunked = ended = False
    for opcode, body, checksum in _records(stream):
        if ended:  # the summary section repeats schemas and channels
            continue
        record = _record(opcode, body)
        if isinstance(record, MessageRecord) and chunked:
            raise ValueError("a message outside of a chunk")
        if isinstance(record, DataEnd):
            if record.data_section_crc not in {0, checksum}:
                raise ValueError("the checksum of the data section does not match")
            ended = True
        elif isinstance(record, Chunk):
            chunked = True
            for each in breakup_chunk(record, validate_crc=True):
                _collect(each, schemas, channels, messages)
        else:
            _collect(record, schemas, channels, messages)
    return ended


def _collect(
    record: McapRecord,
    schemas: dict[int, Schema],
    channels: dict[int, Channel],
    messages: list[BagMessage],
) -> None:
    if isinstance(record, Schema):
        schemas[record.id] = record
    elif isinstance(record, Channel):
        channels[record.id] = record
    elif isinstance(record, MessageRecord):
        channel = channels[record.channel_id]
        schema = schemas[channel.schema_id]
        text = schema.data.decode()
        messages.append(BagMessage(channel.topic, schema.name, record.data, record.log_time, text))


def _records(stream: BinaryIO) -> Iterator[tuple[int, bytes, int]]:
    """Yield each record's opcode and body, and the checksum of all bytes before it.

    The library's own reader skips unknown records and excess bytes, and would thus overlook
    damage, and lose a chunk with it.
    """
    size = os.fstat(stream.fileno()).st_size
    data = ReadDataStream(stream, calculate_crc=True)
    read_magic(data)
    opcode = 0
    while opcode != Opcode.FOOTER:
        checksum = data.checksum()
        opcode, length = data.read1(), data.read8()
        if length > size - data.count:
            raise EndOfFile
        yield opcode, data.read(length), checksum
    read_magic(data)


def _record(opcode: int, body: bytes) -> McapRecord:
    """Parse a record of the data section."""
    data = ReadDataStream(BytesIO(body))
    record: McapRecord
    if opcode == Opcode.MESSAGE:
        record = MessageRecord.read(data, len(body))
    elif opcode in _READERS:
        record = _READERS[opcode](data)
    else:
        raise ValueError(f"a record of unknown kind {opcode}")
    if data.count != len(body):
        raise ValueError("a record with a wrong length")
    return record


def _fault(error: Exception) -> str:
    if isinstance(error, InvalidMagic):
        return "a file that is damaged, or not an MCAP file"
    if isinstance(error, (EndOfFile, struct.error)):
        return "a truncated file"
    kind = "" if isinstance(error, (McapError, ValueError)) else f"{type(error).__name__}: "
    return " ".join(f"a damaged file: {kind}{error}".split())[:200]


def _mcap_file(path: Path) -> Path:
    try:
        if path.is_file():
            return path
        files = sorted(path.glob("*.mcap")) if path.is_dir() else None
    except OSError as error:
        raise InputError(str(path), "a recorded run", error.strerror or str(error)) from None
    if files is None:
        raise InputError(str(path), "a recorded run", "no such folder or file")
    if len(files) != 1:
        what = f"a folder with {len(files)} of them" if files else "a folder without one"
        raise InputError(str(path), "the folder of a run with one .mcap file", what)
    return files[0]


def _mcap_name(folder: Path) -> str:
    return f"{folder.name}_0.mcap"


def _deep_copy(value: dict[str, Any]) -> dict[str, Any]:
    return {k: _deep_copy(v) if isinstance(v, dict) else v for k, v in value.items()}


def _sync_folder(folder: Path) -> None:
    """Flush a folder's entries to the disk."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
