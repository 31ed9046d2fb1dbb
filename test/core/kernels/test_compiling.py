# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Where machine code is kept, who is told, and what a host program notices of it."""

from __future__ import annotations

import os
import subprocess
import sys
import textwrap
import threading

import pytest

from focus_planner.core.kernels import compiling, kept
from focus_planner.core.kernels.compiling import listening
from testing.small_kernel import made


def called(kernel, argument=1):
    """Return what it tells meanwhile: what is compiled, and what is ready."""
    told = []
    with listening(lambda which, is_ready: told.append((which.name, is_ready))):
        assert kernel(argument) == 2 * argument
    return told


@pytest.fixture
def places(tmp_path, monkeypatch):
    """Two folders for kernels; the second is preferred, and both can be written to."""
    both = [tmp_path / "image", tmp_path / "user"]
    monkeypatch.setattr(kept, "folders", lambda: tuple(both))
    found = kept.kept_in
    found.cache_clear()
    yield both
    found.cache_clear()


COMPILED, LOADED = [("twice", False), ("twice", True)], [("twice", True)]


def test_a_kernel_is_compiled_once_for_all_processes(places):
    first = made()
    assert not first.is_ready
    assert called(first) == COMPILED
    assert called(first) == []
    second = made()
    assert second.is_ready
    assert called(second) == LOADED
    assert (first.room, kept.kept_in()) == ("small_kernel", places[0])
    assert called(second, 1.5) == COMPILED  # for other types
    assert called(made(), 1.5) == LOADED


def test_processes_may_keep_code_at_once(places, monkeypatch):
    # Both read the index before either writes it, and the first to write it is the last to go on.
    save_index, waiting = kept._Files._save_index, []

    def save_index_together(files, index):
        waiting.append((files, index))
        if len(waiting) == 1:
            assert called(made(), 1.5) == COMPILED
        else:
            for each in waiting:
                save_index(*each)

    with monkeypatch.context() as patch:
        patch.setattr(kept._Files, "_save_index", save_index_together)
        assert called(made(), 1) == COMPILED
    assert called(made(), 1.5) == LOADED
    assert called(made(), 1) == COMPILED  # the index has forgotten it
    assert (called(made(), 1), called(made(), 1.5)) == (LOADED, LOADED)


def test_an_image_serves_those_who_cannot_write_to_it(places, monkeypatch):
    assert called(made()) == COMPILED
    monkeypatch.setattr(kept, "kept_in", lambda: places[1])
    assert called(made()) == LOADED
    assert called(made(), 1.5) == COMPILED
    assert called(made(), 1.5) == LOADED
    assert list(places[1].iterdir())


def test_where_nothing_can_be_kept_it_works_all_the_same(places):
    for place in places:
        place.write_text("no folder")
    assert kept.kept_in() is None
    assert called(made()) == COMPILED
    assert called(made()) == COMPILED


@pytest.mark.parametrize(
    "damaged",
    [
        lambda content: content[:10],
        lambda content: content[:10] + bytes(len(content) - 10),
        lambda content: content.replace(b"numba.core", b"numba.cora"),  # a wrong bit
    ],
    ids=["cut short", "zeros", "a wrong bit"],
)
def test_damaged_files_are_made_anew(places, damaged):
    called(made())
    for file in places[0].iterdir():
        before = file.read_bytes()
        file.write_bytes(damaged(before))
        assert file.read_bytes() != before
    again = made()
    assert not again.is_ready
    assert called(again) == COMPILED
    assert called(made()) == LOADED


