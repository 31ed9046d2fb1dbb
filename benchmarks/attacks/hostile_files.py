# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Files made to harm whoever reads them, by what makes them hostile."""

from __future__ import annotations

import os
import secrets
import socket
from base64 import b64encode
from collections.abc import Callable
from pathlib import Path

# Made up; nobody has it.
_KEY = [b64encode(secrets.token_bytes(48)).decode() for _ in range(24)]


def write(kind: str, path: Path) -> Path:
    """Write a file of a kind under this name, which may be a link to what it is; return it."""
    KINDS[kind](path)
    return path


def quotes_the_key(text: str) -> bool:
    """Return whether a text gives away a part of the private key."""
    return any(line[at : at + 12] in text for line in _KEY for at in range(0, len(line) - 12, 4))


def _text(text: str) -> Callable[[Path], object]:
    return lambda path: path.write_text(text)


def _aliases() -> str:
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]" for i in range(1, 9)]
    return "\n".join([*lines, "cameras: *a8", "default: *a8", ""])


def _table(distance: str, value: str) -> str:
    """Return lens tables with these numbers, which are a rig's text as little as the others."""
    return f"default: {{unit: steps, distances: [{distance}, 1.0], values: [{value}, 50]}}\n"


def _socket(path: Path) -> None:
    # A socket's own name must be short.
    with socket.socket(socket.AF_UNIX) as one:
        before = os.open(".", os.O_RDONLY)
        try:
            os.chdir(path.parent)
            one.bind(path.name)
        finally:
            os.fchdir(before)
            os.close(before)


def _sparse(path: Path) -> None:
    with path.open("wb") as file:
        file.truncate(40 * 10**9)


def _linked(target: str) -> Callable[[Path], object]:
    return lambda path: path.symlink_to(target)


KINDS: dict[str, Callable[[Path], object]] = {
    "a FIFO": os.mkfifo,
    "/dev/zero": _linked("/dev/zero"),
    "a directory": _linked("/dev"),
    "a socket": _socket,
    "a link to itself": lambda path: path.symlink_to(path.name),
    "40 GB of nothing": _sparse,
    "100,000 [": _text("[" * 100_000),
    "100,000 {a: ": _text("{a: " * 100_000),
    "nine levels of aliases": _text(_aliases()),
    "a private key": _text(
        "-----BEGIN OPENSSH PRIVATE KEY-----\n"
        + "\n".join(_KEY)
        + "\n-----END OPENSSH PRIVATE KEY-----\n"
    ),
    "a number of 400 digits": _text(_table("0.25", "9" * 400)),
    "a distance of 400 digits": _text(_table("9" * 400, "200")),
    "a number of 5,000 digits": _text(_table("0.25", "9" * 5000)),
    "a distance of 1e-300": _text(_table("1.0e-300", "200")),
    "a value of 1e308": _text(_table("0.25", "1.0e+308")),
    "tags of Python objects": _text("!!python/object/apply:os.system ['touch hacked']\n"),
    "bytes that are no text": lambda path: path.write_bytes(bytes(range(256)) * 40),
    "control characters": _text('default: {unit: "\\e[31mred\\r\\n[ERROR] forged"}\n'),
}

#: What may also be used, if it does no harm.
MAY_BE_GOOD = {"a value of 1e308", "a distance of 1e-300", "control characters"}
