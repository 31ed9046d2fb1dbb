# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Work that is begun in a thread of its own, and plans whose parts are made so."""

from __future__ import annotations

import threading

import pytest
from numba import get_num_threads

from focus_planner.core import kernels
from focus_planner.core.ahead import Ahead
from focus_planner.core.planning import many_subjects, solving
from focus_planner.core.planning.formulation import formulate_problem
from focus_planner.core.planning.plan_focus import plan_focus
from focus_planner.core.planning.request import PlanRequest
from focus_planner.core.rig.layouts import cylinder_rig
from focus_planner.core.surface.scene import Scene
from focus_planner.core.validation import InputError
from testing.problems import box

RIG = cylinder_rig(rows=2, columns=6, radius=1.0, bottom=-0.1, top=0.1)
REQUEST = PlanRequest(samples=700, fresh_samples=800)


class Worker:
    """Work that knows which threads have done it."""

    def __init__(self, error: Exception | None = None) -> None:
        self.threads: list[threading.Thread] = []
        self.error = error

    def __call__(self) -> str:
        self.threads.append(threading.current_thread())
        if self.error and threading.current_thread() is not threading.main_thread():
            raise self.error
        return "done"


@pytest.fixture(params=[1, 2])
def cores(request, monkeypatch):
    monkeypatch.setattr("numba.config.NUMBA_NUM_THREADS", request.param)
    return request.param


@pytest.fixture
def two_cores(monkeypatch):
    monkeypatch.setattr("numba.config.NUMBA_NUM_THREADS", 2)


def here(worker: Worker) -> list[bool]:
    return [thread is threading.main_thread() for thread in worker.threads]


def test_work_is_done_elsewhere_once(two_cores):
    worker = Worker()
    with Ahead(worker) as ahead:
        assert [ahead.result(), ahead.result()] == ["done", "done"]
    assert here(worker) == [False]


def test_one_core_does_it_when_it_is_asked_for(monkeypatch):
    monkeypatch.setattr("numba.config.NUMBA_NUM_THREADS", 1)
    worker = Worker()
    with Ahead(worker) as ahead:
        assert not worker.threads
        assert ahead.result() == "done"
    assert here(worker) == [True]


def test_nothing_is_begun_that_is_not_to_be(two_cores):
    worker = Worker()
    with Ahead(worker, when=False):
        pass
    assert not worker.threads


def test_it_has_ended_when_the_context_does(two_cores):
    left, ended = threading.Event(), []

    def slow() -> None:
        left.wait()
        ended.append(True)

    def interrupted() -> None:
        with Ahead(slow):
            left.set()
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert ended


def test_what_failed_is_done_again_by_who_asks(two_cores):
    worker = Worker(MemoryError())
    with Ahead(worker) as ahead:
        assert ahead.result() == "done"
    assert here(worker) == [False, True]


def test_kernels_take_one_core_each_while_it_is_being_done(two_cores):
    def threads() -> int:
        with kernels.threads_for(10**9):
            return get_num_threads()

    whole = threads()
    with Ahead(threads) as outer, Ahead(threads) as inner:
        assert threads() == 1
        # In this order, and not that of the contexts.
        assert outer.result() == 1
        assert inner.result() == 1
        assert threads() == whole
    assert threads() == whole


def test_where_no_thread_can_be_started_it_is_done_here(two_cores, monkeypatch):
    def refuse(_: threading.Thread) -> None:
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr(threading.Thread, "start", refuse)
    worker = Worker()
    with Ahead(worker) as ahead:
        assert ahead.result() == "done"
    assert here(worker) == [True]


# --- plans ---------------------------------------------------------------------------------------


def told(plan):
    return (
        (plan.cameras, plan.cost, plan.lower_bound, plan.fresh_cost, plan.notes, plan.stop_log),
        plan.problem.base_cost.tobytes(),
        plan.prices.tobytes(),
    )


def planned(scene, steps, warm_start=None):
    def note(progress):
        steps.append((progress.stage, progress.iteration, progress.share))
        return True

    return plan_focus(scene, RIG, REQUEST, on_progress=note, warm_start=warm_start)


def test_plans_and_questions_are_the_same_on_one_core_and_on_two(monkeypatch):
    outcomes = []
    for number in (1, 2):
        monkeypatch.setattr("numba.config.NUMBA_NUM_THREADS", number)
        steps: list[object] = []
        first = planned(Scene(box((0.3, 0.3, 0.3))), steps)
        again = planned(Scene(box((0.31, 0.3, 0.3))), steps, first.warm_start)
        outcomes.append((told(first), told(again), steps))
    assert outcomes[0] == outcomes[1]


def test_a_plan_that_is_stopped_while_rays_are_cast_is_the_same(cores):
    def stop(progress):
        return progress.stage != "visibility"

    scene = Scene(box((0.3, 0.3, 0.3)))
    request = PlanRequest(samples=20_000, fresh_samples=1000)
    plan = plan_focus(scene, RIG, request, on_progress=stop)
    assert plan.samples < request.samples
    again = plan_focus(Scene(scene.surface), RIG, request, stop_log=plan.stop_log)
    assert (plan.samples, plan.cost) == (again.samples, again.cost)


def test_problems_are_formulated_at_once(two_cores, monkeypatch):
    threads = {}

    def formulate(*arguments, fresh=False, **options):
        threads[fresh] = threading.current_thread()
        return formulate_problem(*arguments, fresh=fresh, **options)

    monkeypatch.setattr(many_subjects, "formulate_problem", formulate)
    plan_focus(Scene(box((0.3, 0.3, 0.3))), RIG, REQUEST)
    assert threads[True] is threading.main_thread()
    assert threads[False] is not threading.main_thread()


def test_with_a_time_budget_they_are_formulated_one_after_the_other(two_cores, monkeypatch):
    threads = set()

    def formulate(*arguments, **options):
        threads.add(threading.current_thread())
        return formulate_problem(*arguments, **options)

    monkeypatch.setattr(many_subjects, "formulate_problem", formulate)
    request = PlanRequest(samples=700, time_budget=60.0)
    plan_focus(Scene(box((0.3, 0.3, 0.3))), RIG, request)
    assert threads == {threading.main_thread()}


def test_what_cannot_be_judged_ahead_tells_why(two_cores, monkeypatch):
    def refuse(*_):
        raise InputError("surface", "a good one", "a bad one")

    monkeypatch.setattr(solving, "judged", refuse)
    with pytest.raises(InputError, match="a bad one"):
        plan_focus(Scene(box((0.3, 0.3, 0.3))), RIG, REQUEST)