def test_a_disk_that_is_full_costs_nothing_but_time(places, monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(kept._Folder, "save_overload", full)
    assert called(made()) == COMPILED


def test_code_for_another_processor_is_none(places, monkeypatch):
    called(made())
    kernel = made()
    codegen = type(kernel.targetctx.codegen())
    monkeypatch.setattr(codegen, "magic_tuple", lambda _: ("another", "processor", ""))
    assert not kernel.is_ready
    assert called(kernel) == COMPILED


def test_the_users_folders_are_searched(monkeypatch):
    monkeypatch.setattr(kept.config, "CACHE_DIR", "")
    monkeypatch.setenv("XDG_CACHE_HOME", "/home/of/mine")
    (beside, mine) = kept.folders()
    assert beside.parent.parts[-2:] == ("kernels", "__pycache__")
    monkeypatch.setattr(kept.config, "CACHE_DIR", "/given")
    (given, _) = kept.folders()
    assert given.parent.as_posix() == "/given"
    assert given.name == beside.name == mine.name
    if sys.platform == "linux":
        assert mine.parent.as_posix() == "/home/of/mine/focus_planner"
    # A user without a home is not given a folder named "~".
    monkeypatch.setenv("XDG_CACHE_HOME", "~/.cache")
    assert kept.folders() == (given,)


def test_a_change_costs_the_kernels_that_use_it_and_no_others(tmp_path, monkeypatch):
    imports = {"tuples": (), "pairs": ("tuples",), "k_view": ("pairs", "compiling"), "noise": ()}
    for name, used in imports.items():
        lines = [f"from focus_planner.core.kernels.{each} import kernel\n" for each in used]
        (tmp_path / f"{name}.py").write_text("".join(lines))
    monkeypatch.setattr(kept, "_HERE", tmp_path)

    def versions():
        kept._version_of.cache_clear()
        kept._needed_by.cache_clear()
        return {name: kept._version_of(tmp_path / f"{name}.py") for name in imports}

    before = versions()
    (tmp_path / "tuples.py").write_text("MOST = 3\n")
    after = versions()
    assert {name for name in imports if after[name] != before[name]} == {
        "tuples",
        "pairs",
        "k_view",
    }


def test_other_threads_are_told_nothing(places):
    told = []
    with listening(lambda *what: told.append(what)):
        thread = threading.Thread(target=lambda: made()(1))
        thread.start()
        thread.join()
    assert told == []


# --- a program that uses Numba itself ------------------------------------------------------------


def run(program, **environment):
    names = ("NUMBA_THREADING_LAYER_PRIORITY", "GOMP_SPINCOUNT", "TCM_ENABLE")
    inherited = {name: value for name, value in os.environ.items() if name not in names}
    words = [sys.executable, "-W", "error", "-c", textwrap.dedent(program)]
    subprocess.run(words, check=True, env=inherited | environment)


@pytest.mark.processes
def test_a_host_program_keeps_its_settings():
    run("""
        import os
        from numba import config, get_num_threads, set_num_threads

        def settings():
            return {name: getattr(config, name) for name in dir(config) if name.isupper()}

        set_num_threads(1)
        before = dict(os.environ), settings(), get_num_threads()
        import focus_planner
        from focus_planner import Mesh, PlanRequest, Scene, cylinder_rig, plan_focus
        from testing.problems import box

        rig = cylinder_rig(rows=2, columns=6, radius=1.0, bottom=-0.1, top=0.1)
        plan_focus(Scene(box((0.3, 0.3, 0.3))), rig, PlanRequest("em", 300))
        environment = dict(os.environ)
        environment.pop("TCM_ENABLE", None)  # which Open3D sets
        assert (environment, settings(), get_num_threads()) == before
    """)


@pytest.mark.processes
@pytest.mark.parametrize("layer", ["workqueue", "default"])
def test_two_threads_may_plan_at_once_whatever_the_layer(layer):
    run(
        """
        from concurrent.futures import ThreadPoolExecutor
        from focus_planner import PlanRequest, Scene, cylinder_rig, plan_focus
        from testing.problems import box

        rig = cylinder_rig(rows=2, columns=6, radius=1.0, bottom=-0.1, top=0.1)
        scene = Scene(box((0.3, 0.3, 0.3)))

        def plan(_):
            return [plan_focus(scene, rig, PlanRequest("em", 300)).cost for _ in range(20)]

        with ThreadPoolExecutor(4) as threads:
            assert len({cost for costs in threads.map(plan, range(4)) for cost in costs}) == 1
        """,
        NUMBA_THREADING_LAYER=layer,
    )


@pytest.mark.processes
@pytest.mark.skipif(not hasattr(os, "fork"), reason="there are no forks")
@pytest.mark.parametrize("kind", ["mesh", "cloud"])
def test_a_process_forked_beside_threads_of_openmp_is_told_so(kind):
    run(
        f"""
        import multiprocessing
        import numpy as np
        from numba import set_num_threads, threading_layer
        from focus_planner import PlanRequest, PointCloud, Scene, cylinder_rig, plan_focus
        from testing.problems import box

        surface = box((0.3, 0.3, 0.3))
        if "{kind}" == "cloud":
            surface = PointCloud(np.random.default_rng(0).random((16, 3)))

        def plan():
            try:
                plan_focus(Scene(surface), cylinder_rig(rows=2, columns=6), PlanRequest("em", 300))
            except RuntimeError as error:
                assert "multiprocessing.get_context('spawn')" in str(error), error
                raise SystemExit(7)

        set_num_threads(1)  # begins the threads
        assert threading_layer() == "omp"
        process = multiprocessing.get_context("fork").Process(target=plan)
        process.start()
        process.join()
        assert process.exitcode == 7, process.exitcode
        """,
        NUMBA_THREADING_LAYER="omp",
    )


@pytest.mark.processes
@pytest.mark.skipif(not hasattr(os, "fork"), reason="there are no forks")
def test_a_process_forked_before_the_first_plan_may_plan():
    run("""
        import multiprocessing
        from focus_planner import PlanRequest, Scene, cylinder_rig, plan_focus
        from testing.problems import box

        def plan():
            plan_focus(Scene(box((0.3, 0.3, 0.3))), cylinder_rig(), PlanRequest("em", 300))

        process = multiprocessing.get_context("fork").Process(target=plan)
        process.start()
        process.join()
        assert process.exitcode == 0, process.exitcode
    """)


def test_a_layer_that_only_one_thread_may_enter_is_entered_by_one(monkeypatch):
    for layer, turn in (("omp", compiling._any_time), ("workqueue", compiling._one_at_a_time)):
        monkeypatch.setattr(compiling, "_layer", lambda layer=layer: layer)
        assert compiling._turn() is turn
