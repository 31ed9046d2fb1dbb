# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Reading and writing files: only regular ones, of a limited size; whole, or with an error."""

from __future__ import annotations

import os
import stat
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from io import BufferedReader, BytesIO
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from focus_planner.core.notes import Note
from focus_planner.core.validation import InputError
from focus_planner.io.reading import bytes_came


class BrokenFileError(ValueError):
    """What is wrong with a file, in the words of its user; becomes an :class:`InputError`."""


#: What a text may lack that does not end in a newline.
DIGITS, THE_REST = "its last number may lack digits", "the rest is missing"

#: What is expected of a file with a surface, for errors.
SURFACE = "a mesh or point cloud"

#: Bytes of any file, and of one that becomes objects of Python: texts of cameras, plans, tables.
MAX_BYTES, MAX_TEXT = 4 << 30, 64 << 20

# Bytes that are read at once, and those that tell text from other content.
_PIECE, _START = 16 << 20, 1 << 16
if sys.platform == "win32":
    _TO_READ = os.O_RDONLY | os.O_BINARY | os.O_NOINHERIT
else:
    # A pipe without a writer is opened at once, and not waited for.
    _TO_READ = os.O_RDONLY | os.O_NONBLOCK | os.O_NOCTTY
_KINDS = {stat.S_IFDIR: "a folder", stat.S_IFIFO: "a pipe", stat.S_IFSOCK: "a socket"}


@contextmanager
def open_regular(
    path: Path, what: str, max_bytes: int = MAX_BYTES, *, may_be_empty: bool = False
) -> Iterator[BinaryIO]:
    """Open the file that a name leads to: the only way in which this package opens what it is told.

    Only regular files are opened, so that no device, pipe or socket is touched, none is waited for,
    and none goes on for ever.

    Parameters
    ----------
    path : Path
    what : str
        What was expected there, for errors.
    max_bytes : int
        How large it may be.
    may_be_empty : bool
        Whether an empty file is one.

    Raises
    ------
    InputError
        If it is missing, anything but a regular file, empty or too large, or may not be read.
    """
    try:
        with _opened(path, what) as file:
            if os.fstat(file.fileno()).st_size > max_bytes:
                raise _too_large(path, what, max_bytes)
            if not may_be_empty and not file.peek(1):
                raise InputError(str(path), what, "an empty file")
            yield file
    except OSError as error:
        raise InputError(str(path), what, _reason(error)) from None


def check_readable(path: Path, what: str) -> None:
    """Raise unless ``path`` is a readable file that is not empty.

    Raises
    ------
    InputError
        As :func:`open_regular`.
    """
    with open_regular(path, what):
        pass


def read_bytes(path: Path, what: str, max_bytes: int = MAX_BYTES) -> bytes:
    """Return a file's content.

    Raises
    ------
    InputError
        As :func:`open_regular`.
    """
    with open_regular(path, what, max_bytes) as file:
        # One that grows meanwhile, or that tells no size as those of /proc, ends here too.
        content = _read_in_pieces(file, max_bytes + 1)
    if len(content) > max_bytes:
        raise _too_large(path, what, max_bytes)
    return content


def _read_in_pieces(file: BinaryIO, most: int) -> bytes:
    """Return at most so many bytes of a file, and tell meanwhile how far it is read."""
    size = os.fstat(file.fileno()).st_size
    content = BytesIO()
    while piece := file.read(min(_PIECE, most - content.tell())):
        is_text = b"\0" not in (content.getbuffer()[:_START].tobytes() or piece[:_START])
        content.write(piece)
        bytes_came(content.tell(), max(size, content.tell()), is_text=is_text)
    return content.getvalue()


def read_text(path: Path, what: str, max_bytes: int = MAX_TEXT) -> str:
    """Return a file's text, without a byte order mark.

    Raises
    ------
    InputError
        As :func:`open_regular`, or if it is not UTF-8 text.
    """
    try:
        return (
            without_byte_order_mark(read_bytes(path, what, max_bytes))
            .decode()
            .replace("\r\n", "\n")
            .replace("\r", "\n")
        )
    except UnicodeDecodeError:
        raise InputError(str(path), what, "something that is not text") from None


def _opened(path: Path, what: str) -> BufferedReader:
    if "\0" in str(path):
        raise InputError(str(path), what, "no name of a file")
    _check_regular(path, what, path.stat())
    file = os.fdopen(os.open(path, _TO_READ), "rb")  # it may be another by now
    try:
        _check_regular(path, what, os.fstat(file.fileno()))
    except InputError:
        file.close()
        raise
    return file


def _check_regular(path: Path, what: str, status: os.stat_result) -> None:
    if stat.S_ISREG(status.st_mode):
        return
    kind = _KINDS.get(stat.S_IFMT(status.st_mode), "a device")
    remedy = "" if kind == "a folder" else "save its contents in a file, and name that"
    raise InputError(str(path), what, kind, remedy)


def _too_large(path: Path, what: str, max_bytes: int) -> InputError:
    return InputError(str(path), f"{what} of at most {max_bytes:,} bytes", "more")


def without_byte_order_mark(content: bytes) -> bytes:
    """Return text as UTF-8 without the mark that Windows programs begin it with.

    Raises
    ------
    UnicodeDecodeError
        If the mark announces UTF-16, and it is not.
    """
    if content.startswith(b"\xef\xbb\xbf"):
        return content[3:]
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        return content.decode("utf-16").encode()
    return content


def read_array(path: Path) -> NDArray[Any]:
    """Return the array of a npy file.

    Raises
    ------
    InputError
        As :func:`open_regular`, or if it is not a npy file, or one of Python objects.
    """
    with open_regular(path, "an array of numbers") as file:
        try:
            array = np.load(file, allow_pickle=False)
        except Exception:  # noqa: BLE001
            # A broken header can raise anything, even a tokenizer's errors.
            raise unreadable(path, "npy", "no array of numbers") from None
    if not isinstance(array, np.ndarray):
        raise unreadable(path, "npy", "an archive")
    return array


