# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.
"""Packages that are imported when something of them is first asked for, not before.

For what a library imports of another and never uses here, though it takes longer than a plan.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder
from threading import RLock
from types import ModuleType
from typing import Any

_LOADER = "_deferred_loader"
_loading = RLock()


@contextmanager
def deferred(name: str) -> Iterator[None]:
    """Have a package loaded later if it is imported meanwhile; modules within it are not put off.

    Python's own ``importlib.util.LazyLoader`` loads a package as soon as one within it is imported.
    """
    later = _Later(name)
    sys.meta_path.insert(0, later)
    try:
        yield
    finally:
        sys.meta_path.remove(later)


class _Later(MetaPathFinder):
    """Finds one package, whose loading it puts off."""

    def __init__(self, name: str) -> None:
        self._name = name

    def find_spec(
        self, name: str, path: Sequence[str] | None, _: ModuleType | None = None
    ) -> ModuleSpec | None:
        spec = PathFinder.find_spec(name, path) if name == self._name else None
        if spec is not None and spec.loader is not None:
            spec.loader = _LaterLoader(spec.loader)
        return spec


class _LaterLoader(Loader):
    """Makes a package that loads itself by another loader."""

    def __init__(self, loader: Loader) -> None:
        self._loader = loader

    def create_module(self, spec: ModuleSpec) -> ModuleType | None:
        return self._loader.create_module(spec)

    def exec_module(self, module: ModuleType) -> None:
        module.__class__ = _Package
        module.__dict__[_LOADER] = self._loader


class _Package(ModuleType):
    """A package of which nothing but its name and place is there."""

    def __getattr__(self, name: str) -> Any:
        """Load it, now that something of it is asked for, and have others wait."""
        with _loading:
            loader = self.__dict__.pop(_LOADER, None)
            if loader is not None:
                self._load(loader)
        if type(self) is _Package:  # it asks for something of itself that is not there yet
            raise AttributeError(f"module {self.__name__!r} has no attribute {name!r}")
        return getattr(self, name)

    def _load(self, loader: Loader) -> None:
        assert self.__spec__ is not None
        self.__spec__.loader = self.__loader__ = loader
        try:
            loader.exec_module(self)
        except BaseException:
            self.__dict__[_LOADER] = loader
            raise
        object.__setattr__(self, "__class__", ModuleType)
