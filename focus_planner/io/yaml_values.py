# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Reading hand-written YAML, with one-line errors that say what is wrong and where."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import yaml

from focus_planner.core.text import did_you_mean
from focus_planner.core.validation import InputError
from focus_planner.io.files import read_text
from focus_planner.io.quoting import abbreviated, key_name, kind_of
from focus_planner.io.yaml_loader import MAX_NODES, check_bounded, has_keys, load_documents

Values = Mapping[str, Any]


def read_yaml(where: str, text: str, max_nodes: int = MAX_NODES) -> Any:
    """Return the contents of a YAML text.

    Parameters
    ----------
    where : str
        Where the text is from, for errors.
    text : str
    max_nodes : int
        How many keys and values it may have.

    Raises
    ------
    InputError
        If it is not valid YAML, has a duplicate key, or is beyond a limit of
        :mod:`focus_planner.io.yaml_loader`; names the line.
    """
    documents = read_yaml_documents(where, text, max_nodes)
    if len(documents) > 1:
        raise InputError(where, "YAML of one document", f"{len(documents):,}")
    return documents[0] if documents else None


def load_yaml(path: Path, what: str, max_nodes: int = MAX_NODES) -> Any:
    """Return the contents of a YAML file.

    Parameters
    ----------
    path : Path
    what : str
        What was expected there, for errors.
    max_nodes : int
        How many keys and values it may have.

    Raises
    ------
    InputError
        If it cannot be read, or as :func:`read_yaml`.
    """
    return read_yaml(str(path), read_text(path, what), max_nodes)


def read_yaml_documents(where: str, text: str, max_nodes: int = MAX_NODES) -> list[Any]:
    """Return the documents of a YAML text, which are separated by ``---``.

    Raises
    ------
    InputError
        As :func:`read_yaml`.
    """
    try:
        return load_documents(text, max_nodes)
    except ValueError as error:
        raise InputError(where, "YAML", str(error)) from None


def check_yaml(path: Path, what: str) -> None:
    """Raise unless a file has keys and values, and another program's YAML parser can be given it.

    Raises
    ------
    InputError
        If it cannot be read, is not valid YAML or has no keys, or is beyond a limit, where it names
        the line.
    """
    text = read_text(path, what)
    try:
        check_bounded(text)
    except ValueError as error:
        raise InputError(str(path), "YAML", str(error)) from None
    if not has_keys(text):
        raise InputError(str(path), f"{what} with keys and values", "something else")


def value_at(where: str, data: Any, *keys: str) -> Any:
    """Return ``data[key][key]...``.

    Parameters
    ----------
    where : str
        The name of ``data`` in errors. Keys are appended after a dot, or directly if it ends in a
        space.
    data : Any
    *keys : str

    Raises
    ------
    InputError
        Names the first key that is missing.
    """
    for key in keys:
        if not isinstance(data, Mapping):
            raise InputError(where.rstrip(": "), f"{key} and its value", kind_of(data))
        where = where + key if where.endswith(" ") else f"{where}.{key}"
        if key not in data:
            raise InputError(where, "a value", "none")
        data = data[key]
    return data


def mapping(where: str, data: Any, keys: tuple[str, ...], prefix: str = "") -> Values:
    """Return a mapping all of whose keys are among ``keys``.

    Raises
    ------
    InputError
        If it is not a mapping, or has an unknown key; names it, after ``prefix`` or else
        ``where``, and the key probably meant.
    """
    if not isinstance(data, dict):
        raise InputError(where, "keys and values: " + ", ".join(keys), kind_of(data))
    for key in data:
        if key not in keys:
            name = key_name(key)
            raise InputError(
                f"{prefix or where + '.'}{name}",
                "one of the keys " + ", ".join(keys),
                "an unknown one",
                did_you_mean(name, keys),
            )
    return data


def number(where: str, value: Any) -> Any:
    """Return a number; also from text, because 1e-5 without a dot is text in YAML 1.1."""
    if isinstance(value, str):
        try:
            return float(value)
        except ValueError:
            pass
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise InputError(where, "a number", abbreviated(value))
    return value


def numbers(where: str, value: Any) -> tuple[Any, ...]:
    """Return a list of numbers."""
    if not isinstance(value, list):
        raise InputError(where, "a list of numbers", kind_of(value))
    return tuple(number(f"{where}[{i}]", item) for i, item in enumerate(value))


def vector(where: str, value: Any, length: int) -> tuple[Any, ...]:
    """Return a list of ``length`` numbers."""
    if not isinstance(value, list) or len(value) != length:
        raise InputError(where, f"a list of {length} numbers", kind_of(value))
    return numbers(where, value)


@contextmanager
def errors_within(where: str) -> Iterator[None]:
    """Prefix the arguments of errors with their place in the file."""
    try:
        yield
    except InputError as error:
        if error.argument.startswith(where):
            raise
        raise InputError(
            f"{where}: {error.argument}", error.expected, error.got, error.remedy
        ) from None


def flow(value: Any) -> str:
    """Return mappings, tuples and scalars as YAML on one line."""
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key}: {flow(item)}" for key, item in value.items()) + "}"
    if isinstance(value, tuple):
        return "[" + ", ".join(map(flow, value)) + "]"
    return scalar(value)


def scalar(value: str | float | None) -> str:
    """Return a scalar as YAML, quoted or with a dot where it would be read as another type."""
    if isinstance(value, float) and math.isfinite(value):
        text = repr(value)
        return text if "." in text else text.replace("e", ".0e")
    return yaml.safe_dump(value, width=1_000_000).removesuffix("...\n").rstrip("\n")
