# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Where the machine code of kernels is kept from one process to the next.

Numba keeps it in one folder only, which has to be writable even to read from, and it takes note of
changes of a kernel's own file only, but kernels call those of others. Here the code's files are
called by a kernel's own source and all that it imports from this package, so that a change costs
the kernels that it concerns and no others. There are two places: the one that NUMBA_CACHE_DIR
names, or else beside the sources; and the user's. Both are read, so that an image's kernels serve
every user of it; the first that can be written to is written to.
"""

from __future__ import annotations

import hashlib
import re
import sys
import tempfile
import uuid
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import cache, partial
from pathlib import Path
from typing import Any

import numba
from numba import config
from numba.core.caching import (
    CompileResultCacheImpl,
    FunctionCache,
    IndexDataCacheFile,
    NullCache,
)
from numba.misc.appdirs import AppDirs

from focus_planner.core.kernels import loading

_HERE = Path(__file__).parent
#: What reading files may raise: of a damaged one, anything that unpickling does.
_UNREADABLE = Exception
_IMPORTED = re.compile(r"^from focus_planner\.core\.kernels\.(\w+) import", re.MULTILINE)
#: The modules that say how kernels are compiled, and all that are part of no kernel.
_COMPILER = ("compiling", "indexing")
_NO_KERNELS = frozenset({*_COMPILER, "kept", "loading"})


def folders() -> tuple[Path, ...]:
    """Return where code that is compiled as here may be, in the order of preference."""
    given = Path(config.CACHE_DIR) if config.CACHE_DIR else _HERE / "__pycache__"
    places = given, Path(AppDirs("focus_planner", False).user_cache_dir)
    # There are users without a home.
    return tuple(place / _version() for place in places if "~" not in place.parts)


@cache
def kept_in() -> Path | None:
    """Return the folder in which newly compiled kernels are kept; None if there is none."""
    for folder in folders():
        with suppress(OSError):
            folder.mkdir(parents=True, exist_ok=True)
            tempfile.TemporaryFile(dir=folder).close()
            return folder
    return None


@cache
def _version() -> str:
    """Return what changes with the way that kernels are compiled, and the form they are kept in."""
    checked = str(config.BOUNDSCHECK)
    digest = hashlib.sha256((numba.__version__ + checked).encode())
    for name in (*_COMPILER, "loading"):
        digest.update((_HERE / f"{name}.py").read_bytes())
    return f"kernels-{digest.hexdigest()[:12]}"


@cache
def _version_of(source: Path) -> str:
    """Return what changes with the sources that a file's kernels are compiled from."""
    digest = hashlib.sha256()
    for path in sorted(_needed_by(source)):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:12]


@cache
def _needed_by(source: Path) -> frozenset[Path]:
    """Return a file, and all within this package that it imports, directly or not."""
    names = _IMPORTED.findall(source.read_text(encoding="utf-8"))
    used = [_HERE / f"{name}.py" for name in names if name not in _NO_KERNELS]
    return frozenset([source]).union(*map(_needed_by, used))


class KeptCode(NullCache):
    """The machine code of a kernel that is kept; a cache as Numba's dispatchers take it.

    Parameters
    ----------
    function : callable
        The kernel's.
    on_missing : callable
        Called when there is no code for some types of arguments.
    """

    def __init__(self, function: Callable[..., Any], on_missing: Callable[[], object]) -> None:
        self._function = function
        self._on_missing = on_missing
        self._was_found = False
        self._caches: dict[Path, _Folder] = {}

    @property
    def cache_path(self) -> str | None:
        """The folder that is written to."""
        folder = kept_in()
        return None if folder is None else str(folder)

    def _read(self) -> Iterator[_Folder]:
        """Yield where code is looked for; most have it in the first place, or are never asked."""
        for folder in folders():
            if folder not in self._caches:
                self._caches[folder] = _Folder(self._function, folder)
            yield self._caches[folder]

    def is_kept(self, codegen: Any) -> bool:
        """Return whether there is code for this processor, for whatever types.

        Once there is, it is not looked for again: plans ask this of every kernel.
        """
        if not self._was_found:
            self._was_found = any(folder.has_code_for(codegen) for folder in self._read())
        return self._was_found

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the code for a signature; None if it has to be compiled."""
        for folder in self._read():
            with suppress(_UNREADABLE):
                code = folder.load_overload(sig, target_context)
                if code is not None:
                    return code
        self._on_missing()
        return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep code, if that is possible."""
        folder = kept_in()
        if folder is None:
            return
        cache = _Folder(self._function, folder)
        # The disk may be full, and another Numba's results have another form: that costs time only.
        with suppress(Exception):
            try:
                cache.save_overload(sig, data)
            except OSError:
                raise
            except _UNREADABLE:
                cache.flush()
                cache.save_overload(sig, data)

    def flush(self) -> None:
        """Forget what is kept where it can be written to."""
        folder = kept_in()
        if folder is not None:
            _Folder(self._function, folder).flush()


class _Folder(FunctionCache):
    """Numba's own cache of a function, in a given folder."""

    def __init__(self, function: Callable[..., Any], folder: Path) -> None:
        self._impl_class = partial(_Naming, folder)
        super().__init__(function)
        naming = self._impl
        self._cache_file = _Files(
            naming.get_cache_path(), naming.filename_base, naming.get_source_stamp()
        )

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the code for a signature; None if there is none."""
        # Numba's own would prepare for compiling first.
        with self._guard_against_spurious_io_errors():
            return self._load_overload(sig, target_context)

    def has_code_for(self, codegen: Any) -> bool:
        try:
            # A signature, what the code is for, and hashes of the function.
            return any(key[1] == codegen.magic_tuple() for key in self._cache_file._load_index())  # noqa: SLF001
        except _UNREADABLE:
            return False


class _Files(IndexDataCacheFile):
    """The files of a function, which several processes may write at once.

    Numba's own number the code of each set of types by what the index has. Two processes may then
    give one number to two, and code be found for types that it is not for. Here the worst is that a
    process does not know of what another has just compiled, and compiles it again.
    """

    def save(self, key: Any, data: Any) -> None:
        """Keep code, and only then say so."""
        name = self._data_name(uuid.uuid4().int >> 64)
        self._save_data(name, data)
        self._save_index(self._load_index() | {key: name})


class _Naming(CompileResultCacheImpl):
    """How the files of a function are called, and what is in them; also where a cache looks."""

    def __init__(self, folder: Path, function: Callable[..., Any]) -> None:
        self._folder = folder
        self._py_file = function.__code__.co_filename
        self._lineno = function.__code__.co_firstlineno
        self._locator = self
        source = Path(self._py_file)
        self._version = _version_of(source)
        name = f"{source.stem}.{function.__qualname__}-{self._version}"
        self._filename_base = self.get_filename_base(name, getattr(sys, "abiflags", ""))

    def reduce(self, cres: Any) -> Any:
        """Return what is kept of a kernel that was compiled."""
        return loading.to_keep(cres)

    def rebuild(self, target_context: Any, payload: Any) -> Any:
        """Return the kernel of what was kept."""
        return loading.ready(target_context, payload)

    def ensure_cache_path(self) -> None:
        """Make the folder."""
        self._folder.mkdir(parents=True, exist_ok=True)

    def get_cache_path(self) -> str:
        """Return the folder."""
        return str(self._folder)

    def get_source_stamp(self) -> str:
        """Return what changes with the sources."""
        return self._version

    def get_disambiguator(self) -> str:
        """Return what tells functions of one name apart."""
        return str(self._lineno)
