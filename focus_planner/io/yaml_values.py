"""Values out of YAML, and errors that say in one line what is wrong with one."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import yaml

from focus_planner.core.checks import InputError
from focus_planner.io.files import read_text

# The C parser reads 10,000 cameras in a second, the Python one in ten.
_Loader: type[Any] = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


def load_yaml(path: Path, what: str) -> Any:
    """Return what a YAML file holds.

    Parameters
    ----------
    path : Path
    what : str
        What was expected there, for the error.

    Raises
    ------
    InputError
        If it cannot be read or is no YAML; names the line and column.
    """
    with _as_yaml(path):
        return yaml.load(read_text(path, what), _Loader)  # noqa: S506


def parse_yaml_documents(path: Path, text: str) -> list[Any]:
    """Return the documents of a text, which ``---`` separates.

    Raises
    ------
    InputError
        If it is no YAML; names ``path``, the line and column.
    """
    with _as_yaml(path):
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


def number(where: str, value: Any) -> Any:
    """Return the number; YAML 1.1 takes 1e-5, without a point, for text.

    Raises
    ------
    InputError
        If it is none.
    """
    if isinstance(value, str):
        try:
            return float(value)
        except ValueError:
            pass
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise InputError(where, "a number", shown(value))
    return value


def shown(value: Any) -> str:
    """Return a value as errors show it."""
    if value is None:
        return "nothing"
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


@contextmanager
def within(where: str) -> Iterator[None]:
    """Say where in a file the core found fault."""
    try:
        yield
    except InputError as error:
        if error.argument.startswith(where):
            raise
        raise InputError(
            f"{where}: {error.argument}", error.expected, error.got, error.remedy
        ) from None


@contextmanager
def _as_yaml(path: Path) -> Iterator[None]:
    try:
        yield
    except InputError:
        raise
    except (yaml.YAMLError, ValueError) as error:  # ValueError: no such date
        raise InputError(str(path), "YAML", _syntax_error(error)) from None


def _syntax_error(error: Exception) -> str:
    if isinstance(error, yaml.MarkedYAMLError) and error.problem_mark is not None:
        mark = error.problem_mark
        return f"line {mark.line + 1}, column {mark.column + 1}: {error.problem}"
    return " ".join(str(error).split())
