"""Values out of YAML that people write, and errors that say in one line what is wrong where."""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import yaml

from focus_planner.core.validation import InputError
from focus_planner.io.files import read_text

Values = Mapping[str, Any]

# The C parser reads 10,000 cameras in a second, the Python one in ten.
_SafeLoader: type[Any] = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


class _Loader(_SafeLoader):  # type: ignore[misc] # whichever of the two it is
    """Refuses a key that stands twice, of which YAML's readers silently take the last."""

    def construct_mapping(self, node: Any, deep: bool = False) -> Any:
        seen = set()
        for key, _ in node.value:
            name = key.tag, str(key.value)
            if name in seen:
                raise yaml.MarkedYAMLError(
                    problem=f"{key.value} stands twice", problem_mark=key.start_mark
                )
            seen.add(name)
        return super().construct_mapping(node, deep)


def read_yaml(where: str, text: str) -> Any:
    """Return what a YAML text says.

    Parameters
    ----------
    where : str
        Where the text is from, for the error.
    text : str

    Raises
    ------
    InputError
        If it is no YAML, or a key stands twice; says in which line.
    """
    with _as_yaml(where):
        return yaml.load(text, _Loader)  # noqa: S506


def load_yaml(path: Path, what: str) -> Any:
    """Return what a YAML file says.

    Parameters
    ----------
    path : Path
    what : str
        What was expected there, for the error.

    Raises
    ------
    InputError
        If it cannot be read, or as :func:`read_yaml`.
    """
    return read_yaml(str(path), read_text(path, what))


def read_yaml_documents(where: str, text: str) -> list[Any]:
    """Return the documents of a text, which ``---`` separates.

    Raises
    ------
    InputError
        As :func:`read_yaml`.
    """
    with _as_yaml(where):
        return list(yaml.load_all(text, _Loader))


def value_at(where: str, data: Any, *keys: str) -> Any:
    """Return ``data[key][key]...``.

    Parameters
    ----------
    where : str
        What ``data`` is called in errors; one that ends in a space gets the key without a point.
    data : Any
    *keys : str

    Raises
    ------
    InputError
        Names the first key that is missing.
    """
    for key in keys:
        if not isinstance(data, Mapping):
            raise InputError(where.rstrip(": "), f"{key} and its value", shown(data))
        where = where + key if where.endswith(" ") else f"{where}.{key}"
        if key not in data:
            raise InputError(where, "a value", "none")
        data = data[key]
    return data


def mapping(where: str, data: Any, keys: tuple[str, ...], prefix: str = "") -> Values:
    """Return keys and values, all of them known.

    Raises
    ------
    InputError
        Names an unknown key, after ``prefix`` or else ``where``, and the one probably meant.
    """
    if not isinstance(data, dict):
        raise InputError(where, "keys and values: " + ", ".join(keys), shown(data))
    for key in data:
        if key not in keys:
            close = difflib.get_close_matches(str(key), keys, n=1)
            raise InputError(
                f"{prefix or where + '.'}{key}",
                "one of the keys " + ", ".join(keys),
                "an unknown one",
                f"did you mean {close[0]}?" if close else "",
            )
    return data


def number(where: str, value: Any) -> Any:
    """Return the number; YAML 1.1 takes 1e-5, without a point, for text."""
    if isinstance(value, str):
        try:
            return float(value)
        except ValueError:
            pass
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise InputError(where, "a number", shown(value))
    return value


def numbers(where: str, value: Any) -> tuple[Any, ...]:
    """Return a list of numbers."""
    if not isinstance(value, list):
        raise InputError(where, "a list of numbers", shown(value))
    return tuple(number(f"{where}[{i}]", item) for i, item in enumerate(value))


def vector(where: str, value: Any, length: int) -> tuple[Any, ...]:
    """Return a list of so many numbers."""
    if not isinstance(value, list) or len(value) != length:
        raise InputError(where, f"a list of {length} numbers", shown(value))
    return numbers(where, value)


@contextmanager
def within(where: str) -> Iterator[None]:
    """Say where in the file the core found fault."""
    try:
        yield
    except InputError as error:
        if error.argument.startswith(where):
            raise
        raise InputError(
            f"{where}: {error.argument}", error.expected, error.got, error.remedy
        ) from None


def shown(value: Any) -> str:
    """Return what came, in short."""
    if value is None:
        return "nothing"
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def flow(value: Any) -> str:
    """Return mappings, tuples and scalars as YAML in one line."""
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key}: {flow(item)}" for key, item in value.items()) + "}"
    if isinstance(value, tuple):
        return "[" + ", ".join(map(flow, value)) + "]"
    return scalar(value)


def scalar(value: str | float | None) -> str:
    """Return a scalar as YAML, quoted or pointed where it would be read as something else."""
    if isinstance(value, float) and math.isfinite(value):
        text = repr(value)
        return text if "." in text else text.replace("e", ".0e")
    return yaml.safe_dump(value, width=1_000_000).removesuffix("...\n").rstrip("\n")


@contextmanager
def _as_yaml(where: str) -> Iterator[None]:
    try:
        yield
    except (yaml.YAMLError, ValueError) as error:  # ValueError: no such date
        if isinstance(error, InputError):
            raise
        raise InputError(where, "YAML", _syntax_error(error)) from None


def _syntax_error(error: Exception) -> str:
    if isinstance(error, yaml.MarkedYAMLError) and error.problem_mark is not None:
        mark = error.problem_mark
        return f"line {mark.line + 1}, column {mark.column + 1}: {error.problem}"
    return " ".join(str(error).split())
