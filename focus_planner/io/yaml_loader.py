# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A YAML loader that any text can be given to: bounded in depth, in size and in time.

libyaml composes nodes by recursion without a limit, and aliases multiply what a short text stands
for: so its events are counted before anything is made of them.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

import yaml

from focus_planner.io.quoting import key_name

#: Mappings and lists within one another; what is read here has at most eight.
MAX_DEPTH = 50
#: Keys and values, those that an alias stands for counted each time: 50,000 cameras.
MAX_NODES = 1_000_000
_MAX_SCALAR = 10_000  # characters
# Of a number or a date: Python converts longer ones slowly, or not at all.
_MAX_NUMBER = 100

# What OpenCV writes in place of YAML's own %YAML 1.0.
_OPENCV_HEADER = re.compile(r"\A%(?=YAML:1\.[01]\s*$)", re.MULTILINE)

# The C parser is ten times as fast: 10,000 cameras take it a second.
_SafeLoader: type[Any] = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


def load_documents(text: str, max_nodes: int = MAX_NODES) -> list[Any]:
    """Return the documents of a YAML text.

    Raises
    ------
    ValueError
        If it is no valid YAML, has a duplicate key, or is beyond a limit. Tells in one line where
        and what, and quotes nothing of the text but a key.
    """
    text = _without_opencv_header(text)
    with _problems_in_words():
        _check_size(text, max_nodes)
        return list(yaml.load_all(text, _Loader))


def check_bounded(text: str, max_nodes: int = MAX_NODES) -> None:
    """Raise unless a YAML text is valid and within the limits; for what others read after that.

    Raises
    ------
    ValueError
        As :func:`load_documents`.
    """
    with _problems_in_words():
        _check_size(text, max_nodes)


def has_keys(text: str) -> bool:
    """Return whether the first document of a valid YAML text is a mapping of keys to values."""
    events = iter(yaml.parse(text, _SafeLoader))
    before = (yaml.StreamStartEvent, yaml.DocumentStartEvent)
    first = next((event for event in events if not isinstance(event, before)), None)
    return isinstance(first, yaml.MappingStartEvent)


def _without_opencv_header(text: str) -> str:
    """Return a text whose first line is a comment if it is OpenCV's; lines keep their numbers."""
    return _OPENCV_HEADER.sub("#", text, count=1)


@contextmanager
def _problems_in_words() -> Iterator[None]:
    try:
        yield
    except yaml.MarkedYAMLError as error:
        mark: Any = error.problem_mark
        problem = error.problem or ""
        if isinstance(error, yaml.constructor.ConstructorError) and "tag" in problem:
            problem = "a tag that is not known here"  # PyYAML quotes it
        raise ValueError(f"line {mark.line + 1}, column {mark.column + 1}: {problem}") from None
    except yaml.YAMLError:
        raise ValueError("characters that YAML does not allow") from None
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError):
        # Whatever PyYAML's constructors raise for a value that does not fit its tag.
        raise ValueError("a value that does not fit its tag") from None


class _Loader(_SafeLoader):  # type: ignore[misc] # whichever of the two it is
    """Rejects duplicate keys, of which PyYAML silently uses the last, and endless numbers."""

    def construct_mapping(self, node: Any, deep: bool = False) -> Any:
        seen = set()
        for key, _ in node.value:
            name = key.tag, str(key.value)
            if name in seen:
                raise _problem(f"duplicate key {key_name(key.value)}", key.start_mark)
            seen.add(name)
        return super().construct_mapping(node, deep)

    def construct_number(self, node: Any) -> Any:
        try:
            if len(node.value) <= _MAX_NUMBER:
                return _SafeLoader.yaml_constructors[node.tag](self, node)
        except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError):
            pass
        raise _problem("a number or a date that is none", node.start_mark)


for _kind in ("int", "float", "timestamp"):
    _Loader.add_constructor(f"tag:yaml.org,2002:{_kind}", _Loader.construct_number)


class _Size(NamedTuple):
    """What a node stands for, aliases resolved."""

    nodes: int
    depth: int = 0


class _Sizes:
    """Counts nodes as their events arrive."""

    def __init__(self) -> None:
        self.nodes = 0
        self._anchors: dict[str, _Size] = {}
        # Of every collection that is open: its anchor, the nodes before it, the depth within it.
        self._open: list[tuple[str | None, int, int]] = []

    @property
    def depth(self) -> int:
        return len(self._open) + (self._open[-1][2] if self._open else 0)

    def forget(self) -> None:
        """Forget the anchors: every document has its own."""
        self._anchors.clear()

    def start(self, anchor: str | None) -> None:
        if anchor is not None:  # an alias within would stand for a list that contains itself
            self._anchors.pop(anchor, None)
        self._open.append((anchor, self.nodes, 0))
        self.nodes += 1

    def end(self) -> None:
        anchor, before, within = self._open.pop()
        self._name(anchor, _Size(self.nodes - before, within + 1))
        self._deepen(within + 1)

    def scalar(self, anchor: str | None) -> None:
        self.nodes += 1
        self._name(anchor, _Size(1))

    def alias(self, anchor: str) -> bool:
        """Count what an alias stands for; return False if that is nothing, or not finished."""
        size = self._anchors.get(anchor)
        if size is None:
            return False
        self.nodes += size.nodes
        self._deepen(size.depth)
        return True

    def _name(self, anchor: str | None, size: _Size) -> None:
        if anchor is not None:
            self._anchors[anchor] = size

    def _deepen(self, depth: int) -> None:
        if self._open:
            anchor, before, within = self._open[-1]
            self._open[-1] = anchor, before, max(within, depth)


def _check_size(text: str, max_nodes: int) -> None:
    """Raise if a text is too deep, or stands for too much."""
    sizes = _Sizes()
    event: Any
    for event in yaml.parse(text, _SafeLoader):
        _count(sizes, event)
        if sizes.nodes > max_nodes:
            raise _problem(f"more than {max_nodes:,} keys and values", event.start_mark)
        if sizes.depth > MAX_DEPTH:
            raise _problem(f"more than {MAX_DEPTH} lists within one another", event.start_mark)


def _count(sizes: _Sizes, event: Any) -> None:
    match event:
        case yaml.DocumentStartEvent():
            sizes.forget()
        case yaml.CollectionStartEvent():
            sizes.start(event.anchor)
        case yaml.CollectionEndEvent():
            sizes.end()
        case yaml.ScalarEvent():
            sizes.scalar(event.anchor)
            if len(event.value) > _MAX_SCALAR:
                count = f"{len(event.value):,} characters, more than the {_MAX_SCALAR:,} that are"
                raise _problem(f"a text of {count} read", event.start_mark)
        case yaml.AliasEvent() if not sizes.alias(str(event.anchor)):
            raise _problem("an alias of nothing that ends above it", event.start_mark)


def _problem(what: str, where: Any) -> yaml.MarkedYAMLError:
    return yaml.MarkedYAMLError(problem=what, problem_mark=where)
