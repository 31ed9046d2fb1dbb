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

import random
import re

import pytest
import yaml

from focus_planner.io.yaml_loader import MAX_DEPTH, load_documents
from testing.damaged_files import PRIVATE_KEY, SECRET, aliases


@pytest.mark.parametrize(
    "text",
    [
        "",
        "a: 1\nb: [1.5, x, true, null, 2024-01-02]\n",
        "a: &x {b: 1}\nc: *x\nd: {<<: *x, e: 2}\n",
        "--- 1\n--- {a: b}\n...\n",
        "[" * MAX_DEPTH + "]" * MAX_DEPTH,
        "- &a [&b [1]]\n- [*a, *b]\n",
        "a: !!float 1\n",
    ],
)
def test_it_loads_what_pyyaml_loads(text: str) -> None:
    assert load_documents(text) == list(yaml.safe_load_all(text))


@pytest.mark.parametrize(
    ("text", "telling"),
    [
        ("[" * 100_000, "line 1, column 51: more than 50 lists within one another"),
        ('{"a":' * 100_000, "more than 50 lists within one another"),
        ("- " * 100_000, "more than 50 lists within one another"),
        (aliases().decode(), "more than 1,000,000 keys and values"),
        ("&a [*a]", "line 1, column 5: an alias of nothing that ends above it"),
        ("&a [&a x, [*b]]", "an alias of nothing"),
        ("&a x\n--- *a", "line 2, column 5: an alias of nothing"),
        ("a: 1\nb: 2\na: 3", "line 3, column 1: duplicate key a"),
        ("a: " + "9" * 5000, "line 1, column 4: a number or a date that is none"),
        ("a: " + ":".join(["1"] * 3000), "a number or a date that is none"),
        ("a: 2024-13-41", "a number or a date that is none"),
        ("a: !!int x", "a number or a date that is none"),
        ("a: !!int ''", "a number or a date that is none"),
        ("a: !!bool x", "a value that does not fit its tag"),
        ("!!map [a]", "a value that does not fit its tag"),
        (f"a: !{SECRET} x", "line 1, column 4: a tag that is not known here"),
        ("a: !!python/object:os.system x", "a tag that is not known here"),
        ("a: \x01", "characters that YAML does not allow"),
        ("x" * 20_000, "a text of 20,000 characters, more than the 10,000 that are read"),
        (f"{SECRET}: 1\n{SECRET}: 2", r"line 2, column 1: duplicate key \(a key that is no name\)"),
        ("? [a]\n: 1", "unhashable key"),
        ("a: [1, 2", "did not find expected"),
    ],
)
def test_what_is_refused_is_told_in_a_line(text: str, telling: str) -> None:
    with pytest.raises(ValueError, match=telling) as caught:
        load_documents(text)
    assert SECRET[:10] not in str(caught.value)
    assert "\n" not in str(caught.value)


def test_opencvs_header_is_a_comment() -> None:
    assert load_documents("%YAML:1.0\n\na: 1\n") == [{"a": 1}]
    assert load_documents("%YAML:1.0\r\n---\r\na: 1\r\n") == [{"a": 1}]
    with pytest.raises(ValueError, match="line 3, column 1: duplicate key a"):
        load_documents("%YAML:1.0\na: 1\na: 2")


def test_a_depth_may_come_from_aliases() -> None:
    lines = ["a0: &a0 [x]", *(f"a{i}: &a{i} [*a{i - 1}]" for i in range(1, MAX_DEPTH + 5))]
    assert load_documents("\n".join(lines[: MAX_DEPTH - 1]))
    with pytest.raises(ValueError, match=f"line {MAX_DEPTH}, .* more than 50 lists"):
        load_documents("\n".join(lines))


def test_an_alias_counts_as_often_as_it_is_used() -> None:
    text = "a: &a [1, 2, 3]\nb: [*a, *a, *a]\n"
    size = 1 + 2 + 4 + 1 + 3 * 4
    assert load_documents(text, max_nodes=size)
    with pytest.raises(ValueError, match=f"more than {size - 1} keys and values"):
        load_documents(text, max_nodes=size - 1)


@pytest.mark.parametrize("number", range(200))
def test_lines_of_a_key_are_never_quoted(number: int) -> None:
    """Whatever YAML would make of parts of a private key."""
    chance = random.Random(number)
    lines = PRIVATE_KEY.splitlines()
    signs = chance.choices(
        [": ", "- ", "[", "{", "&", "*", "!", "!!", "? ", "'", '"', "|", "%"], k=3
    )
    text = signs[0] + f"\n{signs[1]}".join(lines) + signs[2] + lines[1]
    try:
        load_documents(text)
    except ValueError as error:
        assert not re.search(re.escape(SECRET[:10]), str(error))  # noqa: PT017
