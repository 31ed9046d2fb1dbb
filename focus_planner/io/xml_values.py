# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Reading XML of any origin: bounded in depth and in size, without declarations of entities."""

from __future__ import annotations

from typing import Any
from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers import expat

from focus_planner.core.validation import InputError
from focus_planner.io.quoting import word

#: Elements within one another; what is read here has at most ten.
MAX_DEPTH = 50
#: Elements and attributes.
MAX_NODES = 2_000_000


class _RefusedError(ValueError):
    """What is beyond a limit."""


class _Reader:
    """Builds a tree of elements while it counts them."""

    def __init__(self) -> None:
        self.tree = TreeBuilder()
        self._depth = self._nodes = 0

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        self._depth += 1
        self._nodes += 1 + len(attributes)
        if self._depth > MAX_DEPTH:
            raise _RefusedError(f"more than {MAX_DEPTH} elements within one another")
        if self._nodes > MAX_NODES:
            raise _RefusedError(f"more than {MAX_NODES:,} elements")
        self.tree.start(tag, attributes)

    def end(self, tag: str) -> None:
        self._depth -= 1
        self.tree.end(tag)

    @staticmethod
    def declaration(*_: Any) -> None:
        # Entities multiply what a short text stands for, and may name other files.
        raise _RefusedError("a document type, which is not read")


def read_xml(where: str, text: str, what: str) -> Element:
    """Return the root of an XML text; names of another namespace are ``{namespace}name``.

    Parameters
    ----------
    where : str
        Where the text is from, for errors.
    text : str
    what : str
        What was expected there, for errors.

    Raises
    ------
    InputError
        If it is not well-formed, declares a document type, or is beyond a limit; names the line,
        and quotes nothing.
    """
    reader = _Reader()
    parser = expat.ParserCreate(namespace_separator="}")
    parser.StartElementHandler = lambda tag, given: reader.start(
        _qualified(tag), {_qualified(name): value for name, value in given.items()}
    )
    parser.EndElementHandler = lambda tag: reader.end(_qualified(tag))
    parser.CharacterDataHandler = reader.tree.data
    parser.StartDoctypeDeclHandler = reader.declaration
    parser.buffer_text = True
    try:
        parser.Parse(text, True)
        root: Element = reader.tree.close()
    except expat.ExpatError as error:
        problem = expat.ErrorString(error.code)
        got = f"invalid XML: line {error.lineno}, column {error.offset + 1}: {problem}"
    except _RefusedError as error:
        got = f"XML with {error}"
    else:
        return root
    raise InputError(where, what, got)


def _qualified(name: str) -> str:
    return "{" + name if "}" in name else name


def child(where: str, element: Element, name: str) -> Element:
    """Return an element's first child of this name.

    Raises
    ------
    InputError
        If there is none.
    """
    found = element.find(name)
    if found is None:
        raise InputError(where, f"an element {name}", "none")
    return found


def text_numbers(where: str, text: str | None, count: int) -> list[float]:
    """Return the numbers of a text, separated by spaces.

    Raises
    ------
    InputError
        If there are fewer or more, or one is no number.
    """
    words = (text or "").split()
    if len(words) != count:
        raise InputError(where, "a number" if count == 1 else f"{count} numbers", str(len(words)))
    return [text_number(where, each) for each in words]


def text_number(where: str, text: str) -> float:
    """Return the number that a text is.

    Raises
    ------
    InputError
        If it is none.
    """
    try:
        return float(text)
    except ValueError:
        raise InputError(where, "a number", word(text)) from None
