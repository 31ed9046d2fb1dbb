# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Damage of bytes and of texts."""

from __future__ import annotations

import re
import struct
from collections.abc import Callable

import numpy as np

Random = np.random.Generator
_SEPARATORS = re.compile(rb"([\s,:\[\]{}]+)")
_NUMBERS = (0, 1, 2**16, 2**24, 2**31 - 1, 2**31, 2**32 - 1)
_WORDS = (
    b"nan", b"inf", b"-1", b"1e308", b"1e-300", b"9" * 400, b"", b"0", b"[" * 5000, b"{a: " * 500,
    b"*a", b"&a [*a]", b"!!python/object:x", b"\xff\xfe", b"\x00", b"\x1b[31m", b"null", b"'",
)  # fmt: skip


def damaged(data: bytes, random: Random) -> bytes:
    """Return bytes with one to three kinds of damage, mostly one."""
    for _ in range(random.choice([1, 1, 1, 1, 2, 3])):
        data = _KINDS[random.integers(len(_KINDS))](data, random) or b"\0"
    return data


def altered(data: bytes, random: Random) -> bytes:
    """Return as many bytes, a few of which are others."""
    kind = (_flipped, _lying)[random.integers(2)]
    return kind(data, random)[: len(data)]


def _flipped(data: bytes, random: Random) -> bytes:
    flipped = bytearray(data)
    for at in random.integers(0, 8 * len(data), random.integers(1, 9)):
        flipped[at // 8] ^= 1 << (at % 8)
    return bytes(flipped)


def _cut(data: bytes, random: Random) -> bytes:
    return data[: random.integers(len(data) + 1)]


def _without(data: bytes, random: Random) -> bytes:
    start, end = sorted(random.integers(0, len(data) + 1, 2))
    return data[:start] + data[min(end, start + 500) :]


def _twice(data: bytes, random: Random) -> bytes:
    start, end = sorted(random.integers(0, len(data) + 1, 2))
    return data[:end] + data[start:end][:5000] + data[end:]


def _lying(data: bytes, random: Random) -> bytes:
    """Change a number at any place, probably a length."""
    at = int(random.integers(len(data)))
    number = _NUMBERS[random.integers(len(_NUMBERS))]
    packed = struct.pack("<Q" if random.integers(2) else "<I", number)
    return data[:at] + packed + data[at + len(packed) :]


def _noisy(data: bytes, random: Random) -> bytes:
    at = int(random.integers(len(data)))
    return data[:at] + random.bytes(random.integers(1, 40)) + data[at:]


def _other_word(data: bytes, random: Random) -> bytes:
    """Replace a word of a text by another one."""
    words = _SEPARATORS.split(data)
    # What separates them is kept, as every other one.
    words[2 * random.integers((len(words) + 1) // 2)] = _WORDS[random.integers(len(_WORDS))]
    return b"".join(words)


def _other_order(data: bytes, random: Random) -> bytes:
    """Swap two lines of a text."""
    lines = data.split(b"\n")
    one, other = random.integers(len(lines), size=2)
    lines[one], lines[other] = lines[other], lines[one]
    return b"\n".join(lines)


_KINDS: tuple[Callable[[bytes, Random], bytes], ...] = (
    _flipped,
    _cut,
    _without,
    _twice,
    _lying,
    _noisy,
    _other_word,
    _other_word,
    _other_word,
    _other_order,
)
