# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Ply files for tests."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

KINDS = {"uchar": "u1", "char": "i1", "ushort": "u2", "int": "i4", "uint": "u4", "double": "f8"}
Element = tuple[str, Sequence[str], Sequence[Sequence[object]]]


def write_ply(path: Path, encoding: str, *elements: Element, header: Sequence[str] = ()) -> Path:
    """Write elements: name, properties, and rows of numbers and lists."""
    lines = ["ply", f"format {encoding} 1.0", *header]
    body = b""
    order = ">" if "big" in encoding else "<"
    for name, properties, rows in elements:
        lines += [f"element {name} {len(rows)}", *(f"property {each}" for each in properties)]
        for row in rows:
            words: list[str] = []
            for each, value in zip(properties, row, strict=True):
                *kinds, _ = each.split()
                numbers = list(value) if isinstance(value, (list, tuple)) else [value]
                if kinds[0] == "list":
                    count = np.array([len(numbers)], order + KINDS[kinds[1]])
                    words.append(str(len(numbers)))
                    body += b"" if encoding == "ascii" else count.tobytes()
                words += map(str, numbers)
                if encoding != "ascii":
                    body += np.array(numbers, order + KINDS[kinds[-1]]).tobytes()
            body += (" ".join(words) + "\n").encode() if encoding == "ascii" else b""
    path.write_bytes("\n".join([*lines, "end_header\n"]).encode() + body)
    return path
