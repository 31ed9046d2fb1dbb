# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Indexes count from an array's start, as kernels are compiled, unless they are literals.

In Python an index below 0 counts from the end. Numba therefore tests every index, which takes up
to half the time of small loops and keeps some from being vectorised. Kernels here never compute
such an index, so they take each for a number without a sign. A literal one, as in ``offsets[-1]``,
still counts from the end. Numba compiles the bodies of ``prange`` loops on its own, and tests the
indexes that are written there; what is called from there is compiled as here.

With ``NUMBA_BOUNDSCHECK=1`` a kernel that computes an index below 0 raises an IndexError.
"""

from __future__ import annotations

from typing import Any

from numba.core import ir, types
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import FunctionPass, PassManager, register_pass
from numba.core.typed_passes import NopythonRewrites, ParforPreLoweringPass


class KernelCompiler(CompilerBase):
    """Numba's compiler, but for indexes."""

    def define_pipelines(self) -> list[PassManager]:
        """Return Numba's passes, and the one for indexes when types are known."""
        passes = DefaultPassBuilder.define_nopython_pipeline(self.state)
        parallel = self.state.flags.auto_parallel.enabled
        passes.add_pass_after(_FromStart, ParforPreLoweringPass if parallel else NopythonRewrites)
        passes.finalize()
        return [passes]


@register_pass(mutates_CFG=False, analysis_only=False)
class _FromStart(FunctionPass):
    """Takes the signs off the types of indexes."""

    _name = "indexes_from_start"

    def __init__(self) -> None:
        # Numba's own does nothing, but is abstract.
        super().__init__()

    def run_pass(self, state: Any) -> bool:
        """Change how arrays are called for; return whether anything was changed."""
        signatures, changed = state.calltypes, False
        for block in state.func_ir.blocks.values():
            writes = [each for each in block.body if isinstance(each, ir.SetItem)]
            for call in (*writes, *block.find_exprs(op="getitem")):
                array, index, *value = signatures[call].args
                if not isinstance(array, types.Array):
                    continue
                unsigned = _unsigned(index, state.typemap[call.index.name])
                if unsigned != index:
                    signature = signatures.pop(call)
                    signatures[call] = signature.replace(args=(array, unsigned, *value))
                    changed = True
        return changed


def _unsigned(index: types.Type, named: types.Type) -> types.Type:
    """Return the type of an index without its sign, in a tuple each for itself.

    What it is named tells a literal, which keeps its sign.
    """
    if isinstance(named, types.IntegerLiteral):
        return index
    if isinstance(index, types.Integer):
        return types.uintp
    if isinstance(index, types.BaseTuple):
        return types.Tuple([_unsigned(*each) for each in zip(index, named, strict=True)])
    return index
