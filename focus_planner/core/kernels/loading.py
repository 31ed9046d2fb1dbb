# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.


"""Machine code in the form that is kept, and how it gets ready to run.

Before it loads a function Numba prepares for compiling, and it reads the intermediate code that
comes with the machine code, which functions that are compiled later and call that one take in. Both
take several times as long as the loading itself. Here they are left until something is compiled.
"""

from __future__ import annotations

from typing import Any

from llvmlite import binding as llvm
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompileResult
from numba.core.runtime import rtsys

_INTRINSIC = "llvm."
# Names that code may take: what is there stays.
_there: set[str] = set()


def to_keep(result: Any) -> tuple[frozenset[str], frozenset[str], Any]:
    """Return what is kept of a kernel that was compiled.

    Returns
    -------
    defined, taken : frozenset of str
        The names that its code defines, and those that it takes from elsewhere.
    parts : tuple
        What Numba keeps of it.
    """
    module = result.library._get_module_for_linking()  # noqa: SLF001
    defined: set[str] = set()
    taken: set[str] = set()
    for values in (module.functions, module.global_variables):
        for value in values:
            (taken if value.is_declaration else defined).add(value.name)
    taken = {name for name in taken if not name.startswith(_INTRINSIC)}
    return frozenset(defined), frozenset(taken), result._reduce()  # noqa: SLF001


def ready(context: Any, kept: tuple[frozenset[str], frozenset[str], Any]) -> Any:
    """Return a kernel as it was compiled, ready to run, of what :func:`to_keep` returned.

    Parameters
    ----------
    context : CPUContext
        Numba's, of the processor that it was compiled for.
    kept : tuple
    """
    defined, taken, parts = kept
    rtsys.initialize(context)  # memory of arrays
    result = CompileResult._rebuild(_Target(context, defined, taken), *parts)  # noqa: SLF001
    return result._replace(target_context=context)


class _Target:
    """A processor as Numba knows it, and how code for it is loaded."""

    def __init__(self, context: Any, defined: frozenset[str], taken: frozenset[str]) -> None:
        self.typing_context = context.typing_context
        self.get_executable = context.get_executable
        self._context = context
        self._defined = defined
        self._taken = taken

    def codegen(self) -> _Target:
        return self

    def unserialize_library(self, state: Any) -> _Library:
        """Return the library of functions that Numba keeps in this state."""
        codegen = self._context.codegen()
        engine = codegen._engine  # noqa: SLF001
        if not _are_there(self._taken, engine):
            self._context.refresh()  # or loading would end the process
        name, _, (machine_code, intermediate_code) = state
        library = _Library(codegen, name)
        library.load(machine_code, intermediate_code)
        engine._defined_symbols |= self._defined  # noqa: SLF001
        return library


class _Library(JITCodeLibrary):
    """Functions that were compiled earlier."""

    _shared_module: Any

    def load(self, machine_code: bytes, intermediate_code: bytes) -> None:
        self._intermediate_code = intermediate_code
        self.enable_object_caching()
        self._set_compiled_object(machine_code)
        self._finalize_final_module()

    def _get_module_for_linking(self) -> Any:
        if self._shared_module is None:
            self._shared_module = llvm.parse_bitcode(self._intermediate_code)
        return self._shared_module


def _are_there(names: frozenset[str], engine: Any) -> bool:
    """Return whether all names are defined, by code that was loaded or by a library."""
    for name in names - _there:
        if not (engine.is_symbol_defined(name) or llvm.address_of_symbol(name)):
            return False
        _there.add(name)
    return True
