# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A planner in another process: what it is given, and what happens when it hangs or dies."""

from __future__ import annotations

import math
import threading
import time
from dataclasses import replace
from functools import partial
from itertools import count
from multiprocessing.connection import Pipe
from pathlib import Path

import pytest

from focus_planner.core.planning.plan_focus import plan_focus
from focus_planner.core.planning.precompile import Compiled
from focus_planner.core.planning.request import PlanRequest
from focus_planner.core.planning.resource_limits import ResourceLimits
from focus_planner.core.planning.work import DEPTHS, PICTURES, PLANS
from focus_planner.core.problem.cost_model import CostModel
from focus_planner.core.progress import Progress
from focus_planner.core.rig.layouts import cylinder_rig
from focus_planner.core.surface.scene import Scene
from focus_planner.core.validation import InputError
from focus_planner.messages.reading import Optics
from focus_planner.runtime import planning_orders as orders
from focus_planner.runtime.description import ShownPlan, describe_plan
from focus_planner.runtime.inputs import Arrival
from focus_planner.runtime.planning_process import PlanningProcess
from focus_planner.runtime.remote_planner import (
    PlanningDied,
    PlanningEnded,
    RemotePlanner,
    Wish,
)
from testing.messages import Log
from testing.planning_workers import ThreadedWorker
from testing.problems import box

REQUEST = PlanRequest(method="em", samples=300)
RIG = cylinder_rig(rows=2, columns=6, radius=1.0, bottom=-0.1, top=0.1)
OTHER_RIG = cylinder_rig(rows=2, columns=7, radius=1.0, bottom=-0.1, top=0.1)
COUNT = count()
BOX = box((0.3, 0.3, 0.3))
OTHER = box((0.25, 0.3, 0.35))


def the(content, _):
    if content is MemoryError:
        raise MemoryError
    if content is InputError:
        raise InputError("mesh", "a good one", "a bad one")
    return content


def go_on():
    return Wish.GO_ON


class Bench:
    """A planner whose processes are threads."""

    def __init__(self):
        self.log, self.workers, self.rigs = Log(), [], []
        self.intercept = lambda order: None
        self.planner = RemotePlanner(self.start, self.log, self.rigs.append)

    def start(self):
        self.workers.append(ThreadedWorker(self._intercept))
        return self.workers[-1]

    def _intercept(self, order):
        self.intercept(order)

    def surface(self, content):
        self.planner.surface.receive(arrival("~/mesh", content))

    def rig(self, content):
        self.planner.rig.receive(arrival("~/rig", content))

    def digest(self, wish=go_on, tell=lambda _: None):
        self.planner.digest(Optics(), 0, wish, tell)

    def plan(
        self,
        request=REQUEST,
        wish=go_on,
        steps=None,
        limits=ResourceLimits(),  # noqa: B008
        *,
        plan_id="a plan",
        in_force="",
    ):
        order = orders.Plan(
            request,
            CostModel(),
            limits,
            None,
            keep_warm=False,
            is_recorded=steps is not None,
            plan_id=plan_id,
            in_force=in_force,
        )
        on_step = (lambda step: steps.append(step) or True) if steps is not None else None
        return self.planner.plan(order, on_step, lambda _: None, wish)


def arrival(topic, content):
    # Messages of equal bytes are taken to be equal.
    payload = b"\0\1\0\0" + next(COUNT).to_bytes(20, "little")
    return Arrival(topic, "a type", payload, partial(the, content))


@pytest.fixture
def bench():
    bench = Bench()
    yield bench
    bench.planner.close()


@pytest.fixture
def ready(bench):
    bench.surface(BOX)
    bench.rig(RIG)
    bench.digest()
    return bench


def same(plan, surface, rig):
    return plan.cameras == plan_focus(Scene(surface), rig, REQUEST).cameras


def test_it_plans_as_a_planner_in_this_process(ready):
    result = ready.plan()
    assert same(result.plan, BOX, RIG)
    assert result.reminder == ""
    assert ready.planner.frame_id == RIG.frame_id
    assert [rig.names for rig in ready.rigs] == [tuple(camera.name for camera in RIG.cameras)]


def test_it_tells_that_inputs_are_read_and_how_far_a_surface_is(bench):
    told = []
    bench.surface(BOX)
    bench.rig(RIG)
    bench.digest(tell=told.append)
    assert [each.stage for each in told] == ["reading", "preparing", "reading"]
    assert told[1].share == 1.0
    assert [each.elapsed for each in told] == sorted(each.elapsed for each in told)
    bench.digest(tell=told.append)  # there is nothing to read
    assert len(told) == 3


