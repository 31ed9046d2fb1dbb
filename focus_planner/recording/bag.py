# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Writing bags in rosbag2's format: a folder with one MCAP file and ``metadata.yaml``.

While a bag is being written its folder's name ends in ``.partial`` and it has no
``metadata.yaml``. After a crash or power failure it can be read up to its last complete chunk.
"""

from __future__ import annotations

import os
import shutil
import sys
from collections import Counter
from contextlib import suppress
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from textwrap import indent
from typing import IO, Any, BinaryIO, cast

import yaml
from mcap.writer import CompressionType, Writer

from focus_planner.io.file_locks import lock_file, locked_folder
from focus_planner.messages.reading import Message
from focus_planner.messages.typestore import definition_of, deserialize, type_hash
from focus_planner.recording.access import create_file, give_access, make_folder, make_parent
from focus_planner.recording.naming import METADATA, PARTIAL, mcap_name

_ROSBAG2_VERSION = 9  # of ROS 2 Jazzy
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
        self._access = "owner"

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

    def open(self, folder: Path, access: str = "owner") -> None:
        """Continue in a file, in a new folder with the suffix ``.partial`` for now.

        A bag that already has a folder is moved.

        Parameters
        ----------
        folder : Path
        access : {"owner", "group", "all"}
            Who may read the bag, and the folder of the folder if that is made.

        Raises
        ------
        FileExistsError
            If the folder exists, partial or complete: nothing is ever overwritten.
        """
        if folder.exists():
            raise FileExistsError(f"{folder} exists")
        make_parent(folder.parent, access)
        self._access = access
        if self._folder is not None:
            self._move(self._folder, folder)
            return
        partial = folder.with_name(folder.name + PARTIAL)
        make_folder(partial, access)
        self._folder = folder
        # Locks tell other processes, for as long as this one lives, that the bag is being written:
        # that of the folder until there is a file with one.
        with locked_folder(partial):
            file = create_file(partial / mcap_name(folder.name), access)
            with suppress(OSError):  # some file systems have no locks
                lock_file(file)  # waits while another process probes the lock
        self._stream.continue_in(file)

    def sync(self) -> None:
        """Return once all messages added so far are on the disk itself."""
        self.flush()
        self._stream.sync()
        _sync_folder(self._partial)
        _sync_folder(self._partial.parent)

    def close(self) -> Path:
        """Write indices and ``metadata.yaml``, and return the folder under its final name.

        By then all of it is on the disk itself: the files, their names and that of the folder.
        """
        assert self._folder is not None
        partial, folder = self._partial, self._folder
        information = yaml.safe_dump(self._information(), sort_keys=False)
        self._writer.add_metadata("rosbag2", {"serialized_metadata": information})
        self._writer.finish()
        with locked_folder(partial):  # the file's lock ends when it is closed
            self._stream.sync()
            self._stream.close()
            with create_file(partial / METADATA, self._access) as file:
                text = "rosbag2_bagfile_information:\n" + indent(information, "  ")
                file.write(text.encode())
                file.flush()
                os.fsync(file.fileno())
            _sync_folder(partial)
            partial.rename(folder)
            _sync_folder(folder.parent)
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
        (self._partial / mcap_name(old.name)).rename(self._partial / mcap_name(new.name))
        self._partial.rename(partial)
        self._folder = new
        for path in (partial, partial / mcap_name(new.name)):
            give_access(path, self._access)

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
        name = mcap_name(self._folder.name)
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


def _deep_copy(value: dict[str, Any]) -> dict[str, Any]:
    return {k: _deep_copy(v) if isinstance(v, dict) else v for k, v in value.items()}


def _sync_folder(folder: Path) -> None:
    """Flush a folder's entries to the disk."""
    if sys.platform == "win32":  # which opens no folders, and keeps a journal of their entries
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
