# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Compiling in several processes: who does what, what becomes of one that ends."""

from __future__ import annotations

import sys
from contextlib import suppress
from multiprocessing import Pipe
from threading import Thread

import pytest

from focus_planner.core import kernels
from focus_planner.core.kernels.compiling import Kernel
from focus_planner.core.planning import precompile as planning
from focus_planner.core.planning import precompile_processes as processes
from focus_planner.core.planning.precompile import Compiled
from focus_planner.core.planning.precompile_processes import precompile_in_processes
from focus_planner.core.planning.work import (
    ALL,
    BUDGETS,
    CLOUDS,
    DEPTHS,
    PICTURES,
    PLANNING,
    PROOFS,
    TUPLES_OF_CAMERAS,
)


def entered_by(room):
    """The modules whose kernels those of one can enter, itself included."""
    found, new = set(), {room}
    while new:
        found |= new
        names = [vars(sys.modules[f"{kernels.__name__}.{each}"]).values() for each in new]
        new = {what.room for each in names for what in each if isinstance(what, Kernel)} - found
    return found


@pytest.mark.parametrize("work", ALL, ids=[min(work.modules) for work in ALL])
def test_each_kind_of_work_comes_after_those_whose_kernels_it_enters(work, monkeypatch):
    planning.precompile()
    rooms, call = set(), Kernel.__call__

    def note(kernel, *arguments):
        rooms.add(kernel.room)
        return call(kernel, *arguments)

    monkeypatch.setattr(Kernel, "__call__", note)
    work.do()
    known = work.modules.union(*(other.modules for other in work.after))
    assert work.modules & rooms
    assert set().union(*map(entered_by, rooms)) <= known


def test_what_most_has_to_wait_for_is_done_first():
    assert processes._ready(ALL, [])[0] == PLANNING
    assert processes._ready(ALL, []) == [PLANNING, CLOUDS]
    later = [work for work in ALL if work not in {PLANNING, CLOUDS}]
    assert processes._ready(later, [PLANNING]) == []
    ready = processes._ready(later, [CLOUDS])
    assert ready == [PROOFS, TUPLES_OF_CAMERAS, DEPTHS]


class Others:
    """Processes, as threads, that do so many kinds of work each and end at the next."""

    def __init__(self, *at_most):
        self.done, self.connections, self._threads = [], [], []
        for number in at_most:
            ours, theirs = Pipe()
            self.connections.append(ours)
            self._threads.append(Thread(target=self._serve, args=(theirs, number)))
            self._threads[-1].start()

    def _serve(self, connection, at_most):
        with connection, suppress(EOFError):
            for _ in range(at_most):
                work = ALL[connection.recv()]
                self.done.append(work)
                connection.send(Compiled({"em": 1.0}, 1, 1.0, None))
            connection.recv()

    def end(self):
        for connection in self.connections:
            connection.close()
        for thread in self._threads:
            thread.join()


@pytest.fixture
def others():
    started = []

    def start(*at_most):
        started.append(Others(*at_most))
        return started[-1]

    yield start
    for each in started:
        each.end()


@pytest.mark.parametrize(
    ("at_most", "done"),
    # The one that ends at its second may be so late with its first that none is left.
    [((9,), {8}), ((9, 9, 9), {8}), ((0, 9), {7}), ((1, 9), {7, 8}), ((0, 0), {0})],
)
def test_each_kind_of_work_is_done_once_unless_its_process_ends(others, at_most, done):
    told, these = [], others(*at_most)
    compiled = processes._share_out(ALL, list(these.connections), lambda: told.append(True))
    assert len(compiled) == len(these.done) == len(set(these.done))
    assert len(compiled) in done
    assert told
    for number, work in enumerate(these.done):
        # What has been lost is nobody's any more, and those after it are done all the same.
        assert not set(these.done[number + 1 :]) & set(work.after)


def test_only_what_was_asked_for_is_done(others):
    these = others(9)
    processes._share_out((PICTURES, BUDGETS), list(these.connections), lambda: None)
    assert sorted(these.done, key=ALL.index) == [BUDGETS, PICTURES]


@pytest.mark.processes
def test_processes_do_all_and_report(monkeypatch):
    # All is compiled here, so they load what they would compile.
    missing = dict.fromkeys(kernels.KERNELS, 1.0)
    monkeypatch.setattr(processes, "missing_kernels", lambda _: missing)
    told = []
    compiled = precompile_in_processes(ALL, told.append, 2)
    assert (compiled.kernels, compiled.seconds, compiled.elapsed) == (0, {}, 0.0)
    assert {(each.stage, each.iteration, each.share) for each in told} == {
        ("compiling", len(missing), 1.0)
    }


@pytest.mark.processes
def test_an_exception_ends_the_processes(monkeypatch):
    started = []

    def share_out(works, connections, on_wait):
        started.extend(connections)
        on_wait()

    def interrupt(_):
        raise KeyboardInterrupt

    monkeypatch.setattr(processes, "missing_kernels", lambda _: {kernels.KERNELS[0]: 1.0})
    monkeypatch.setattr(processes, "_share_out", share_out)
    with pytest.raises(KeyboardInterrupt):
        precompile_in_processes(ALL, interrupt, 3)
    assert len(started) == 3
    for connection in started:
        with pytest.raises((EOFError, ConnectionResetError)):
            connection.recv()


@pytest.mark.parametrize(("count", "kept"), [(1, True), (4, False)])
def test_one_process_compiles_alone_and_where_no_other_could_find_it(monkeypatch, count, kept):
    asked = []
    monkeypatch.setattr(processes, "precompile", lambda works, _: asked.append(works))
    monkeypatch.setattr(kernels, "kept_in", lambda: "/kept" if kept else None)
    monkeypatch.setattr(processes, "_started", None)
    monkeypatch.setattr(processes, "missing_kernels", lambda _: {kernels.KERNELS[0]: 1.0})
    precompile_in_processes((PLANNING,), lambda _: None, count)
    assert asked == [(PLANNING,)]


def test_what_has_been_compiled_is_added_up():
    parts = [
        Compiled({"em": 2.0, "cells": 1.0}, 3, 3.0, None),
        Compiled({"em": 0.5}, 1, 0.5, None),
        Compiled({}, 0, 0.0, None),
    ]
    total = processes._sum(parts, 3.5)
    assert (total.seconds, total.kernels, total.elapsed) == ({"em": 2.5, "cells": 1.0}, 4, 3.5)


def test_a_process_ends_when_the_one_that_started_it_has():
    # This one was not started by another that could have.
    with pytest.raises(SystemExit):
        processes._end_with_parent(None)