def test_a_plan_is_on_the_inputs_of_the_last_digest_whatever_arrives_meanwhile(ready):
    planned_rig = ready.planner.rig.in_force
    ready.rig(OTHER_RIG)
    assert ready.planner.rig.in_force is planned_rig
    assert [each.topic for each in ready.planner.arrivals] == ["~/mesh", "~/rig"]
    assert planned_rig in ready.planner.arrivals
    assert same(ready.plan().plan, BOX, RIG)
    assert planned_rig.at <= ready.planner.taken
    ready.digest()
    assert same(ready.plan().plan, BOX, OTHER_RIG)
    assert planned_rig not in ready.planner.arrivals


def test_what_arrives_while_inputs_are_read_counts_for_the_next_digest(bench):
    bench.surface(BOX)
    bench.rig(RIG)
    arrived = threading.Event()

    def interrupt(order):
        if isinstance(order, orders.Digest) and not arrived.is_set():
            bench.rig(OTHER_RIG)
            arrived.set()

    bench.intercept = interrupt
    bench.digest()
    assert arrived.is_set()
    assert bench.planner.rig.in_force.at <= bench.planner.taken
    assert same(bench.plan().plan, BOX, RIG)


class TestBegunDigest:
    """Surfaces are read while something else is done here."""

    @staticmethod
    def begin(bench):
        bench.planner.begin_digest(Optics(), 0)

    @pytest.fixture
    def begun(self, ready):
        """Another surface is being read."""
        read = threading.Event()
        ready.intercept = lambda order: read.set() if isinstance(order, orders.Digest) else None
        ready.surface(OTHER)
        self.begin(ready)
        assert read.wait(60)
        return ready

    def test_nothing_that_is_told_changes_before_it_is_waited_for(self, begun):
        planner = begun.planner
        before, taken = planner.surface.in_force, planner.taken
        assert (planner.surface.state.received, taken) == (before.at, planner.taken)
        begun.digest()
        assert planner.surface.in_force is not before
        assert planner.taken > taken
        assert same(begun.plan().plan, OTHER, RIG)

    def test_nothing_is_read_again_unless_there_is_more(self, begun):
        seen = []
        begun.intercept = seen.append
        begun.digest()
        assert not seen
        begun.surface(BOX)
        self.begin(begun)
        begun.planner.digest(Optics(f_number=8.0), 0, go_on)
        assert [order.optics.f_number for order in seen] == [0.0, 8.0]

    def test_what_arrives_after_it_counts_as_well(self, begun):
        begun.rig(OTHER_RIG)
        begun.digest()
        assert same(begun.plan().plan, OTHER, OTHER_RIG)

    def test_a_plan_is_shown_meanwhile(self, ready):
        ready.plan()
        ready.surface(OTHER)
        self.begin(ready)
        assert shown(ready) == expected_visuals(BOX)
        ready.digest()
        assert same(ready.plan().plan, OTHER, RIG)

    def test_what_it_refuses_is_told(self, ready):
        ready.surface(InputError)
        refused = [each.number for each in ready.planner.surface._new]
        self.begin(ready)
        ready.digest()
        assert list(ready.planner.surface.refused) == refused
        assert ready.planner.surface.in_force.number < refused[0]

    def test_it_is_begun_once_and_only_if_a_surface_has_arrived(self, ready):
        seen = []
        ready.intercept = seen.append
        self.begin(ready)
        ready.surface(OTHER)
        self.begin(ready)
        ready.surface(BOX)
        self.begin(ready)
        ready.digest()
        assert [len(order.surfaces) for order in seen] == [1, 1]
        assert same(ready.plan().plan, BOX, RIG)

    def test_a_process_that_has_gone_is_given_it_again(self, ready):
        def die(_):
            ready.intercept = lambda _: None
            raise SystemExit

        ready.intercept = die
        ready.surface(OTHER)
        self.begin(ready)
        ready.digest()
        assert len(ready.workers) == 2
        assert same(ready.plan().plan, OTHER, RIG)

    def test_one_that_is_closed_leaves_nothing_to_wait_for(self, begun):
        begun.planner.close()
        begun.digest()
        assert same(begun.plan().plan, OTHER, RIG)


