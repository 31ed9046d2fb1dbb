# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What a report's program reads, read again."""

from __future__ import annotations

import base64
import json
import zlib

import numpy as np


def decoded(text):
    """The JSON and the arrays of a payload, as its module describes them."""
    raw = zlib.decompress(base64.b64decode(text))
    length = int.from_bytes(raw[:4], "little")
    head = json.loads(raw[4 : 4 + length])
    at, arrays = 4 + length, {}
    for name, kind, count in head["arrays"]:
        width = 1 / 8 if kind == "bits" else int(kind[1:]) // 8
        size = -(-count // 8) if kind == "bits" else count * width
        data = np.frombuffer(raw[at : at + size], dtype=np.uint8)
        if kind == "bits":
            arrays[name] = np.unpackbits(data, count=count, bitorder="little").astype(bool)
        else:
            planes = data.reshape(width, count).astype(np.int64)
            arrays[name] = sum(plane << (8 * k) for k, plane in enumerate(planes))
        at += size
    assert at == len(raw)
    return head["facts"], arrays
