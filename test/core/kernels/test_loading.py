# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.


"""How machine code that was kept gets ready to run."""

from __future__ import annotations

import os
import subprocess
import sys
import textwrap

import pytest
from numba import njit
from numba.core import entrypoints

from focus_planner.core.kernels import kept, loading
from focus_planner.core.kernels.compiling import listening
from testing.small_kernel import made


def compiled_for(kernel, argument):
    """Call a kernel; return whether that compiled it."""
    told = []
    with listening(lambda _, is_ready: told.append(is_ready)):
        assert kernel(argument) == 2 * argument
    return told == [False, True]


@pytest.fixture
def is_kept(tmp_path, monkeypatch):
    """Have code kept in a folder of its own, and that of the kernel be there."""
    monkeypatch.setattr(kept, "folders", lambda: (tmp_path,))
    kept.kept_in.cache_clear()
    assert compiled_for(made(), 1)
    yield
    kept.kept_in.cache_clear()


def refuse(*_):
    raise AssertionError("for a compiler only")


def test_loading_does_nothing_that_only_compiling_takes(is_kept, monkeypatch):
    kernel = made()
    monkeypatch.setattr(type(kernel.targetctx), "refresh", refuse)
    monkeypatch.setattr(entrypoints, "init_all", refuse)
    monkeypatch.setattr(loading.llvm, "parse_bitcode", refuse)
    assert not compiled_for(kernel, 1)


def test_a_function_that_is_compiled_later_takes_in_what_was_loaded(is_kept, monkeypatch):
    kernel, read = made(), []
    parse = loading.llvm.parse_bitcode
    monkeypatch.setattr(
        loading.llvm, "parse_bitcode", lambda code: (read.append(code), parse(code))[1]
    )
    assert not compiled_for(kernel, 1)
    assert not read
    assert [njit(lambda x: kernel(x) + 1)(5), njit(lambda x: kernel(x) - 1)(5)] == [11, 9]
    assert len(read) == 1


def test_what_is_not_found_is_prepared_for(is_kept, monkeypatch):
    kernel, prepared = made(), []
    context = type(kernel.targetctx)
    refresh = context.refresh
    monkeypatch.setattr(loading, "_there", set())
    monkeypatch.setattr(loading.llvm, "address_of_symbol", lambda _: None)
    monkeypatch.setattr(context, "refresh", lambda this: (prepared.append(this), refresh(this)))
    assert not compiled_for(kernel, 1)
    assert prepared


@pytest.mark.parametrize("step", ["to_keep", "ready"])
def test_where_numba_is_another_than_it_is_written_for_kernels_are_compiled(
    is_kept, monkeypatch, step
):
    def fail(*_):
        raise AttributeError("'CompileResult' object has no attribute '_reduce'")

    monkeypatch.setattr(loading, step, fail)
    for argument in (1.5, 1.5) if step == "to_keep" else (1, 1):
        assert compiled_for(made(), argument)


@pytest.mark.processes
def test_a_process_that_finds_all_kernels_prepares_for_none():
    program = """
        import sys
        from focus_planner import PlanRequest, Scene, cylinder_rig, plan_focus
        from testing.problems import box

        rig = cylinder_rig(rows=2, columns=6, radius=1.0, bottom=-0.1, top=0.1)
        for method in ("k_view", "optimal"):
            plan_focus(Scene(box((0.3, 0.3, 0.3))), rig, PlanRequest(method, 300))
        print("numba.typed.typedlist" in sys.modules)
    """
    words = [sys.executable, "-c", textwrap.dedent(program)]
    # The first may have to compile.
    said = [
        subprocess.run(words, check=True, capture_output=True, text=True, env=os.environ).stdout
        for _ in range(2)
    ]
    assert said[1].strip() == "False"