def test_what_is_missing_is_told(bench):
    bench.surface(BOX)
    bench.digest()
    assert "rig: expected poses" in bench.plan().why


def test_a_bad_request_is_refused(ready):
    assert "depth_tolerance: expected" in ready.plan(replace(REQUEST, depth_tolerance=9.0)).why


def test_a_limit_is_told(ready):
    result = ready.plan(limits=ResourceLimits(max_problem_size=100))
    assert result.why.startswith(
        "samples: expected at most 8 for 12 cameras (parameter max_problem"
    )


def test_steps_are_told_of_a_plan_that_is_recorded(ready):
    steps = []
    assert same(ready.plan(steps=steps).plan, BOX, RIG)
    assert "solving" in {step.stage for step in steps}
    description = ready.planner.describe(orders.Describe("a plan", True, None))
    assert [each.stage for each in description.fingerprints][:1] == ["fresh samples"]
    assert description.visuals is None


def shown(ready, plan_id="a plan", stamp=(5, 6)):
    return ready.planner.describe(orders.Describe(plan_id, False, stamp)).visuals


def expected_visuals(surface, stamp=(5, 6)):
    plan = plan_focus(Scene(surface), RIG, REQUEST)
    return describe_plan(plan, RIG, stamp).visuals


def test_a_plan_can_be_shown_later_as_at_once(ready):
    ready.plan()
    expected = expected_visuals(BOX)
    assert shown(ready) == expected
    ready.surface(OTHER)
    ready.digest()
    assert shown(ready) == expected
    assert shown(ready, stamp=(7, 8)) == expected_visuals(BOX, (7, 8))


def test_a_recorded_plan_is_described_once_and_can_be_shown_as_well(ready):
    ready.plan(steps=[])
    description = ready.planner.describe(orders.Describe("a plan", True, (5, 6)))
    assert description.visuals == shown(ready) == expected_visuals(BOX)
    assert description.fingerprints


def test_only_the_last_plan_and_the_one_in_force_can_be_shown(ready):
    ready.plan(plan_id="first")
    ready.surface(OTHER)
    ready.digest()
    ready.plan(plan_id="second", in_force="first")
    assert shown(ready, "first") == expected_visuals(BOX)
    assert shown(ready, "second") == expected_visuals(OTHER)
    ready.digest()
    ready.plan(plan_id="third", in_force="second")
    assert shown(ready, "first") is None
    assert shown(ready, "second") == expected_visuals(OTHER)


def test_inputs_are_worth_more_than_what_shows_a_plan(ready, monkeypatch):
    def fail(_):
        raise MemoryError

    ready.plan()
    monkeypatch.setattr(ShownPlan, "condense", fail)
    ready.surface(OTHER)
    ready.digest()
    assert len(ready.workers) == 1
    assert shown(ready) is None
    assert same(ready.plan().plan, OTHER, RIG)


def test_a_process_that_was_started_anew_shows_no_plan_of_the_last_one(ready):
    ready.plan()
    ready.planner.close()
    ready.digest()
    assert shown(ready) is None


def test_a_plan_that_is_told_to_stop_ends_with_the_best_so_far(ready):
    result = ready.plan(PlanRequest("k_view", 4000, bound="tight"), lambda: Wish.STOP)
    assert isinstance(result, orders.Planned)
    assert result.stop_log.stopped


class Hanging:
    """Does not come back until it is let go."""

    def __init__(self, kind):
        self._kind = kind
        self.let_go = threading.Event()
        self.hangs = threading.Event()

    def __call__(self, order):
        if isinstance(order, self._kind) and not self.let_go.is_set():
            self.hangs.set()
            self.let_go.wait(60)


def test_what_does_not_stop_is_ended(ready, monkeypatch):
    monkeypatch.setattr("focus_planner.runtime.remote_planner._SECONDS_TO_STOP_AT_ALL", 0.7)
    ready.intercept = hanging = Hanging(orders.Plan)
    with pytest.raises(PlanningEnded):
        ready.plan(wish=lambda: Wish.STOP if hanging.hangs.is_set() else Wish.GO_ON)
    hanging.let_go.set()
    (first,) = ready.workers
    assert first.killed
    # The next one is given what the first had.
    ready.digest()
    assert same(ready.plan().plan, BOX, RIG)
    assert len(ready.workers) == 2