def unfinished_line(path: Path, content: bytes, lacks: str) -> tuple[Note, ...]:
    """Return a note if a text that was read does not end in a newline.

    Parameters
    ----------
    path : Path
    content : bytes
    lacks : str
        What is missing if it was cut off there: :data:`DIGITS` where all that the file announces
        is there, otherwise :data:`THE_REST`.
    """
    if content.endswith((b"\n", b"\r")) or not content.strip():
        return ()
    return (
        Note(
            "left_out",
            f"{path}: its last line does not end in a newline: if it was cut off there, {lacks};"
            " if it is whole, add a newline at its end",
        ),
    )


def unreadable(path: Path, kind: str, reason: str) -> InputError:
    """Return the error for a file that is truncated, or in another format than its name says."""
    return InputError(
        str(path),
        f"a complete {kind} file",
        " ".join(reason.split()),
        "it is probably truncated, or in another format than its name says",
    )


@contextmanager
def refusing(path: Path, kind: str) -> Iterator[None]:
    """Turn all that a broken file may lead to into the error of :func:`unreadable`.

    Raises
    ------
    InputError
        With the text of a :class:`BrokenFileError`. Others, which Python and NumPy word for
        programmers, are not repeated.
    """
    try:
        yield
    except InputError:
        raise
    except BrokenFileError as error:
        raise unreadable(path, kind, str(error)) from None
    except UnicodeDecodeError:
        raise unreadable(path, kind, "text that is not complete") from None
    except (ArithmeticError, AttributeError, LookupError, RecursionError, TypeError, ValueError):
        raise unreadable(path, kind, "values that do not fit together") from None


def resolved(path: Path) -> Path:
    """Return where a path leads, links followed; one with links in a circle as far as it leads.

    :meth:`pathlib.Path.resolve` raises, for such, what depends on the version of Python.
    """
    return Path(os.path.realpath(path))


def is_folder(path: Path) -> bool:
    """Return whether there is a folder: never at a name too long, for which pathlib raises."""
    return _mode(path, stat.S_ISDIR)


def is_file(path: Path) -> bool:
    """Return whether there is a regular file."""
    return _mode(path, stat.S_ISREG)


def is_there(path: Path) -> bool:
    """Return whether there is anything that can be found by this name."""
    return _mode(path, lambda _: True)


def _is_special(path: Path) -> bool:
    return _mode(path, lambda mode: not stat.S_ISREG(mode))


def _mode(path: Path, is_one: Callable[[int], bool]) -> bool:
    try:
        return is_one(path.stat().st_mode)
    except (OSError, ValueError):
        return False


def check_writable(path: Path) -> None:
    """Raise unless a file can be written at ``path``; called before the work, not after it.

    Raises
    ------
    InputError
        If its folder is missing or may not be written to, the path is a folder, or its name is too
        long.
    """
    folder = resolved(path).parent
    if is_folder(path):
        raise InputError(str(path), "a file to write", "a folder")
    if not is_folder(folder):
        raise InputError(str(path), "a file in a folder that exists", f"no folder {folder}")
    target = path if _is_special(path) else folder
    if not os.access(target, os.W_OK):
        raise InputError(str(path), "a file that can be written", f"no permission in {folder}")
    with _reporting(path), suppress(FileNotFoundError):
        _part_of(resolved(path)).lstat()


def _part_of(path: Path) -> Path:
    """Return where a file is written before it is whole."""
    return path.with_name(f".{path.name}.{os.getpid()}.part")


def check_folder_writable(folder: Path) -> None:
    """Raise unless files can be written to a folder, which may be new in one that exists.

    Called before the work, it makes nothing; :func:`made_folder` does, with the first file.

    Raises
    ------
    InputError
        If it is a file, its own folder is missing or may not be written to, or its name is too
        long.
    """
    if is_there(folder) and not is_folder(folder):
        raise InputError(str(folder), "a folder to write to", "a file")
    with _reporting(folder), suppress(FileNotFoundError):
        folder.lstat()
    target = folder if is_folder(folder) else resolved(folder).parent
    if not is_folder(target):
        raise InputError(
            str(folder), "a folder, or a new one in one that exists", f"no folder {target}"
        )
    if not os.access(target, os.W_OK):
        raise InputError(str(folder), "a folder to write to", f"no permission in {target}")


def made_folder(folder: Path) -> Path:
    """Return a folder, once it is there.

    Raises
    ------
    InputError
        If it cannot be made.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except FileExistsError:
        raise InputError(str(folder), "a folder", "a file") from None
    except OSError as error:
        raise InputError(str(folder), "a folder", error.strerror or str(error)) from None
    return folder


@contextmanager
def atomic_write(path: Path) -> Iterator[BinaryIO]:
    """Open a temporary file that replaces ``path`` when the block ends without an exception.

    Special files, such as /dev/stdout, are written directly.

    Raises
    ------
    InputError
        If it cannot be written.
    """
    # Before resolving: what /dev/stdout leads to has no path if it is a pipe.
    if _is_special(path):
        with _reporting(path), path.open("wb") as file:
            yield file
        return
    path = resolved(path)
    part = _part_of(path)
    try:
        with _reporting(path):
            with part.open("xb") as file:
                yield file
                file.flush()
                os.fsync(file.fileno())
            part.replace(path)
    finally:
        with suppress(OSError):  # whose reason has been told
            part.unlink(missing_ok=True)


@contextmanager
def _reporting(path: Path) -> Iterator[None]:
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
