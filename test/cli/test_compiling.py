# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Compiling before a command works, and ``focus_planner warm-up``."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from focus_planner.cli.main import main
from focus_planner.core.planning import precompile_processes as processes
from focus_planner.core.planning import work
from focus_planner.core.planning.precompile import Compiled
from focus_planner.core.progress import Progress
from focus_planner.core.rig.layouts import cylinder_rig
from focus_planner.io.rigs import save_rig
from testing.clock import Clock, StoppedTime

KEPT = Path("/cache/kernels-0123")
NOT_KEPT = (
    "compiled 139 kernels in 92.4 s; no other process will find them, since no folder for them can"
    " be written to: set NUMBA_CACHE_DIR to one that can"
)


@pytest.fixture
def compiles(monkeypatch):
    """Return a function that says what compiling comes to, and the works that were asked for."""
    asked = []

    def compiles(compiled):
        def precompile(works, on_progress, count):
            asked.append((tuple(works), count))
            on_progress(Progress("compiling", 0, math.nan, share=0.0, expected=90.0))
            return compiled

        monkeypatch.setattr(processes, "precompile_in_processes", precompile)
        monkeypatch.setattr(processes, "useful_processes", lambda: 3)
        return asked

    return compiles


@pytest.mark.parametrize(
    ("compiled", "status", "said", "noted"),
    [
        (
            Compiled({"em": 2.0, "cells": 12.0}, 139, 92.4, KEPT),
            0,
            f"compiled 139 kernels in 92.4 s; they are kept in {KEPT}\n",
            "focus_planner: loading kernels\n",
        ),
        (
            Compiled({}, 0, 0.0, KEPT),
            0,
            "all kernels are compiled\n",
            "focus_planner: loading kernels\n",
        ),
        (
            Compiled({}, 0, 0.0, None),
            0,
            "all kernels are compiled\n",
            "focus_planner: loading kernels\n",
        ),
        (
            Compiled({}, 139, 92.4, None),
            1,
            "",
            f"focus_planner: loading kernels\nfocus_planner: note: {NOT_KEPT}\n",
        ),
    ],
)
def test_warm_up_says_what_it_did(compiles, capsys, compiled, status, said, noted):
    asked = compiles(compiled)
    assert main(["warm-up"]) == status
    assert capsys.readouterr() == (said, noted)
    assert asked == [(work.ALL, 3)]


def test_where_there_is_no_terminal_a_line_now_and_then_tells_where_it_is(monkeypatch, capsys):
    clock = Clock()
    monkeypatch.setattr("focus_planner.cli.compiling.time", StoppedTime(clock.now))
    monkeypatch.setattr("focus_planner.core.progress.time_spent", lambda *_: "TIME")

    def precompile(_, on_progress, count):
        from focus_planner.cli.compiling import time  # noqa: PLC0415 - the one that stands still

        for number in range(50):
            time.advance(0.5)
            on_progress(Progress("compiling", number, math.nan, share=number / 50, expected=90.0))
        return Compiled({}, 50, 25.0, KEPT)

    monkeypatch.setattr(processes, "precompile_in_processes", precompile)
    assert main(["warm-up"]) == 0
    assert capsys.readouterr().err.splitlines() == [
        "focus_planner: loading kernels",
        "focus_planner: compiling, once, about 90 s, 38%, TIME",
        "focus_planner: compiling, once, about 90 s, 78%, TIME",
    ]


def test_warm_up_for_the_node_leaves_pictures_out(compiles, capsys):
    asked = compiles(Compiled({"em": 2.0, "cells": 12.0}, 2, 14.0, KEPT))
    assert main(["warm-up", "--for", "plans", "--modules"]) == 0
    assert capsys.readouterr().out.splitlines()[1:] == ["  12.0 s  cells", "   2.0 s  em"]
    assert main(["warm-up", "--for", "plans", "--quiet"]) == 0
    assert capsys.readouterr() == ("", "")
    assert asked == [(work.PLANS, 3), (work.PLANS, 3)]


def test_as_many_processes_compile_as_are_asked_for(compiles, capsys):
    asked = compiles(Compiled({}, 0, 0.0, KEPT))
    assert main(["warm-up", "--jobs", "2"]) == 0
    assert asked == [(work.ALL, 2)]
    assert main(["warm-up", "--jobs", "0"]) == 2
    assert "--jobs: expected a whole number of at least 1, got 0" in capsys.readouterr().err


def test_a_plan_compiles_what_it_runs_before_it_prepares_anything(compiles, tmp_path, monkeypatch):
    asked = compiles(Compiled({}, 0, 0.0, KEPT))
    body = "focus_planner/bodies/arms_out.ply"
    rig = tmp_path / "rig.yaml"
    save_rig(cylinder_rig(rows=2, columns=4), rig)

    class Prepared(Exception):  # noqa: N818
        pass

    def prepared(*_):
        raise Prepared

    monkeypatch.setattr("focus_planner.core.surface.scene.Scene", prepared)
    for method, works in (
        ("em", (work.PLANNING,)),
        ("k_view", (work.PLANNING, work.TUPLES_OF_CAMERAS)),
    ):
        with pytest.raises(Prepared):
            main(["plan", body, "--rig", str(rig), "--method", method])
        assert asked[-1] == (works, 1)