def test_who_works_on_a_busy_machine_is_given_the_time(ready, monkeypatch):
    """Seconds count only while it has a processor."""
    monkeypatch.setattr("focus_planner.runtime.remote_planner._SECONDS_TO_STOP", 0.01)
    ready.intercept = hanging = Hanging(orders.Plan)
    threading.Timer(0.3, hanging.let_go.set).start()
    result = ready.plan(wish=lambda: Wish.STOP)
    assert isinstance(result, orders.Planned)


def test_the_end_is_at_once(ready):
    ready.intercept = hanging = Hanging(orders.Plan)
    began = time.monotonic()
    with pytest.raises(PlanningEnded):
        ready.plan(wish=lambda: Wish.END if hanging.hangs.is_set() else Wish.GO_ON)
    assert time.monotonic() - began < 50  # it hangs for 60
    hanging.let_go.set()


def test_inputs_that_were_not_read_to_the_end_are_kept(bench):
    bench.surface(BOX)
    bench.rig(RIG)
    bench.intercept = hanging = Hanging(orders.Digest)
    with pytest.raises(PlanningEnded):
        bench.digest(lambda: Wish.END if hanging.hangs.is_set() else Wish.GO_ON)
    hanging.let_go.set()
    bench.digest()
    assert same(bench.plan().plan, BOX, RIG)


def die(worker):
    """End a worker as a signal would: without a word."""
    worker.theirs.close()
    raise SystemExit


# What crosses a connection cannot bring along what it is to kill.
RUNNING = []


def kill_reader(_):
    die(RUNNING[-1])


def test_an_input_that_kills_is_refused_and_the_good_state_stays(ready):
    RUNNING.append(ready.workers[-1])
    ready.planner.surface.receive(Arrival("~/mesh", "a type", b"\0\1\0\0" + bytes(20), kill_reader))
    ready.digest()
    state = ready.planner.surface.state
    assert "one that ended the planning process (it was ended by SIGKILL)" in state.refused
    refusal = ready.plan()
    assert isinstance(refusal, orders.NotReadyYet)
    assert "stays in force: call again to plan with that one" in refusal.why
    assert same(ready.plan().plan, BOX, RIG)
    assert len(ready.workers) == 2
    assert "the planning process has gone, and is started anew: it was ended" in ready.log.errors[0]


def test_a_death_while_planning_is_told_and_the_next_plan_is_made(ready):
    def die_planning(order):
        if isinstance(order, orders.Plan):
            ready.intercept = lambda order: None
            die(ready.workers[-1])

    ready.intercept = die_planning
    with pytest.raises(PlanningDied, match="SIGKILL"):
        ready.plan()
    ready.digest()
    assert same(ready.plan().plan, BOX, RIG)


def test_a_process_that_died_while_idle_is_replaced_without_a_word_to_callers(ready):
    ready.workers[-1].theirs.close()
    ready.digest()
    assert same(ready.plan().plan, BOX, RIG)
    assert len(ready.workers) == 2


def test_who_keeps_dying_is_not_started_for_ever(ready):
    def die_digesting(order):
        if isinstance(order, orders.Digest):
            die(ready.workers[-1])

    ready.intercept = die_digesting
    with pytest.raises(PlanningDied):
        ready.digest()
    assert len(ready.workers) <= 4


def test_what_takes_too_much_memory_is_refused(ready):
    ready.surface(MemoryError)
    ready.digest()
    told = ready.planner.surface.state.refused
    assert "it took more memory than parameter max_memory allows" in told
    assert isinstance(ready.plan(), orders.NotReadyYet)
    assert same(ready.plan().plan, BOX, RIG)


def test_refused_inputs_are_refused_again_by_the_next_process(ready):
    ready.surface(InputError)
    ready.digest()
    ready.planner.close()
    ready.digest()
    assert isinstance(ready.plan(), orders.NotReadyYet)
    assert same(ready.plan().plan, BOX, RIG)


def test_old_inputs_are_forgotten(ready):
    for size in range(20):
        ready.surface(box((0.3, 0.3, 0.3 + 0.001 * size)))
        ready.digest()
    assert len(ready.planner.surface.known) == 1


def test_inputs_that_never_get_read_do_not_pile_up(ready):
    for size in range(20):
        ready.surface(box((0.3, 0.3, 0.3 + 0.001 * size)))
        with pytest.raises(PlanningEnded):
            ready.digest(lambda: Wish.END)
    assert len(ready.planner.surface.known) <= 5


# --- processes that end before they can do anything ----------------------------------------------


