# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Messages of many points in CDR, read and written as flat arrays: ``shape_msgs/Mesh`` and others.

The generated classes make a Python object of every triangle and every vertex, which takes 0.3 s
for a body; NumPy reads the same bytes as two arrays. The layout is plain CDR (XCDR1): a header of
four bytes, then every primitive aligned to its own size relative to the end of that header.
"""

from __future__ import annotations

import struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

from focus_planner.core.validation import InputError

_ENCAPSULATION = 4
_BYTE_ORDERS = {b"\x00\x00": ">", b"\x00\x01": "<"}
# Bytes that a writer may add to fill the last word.
_MAX_PADDING = 3
_INDICES = 3
_COORDINATES = 3
_STAMP = 8


def read_mesh(payload: bytes) -> tuple[NDArray[np.uint32], NDArray[np.float64]]:
    """Return the (T, 3) triangles and the (V, 3) vertices of a serialized mesh.

    The arrays are views of ``payload``, in its byte order.

    Raises
    ------
    InputError
        If these are not the bytes of a mesh.
    """
    order = _BYTE_ORDERS.get(bytes(payload[:2]))
    if order is None or len(payload) < _ENCAPSULATION:
        raise InputError(
            "mesh message",
            "shape_msgs/msg/Mesh in plain CDR",
            f"{len(payload)} bytes that begin with {bytes(payload[:4]).hex() or 'nothing'}",
        )
    triangles, end = _read_rows(payload, _ENCAPSULATION, order + "u4", _INDICES, "triangles")
    vertices, end = _read_rows(payload, end, order + "f8", _COORDINATES, "vertices")
    if len(payload) - end > _MAX_PADDING:
        raise InputError(
            "mesh message", f"{end} bytes, according to its counts", f"{len(payload)} bytes"
        )
    return triangles, vertices


def header_stamp(payload: bytes) -> tuple[int, int]:
    """Return seconds and nanoseconds of the header that a serialized message begins with.

    Zero where these are not the bytes of such a message.
    """
    order = _BYTE_ORDERS.get(bytes(payload[:2]))
    if order is None or len(payload) < _ENCAPSULATION + _STAMP:
        return 0, 0
    seconds, nanoseconds = struct.unpack_from(order + "iI", payload, _ENCAPSULATION)
    return seconds, nanoseconds


def header_frame(payload: bytes) -> str:
    """Return the frame of the header that a serialized message begins with.

    Empty where these are not the bytes of such a message.
    """
    order = _BYTE_ORDERS.get(bytes(payload[:2]))
    start = _ENCAPSULATION + _STAMP + 4
    if order is None or len(payload) < start:
        return ""
    length = struct.unpack_from(order + "I", payload, start - 4)[0]
    name = bytes(payload[start : start + length])
    # The length counts the zero at its end.
    return name[:-1].decode(errors="replace") if 0 < length == len(name) else ""


def length_after_header(payload: bytes) -> int:
    """Return the length of the sequence that follows the header of a serialized message.

    Zero where these are not the bytes of such a message.
    """
    order = _BYTE_ORDERS.get(bytes(payload[:2]))
    start = _ENCAPSULATION + _STAMP
    if order is None or len(payload) < start + 4:
        return 0
    # The name of the frame, padded to a whole word.
    start += 4 + struct.unpack_from(order + "I", payload, start)[0]
    start += -start % 4
    if len(payload) < start + 4:
        return 0
    length: int = struct.unpack_from(order + "I", payload, start)[0]
    return length


def write_mesh(
    triangles: NDArray[np.int32], vertices: NDArray[np.float64], *, big_endian: bool = False
) -> bytes:
    """Return the serialized mesh of (T, 3) triangles and (V, 3) vertices."""
    writer = CdrWriter(big_endian=big_endian)
    writer.rows(triangles, "u4")
    writer.rows(vertices, "f8")
    return writer.payload()


class CdrWriter:
    """Writes a message value by value, in the order of its definition.

    Parameters
    ----------
    big_endian : bool
    """

    def __init__(self, *, big_endian: bool = False) -> None:
        self._order = ">" if big_endian else "<"
        self._parts = [b"\x00\x00\x00\x00" if big_endian else b"\x00\x01\x00\x00"]
        self._size = 0  # without the header of four bytes

    def payload(self) -> bytes:
        """Return what has been written."""
        return b"".join(self._parts)

    def numbers(self, code: str, *values: float) -> None:
        """Write numbers of one type, given by its code of the module ``struct``."""
        self._align(struct.calcsize(self._order + code))
        self._add(struct.pack(f"{self._order}{len(values)}{code}", *values))

    def string(self, text: str) -> None:
        """Write a string."""
        encoded = text.encode() + b"\x00"
        self.numbers("I", len(encoded))
        self._add(encoded)

    def rows(self, array: NDArray[Any], kind: str) -> None:
        """Write a sequence of an array's rows, whose numbers are of a kind such as ``"f8"``."""
        self.numbers("I", len(array))
        if len(array):
            dtype = np.dtype(self._order + kind)
            self._align(dtype.itemsize)
            self._add(np.asarray(array, dtype).tobytes())

    def _align(self, size: int) -> None:
        self._add(bytes(-self._size % size))

    def _add(self, part: bytes) -> None:
        self._parts.append(part)
        self._size += len(part)


def _read_rows(
    payload: bytes, start: int, dtype: str, columns: int, what: str
) -> tuple[NDArray[Any], int]:
    """Return the (n, columns) rows of the sequence whose length is at ``start``, and its end."""
    begin = start + 4
    if len(payload) < begin:
        raise InputError("mesh message", f"the number of {what}", "a message that ends before it")
    count = int(np.frombuffer(payload, dtype[0] + "u4", 1, start)[0])
    size = np.dtype(dtype).itemsize
    if count == 0:
        return np.empty((0, columns), dtype), begin
    begin += -(begin - _ENCAPSULATION) % size
    end = begin + count * columns * size
    if len(payload) < end:
        raise InputError(
            "mesh message",
            f"{end} bytes, for {count} {what}",
            f"{len(payload)} bytes",
            "the message is truncated",
        )
    return np.frombuffer(payload, dtype, count * columns, begin).reshape(count, columns), end
