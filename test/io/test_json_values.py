# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

from __future__ import annotations

import json

import pytest

from focus_planner.core.validation import InputError
from focus_planner.io.json_values import MAX_DEPTH, read_json

DEEP = "[" * MAX_DEPTH + "]" * MAX_DEPTH


@pytest.mark.parametrize(
    "text",
    [
        *("1", '"a"', "[]", '{"a": [1, 2.5, -0.0, null, true, 1e300]}'),
        DEEP,
        json.dumps(["[" * 1000, '\\"[{"' * 100, "\\", DEEP, [], [], []]),
        json.dumps([[i] for i in range(100)]),
    ],
)
def test_it_reads_what_json_reads(text: str) -> None:
    assert read_json("a", text, "JSON") == json.loads(text)
    assert read_json("a", text.encode(), "JSON") == json.loads(text)


@pytest.mark.parametrize(
    ("text", "telling"),
    [
        ("[" * 100_000, "invalid JSON: more than 50 lists within one another"),
        ('{"a":' * 100_000, "more than 50 lists"),
        (f"[{DEEP}]", "more than 50 lists"),
        ("[" * 60 + '"' + '\\"' * 100_000, "more than 50 lists"),
        ('"' + '\\"' * 100_000 + "[" * 60, "invalid JSON: line 1, column 1: Unterminated string"),
        ("9" * 400, "invalid JSON: a number of 400 digits"),
        ("-" + "9" * 5000, "invalid JSON: a number of 5,001 digits"),
        ('{"a": 1,\n "b": secret}', "invalid JSON: line 2, column 7: Expecting value"),
        (b"\xff\xfe{", "something that is not text"),
        ("", "line 1, column 1: Expecting value"),
    ],
)
def test_what_is_refused_is_told_in_a_line(text: str | bytes, telling: str) -> None:
    with pytest.raises(InputError, match=r"^a\.json: expected a plan, got ") as caught:
        read_json("a.json", text, "a plan")
    assert telling in caught.value.got
    assert "secret" not in str(caught.value)
