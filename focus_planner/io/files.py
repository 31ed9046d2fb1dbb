"""Writing files that are whole or not there, and saying in one line why one cannot be used."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from focus_planner.core.validation import InputError


def check_readable(path: Path, what: str) -> None:
    """Raise unless ``path`` is a file with something in it.

    Parameters
    ----------
    path : Path
    what : str
        What was expected there, for the error.

    Raises
    ------
    InputError
        If it is missing, a directory, not ours to read, or empty.
    """
    try:
        with path.open("rb") as file:
            empty = not file.read(1)
    except OSError as error:
        raise InputError(str(path), what, _reason(error)) from None
    if empty:
        raise InputError(str(path), what, "an empty file")


def read_text(path: Path, what: str) -> str:
    """Return a file's text.

    Raises
    ------
    InputError
        As :func:`check_readable`, or if it is not UTF-8 text.
    """
    check_readable(path, what)
    try:
        return path.read_text(encoding="utf-8")
    except UnicodeDecodeError:
        raise InputError(str(path), what, "something that is not text") from None


def read_array(path: Path) -> NDArray[Any]:
    """Return the array of a npy file.

    Raises
    ------
    InputError
        As :func:`check_readable`, or if it is no such file, or one of Python objects.
    """
    check_readable(path, "an array of numbers")
    try:
        array = np.load(path, allow_pickle=False)
    except Exception:  # noqa: BLE001
        # On a broken header it raises anything, a tokenizer's errors among others.
        raise unreadable(path, "npy", "no array of numbers") from None
    if not isinstance(array, np.ndarray):
        raise unreadable(path, "npy", "an archive")
    return array


def check_ended(path: Path, kind: str, content: bytes) -> None:
    """Raise unless a text's last line has its end, the one sign that most formats give.

    Raises
    ------
    InputError
        Says that the file is probably cut off.
    """
    if not content.endswith(b"\n"):
        raise InputError(
            str(path),
            f"a whole {kind} file",
            "one whose last line has no end",
            "it is probably cut off; if it is not, end it with a newline",
        )


def unreadable(path: Path, kind: str, reason: str) -> InputError:
    """Return the error for a file that is cut off or of another format than its name says."""
    return InputError(
        str(path),
        f"a whole {kind} file",
        " ".join(reason.split()),
        "it is probably cut off, or of another format than its name says",
    )


def check_writable(path: Path) -> None:
    """Raise unless a file can be written at ``path``: to be told before the work, not after.

    Raises
    ------
    InputError
        If its folder is missing or not ours to write to, or the path is a folder.
    """
    folder = path.resolve().parent
    if path.is_dir():
        raise InputError(str(path), "a file to write", "a folder")
    if not folder.is_dir():
        raise InputError(str(path), "a file in a folder that exists", f"no folder {folder}")
    target = path if path.exists() and not path.is_file() else folder
    if not os.access(target, os.W_OK):
        raise InputError(str(path), "a file that can be written", f"no permission in {folder}")


@contextmanager
def whole_file(path: Path) -> Iterator[BinaryIO]:
    """Open a file that takes its place at ``path`` when the block ends, and only if it ends well.

    Raises
    ------
    InputError
        If it cannot be written.
    """
    path = path.resolve()
    if path.exists() and not path.is_file():  # /dev/stdout, a named pipe
        with _writing(path), path.open("wb") as file:
            yield file
        return
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        with _writing(path):
            with part.open("xb") as file:
                yield file
                file.flush()
                os.fsync(file.fileno())
            part.replace(path)
    finally:
        part.unlink(missing_ok=True)


@contextmanager
def _writing(path: Path) -> Iterator[None]:
    try:
        yield
    except BrokenPipeError:
        raise
    except OSError as error:
        raise InputError(str(path), "a file that can be written", _reason(error)) from None


def _reason(error: OSError) -> str:
    reasons: dict[type[OSError], str] = {
        FileNotFoundError: "no such file",
        IsADirectoryError: "a folder",
        PermissionError: "no permission",
    }
    return reasons.get(type(error), error.strerror or str(error))