class Stillborn:
    """Answers whatever it is asked first; without an answer it has ended by then."""

    pid = 0

    def __init__(self, *answers):
        self.connection, theirs = Pipe()
        if answers and answers[0] is not None:
            for answer in answers:
                theirs.send(answer)
            self._theirs = theirs

    def kill(self):
        self.connection.close()

    def how_it_ended(self):
        return "it was ended by SIGKILL"

    def cpu_seconds(self):
        return 0.0


@pytest.mark.parametrize(
    ("answer", "why"),
    [
        (None, "it was ended by SIGKILL"),
        (orders.OutOfMemory(), "it is out of memory"),
        (orders.Failed("internal error: no thread", "details"), "internal error: no thread"),
    ],
)
def test_processes_that_cannot_load_are_given_up(answer, why):
    given_up, started = [], []

    def start():
        started.append(Stillborn(answer))
        return started[-1]

    planner = RemotePlanner(start, Log(), give_up=given_up.append)
    for _ in range(2):
        with pytest.raises(PlanningDied, match=why):
            planner.load(go_on)
    assert not given_up
    with pytest.raises(PlanningDied, match=why):
        planner.load(go_on)
    assert given_up == [f"the planning process does not start any more: {why}"]
    assert planner.pid is None
    assert len(started) == 3


def test_one_that_loads_makes_up_for_those_before():
    given_up, answers = [], [None, None, orders.Done(), None, None]
    planner = RemotePlanner(lambda: Stillborn(answers.pop(0)), Log(), give_up=given_up.append)
    while answers:
        try:
            planner.load(go_on)
        except PlanningDied:
            continue
        planner.close()
    assert not given_up


@pytest.mark.parametrize("is_kept", [True, False])
def test_what_is_compiled_is_told(is_kept):
    told, log = [], Log()
    events = [
        orders.Compiling(Progress("compiling", 0, math.nan, share=0.0, expected=90.0)),
        orders.Compiling(Progress("compiling", 1, math.nan, share=0.5, expected=95.0)),
        orders.Compiled("compiled 2 kernels in 95 s", is_kept),
        orders.Done(),
    ]
    planner = RemotePlanner(lambda: Stillborn(*events), log)
    compiled = planner.load(go_on, told.append)
    planner.close()
    assert [(each.doing, each.share) for each in told] == [
        ("compiling, once, about 90 s", 0.0),
        ("compiling, once, about 100 s", 0.5),
    ]
    # What cannot be kept will be compiled again, so that is a warning.
    assert (compiled, log.warnings) == (
        ("compiled 2 kernels in 95 s", []) if is_kept else ("", ["compiled 2 kernels in 95 s"])
    )


@pytest.mark.parametrize("folder", [Path("/kept"), None])
def test_a_process_compiles_what_plans_run_and_no_pictures(monkeypatch, folder):
    def compiles(works, on_progress):
        assert works == PLANS
        assert not {PICTURES, DEPTHS} & set(works)
        on_progress(Progress("compiling", 1, math.nan))
        return Compiled({}, 1, 2.0, folder)

    monkeypatch.setattr("focus_planner.runtime.planning_process.missing_kernels", len)
    monkeypatch.setattr("focus_planner.runtime.planning_process.precompile", compiles)
    ours, theirs = Pipe()
    assert PlanningProcess(theirs)._do(orders.Load()) == orders.Done()
    assert ours.recv() == orders.Compiling(
        Progress("compiling", 1, pytest.approx(math.nan, nan_ok=True))
    )
    assert ours.recv() == orders.Compiled(str(Compiled({}, 1, 2.0, folder)), folder is not None)


def test_what_others_have_compiled_is_loaded_while_there_is_nothing_to_do(monkeypatch):
    loaded = []

    def loads(works, _=None):
        loaded.append(tuple(works))
        return Compiled({}, 0, 0.0, None)

    monkeypatch.setattr("focus_planner.runtime.planning_process.missing_kernels", lambda _: {})
    monkeypatch.setattr("focus_planner.runtime.planning_process.precompile", loads)
    ours, theirs = Pipe()
    process = PlanningProcess(theirs)
    ours.send(orders.Load())
    thread = threading.Thread(target=process.serve)
    thread.start()
    assert ours.recv() == orders.Done()
    until = time.monotonic() + 60.0
    while process._unloaded and time.monotonic() < until:
        time.sleep(0.01)
    ours.close()
    thread.join()
    assert loaded[0] != PLANS
    assert loaded[1:] == [(work,) for work in PLANS]
