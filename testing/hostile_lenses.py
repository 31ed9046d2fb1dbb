# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Random orders to lenses and states of lenses, from nearly right to garbage, as bytes."""

from __future__ import annotations

import math

from focus_planner.messages.typestore import LENS_STATE, ORDER, serialize

NUMBERS = (0.0, -0.0, -1.0, 1e-300, 1e300, 5e-324, -500.0, 99.0, 2.0**53, math.inf, -math.inf)
NUMBERS = (*NUMBERS, math.nan)
TEXTS = ("", "\n", "\x1b[2J\x1b]0;title\x07", "a/b", "..", "ß\u202e\ufeff", "%s%n{0}", 70_000 * "x")
TIMES = (0, 1, 2**31 - 1, -1, -(2**31))
NANOSECONDS = (0, 1, 999_999_999, 10**9, 2**32 - 1)
# How many messages keep every field, of how many.
_UNTOUCHED = 0.1


def orders(random, count, good):
    """Yield hostile ``CameraFocus`` messages.

    Parameters
    ----------
    random : numpy.random.Generator
    count : int
    good : dict
        The fields of a good order, which they resemble.
    """
    statuses = range(256)
    for _ in range(count):
        yield _damaged(random, serialize(ORDER, _changed(random, good, statuses)))


def states(random, count, good):
    """Yield hostile ``LensState`` messages; as :func:`orders`."""
    statuses = range(256)
    for _ in range(count):
        yield _damaged(random, serialize(LENS_STATE, _changed(random, good, statuses)))


def _changed(random, good, statuses):
    """Return the fields with one to three of them changed, or none."""
    fields = dict(good)
    if random.random() < _UNTOUCHED:
        return fields
    names = random.choice(sorted(fields), size=min(len(fields), int(random.integers(1, 4))))
    for name in names:
        fields[str(name)] = _other(random, str(name), fields[str(name)], statuses)
    return fields


def _other(random, name, value, statuses):
    if name == "status":
        return int(random.choice(statuses))
    if name == "header":
        return {"stamp": _time(random)}
    if isinstance(value, dict):
        return _time(random)
    if isinstance(value, str):
        return _one_of(random, TEXTS)
    if isinstance(value, list):
        size = int(random.choice([0, 1, 10, 10_000]))
        return [_one_of(random, NUMBERS) for _ in range(size)]
    return _one_of(random, (*NUMBERS, value * random.normal(1.0, 1e-3)))


def _time(random):
    return {"sec": _one_of(random, TIMES), "nanosec": _one_of(random, NANOSECONDS)}


def _one_of(random, values):
    return values[int(random.integers(len(values)))]


def _damaged(random, payload):
    """Return the bytes, some of them cut, with other bits, or with more behind."""
    kind = int(random.integers(10))
    damaged = bytearray(payload)
    if kind == 0:
        return bytes(damaged[: int(random.integers(len(damaged) + 1))])
    if kind == 1:
        for place in random.integers(len(damaged), size=int(random.integers(1, 9))):
            damaged[place] = int(random.integers(256))
    if kind == 2:
        damaged += random.bytes(int(random.integers(1, 100)))
    if kind == 3:
        return random.bytes(int(random.integers(200)))
    return bytes(damaged)
