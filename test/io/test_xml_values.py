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

import re

import pytest

from focus_planner.core.validation import InputError
from focus_planner.io.xml_values import MAX_DEPTH, MAX_NODES, read_xml, text_numbers

ENTITIES = "<!DOCTYPE a [<!ENTITY b 'bb'><!ENTITY c '&b;&b;&b;'>]><a>&c;</a>"


def test_namespaces_are_part_of_names() -> None:
    root = read_xml("a.xml", "<a xmlns:p='urn:p' p:q='1' r='2'>é<p:b>3</p:b></a>", "XML")
    assert (root.tag, root.text, dict(root.items())) == ("a", "é", {"{urn:p}q": "1", "r": "2"})
    assert [(each.tag, each.text) for each in root] == [("{urn:p}b", "3")]


@pytest.mark.parametrize(
    ("text", "telling"),
    [
        ("", "invalid XML: line 1, column 1: no element found"),
        ("<a>\n<b></a>", "invalid XML: line 2, column 6: mismatched tag"),
        ("<a>&secret;</a>", "invalid XML: line 1, column 4: undefined entity"),
        ("<a/>secret", "junk after document element"),
        (ENTITIES, "XML with a document type, which is not read"),
        ("<!DOCTYPE a SYSTEM 'file:///etc/passwd'><a/>", "XML with a document type"),
        ("<a>" * (MAX_DEPTH + 1), f"more than {MAX_DEPTH} elements within one another"),
    ],
)
def test_what_is_not_read_is_told(text: str, telling: str) -> None:
    with pytest.raises(InputError, match=re.escape(telling)) as caught:
        read_xml("a.xml", text, "cameras")
    assert "secret" not in str(caught.value)
    assert str(caught.value).startswith("a.xml: expected cameras, got ")


def test_there_is_a_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    assert MAX_NODES > 250_000 * 6  # cameras with what belongs to them
    monkeypatch.setattr("focus_planner.io.xml_values.MAX_NODES", 4)
    assert len(read_xml("a.xml", "<a><b/><b/><b/></a>", "XML")) == 3
    with pytest.raises(InputError, match="XML with more than 4 elements"):
        read_xml("a.xml", "<a><b c='d'/><b/><b/></a>", "XML")


def test_numbers_are_counted() -> None:
    assert text_numbers("at", " 1 2e1\n-3 ", 3) == [1.0, 20.0, -3.0]
    with pytest.raises(InputError, match="at: expected 2 numbers, got 3"):
        text_numbers("at", "1 2 3", 2)
    with pytest.raises(InputError, match="at: expected a number, got something else"):
        text_numbers("at", "secret", 1)
    with pytest.raises(InputError, match="at: expected a number, got '1,5'"):
        text_numbers("at", "1,5", 1)
