# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A planner in a process of its own, which can be ended whatever it is doing."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field, replace
from datetime import datetime, timezone
from enum import Enum
from functools import partial
from multiprocessing.connection import Connection
from typing import Any, Protocol

from focus_planner.core.progress import Standing, Tracker
from focus_planner.core.validation import InputError
from focus_planner.messages.reading import Optics
from focus_planner.runtime import planning_orders as orders
from focus_planner.runtime.inputs import BACKLOG, Arrival, InputState, Unheard
from focus_planner.runtime.log import Log, log_lines

# Between looks at whether to go on.
_SECONDS_BETWEEN_LOOKS = 0.01
# How long a plan may take to end once it was told to: of the processor's time, so that a busy
# machine costs no plan, and at all, in case it waits for something else.
_SECONDS_TO_STOP = 0.6
_SECONDS_TO_STOP_AT_ALL = 10.0
# Processes in a row that end before they can do anything.
_MOST_FAILED_LOADS = 3
# No input has this number.
_NOTHING = -1
# Bytes of a message that tell its stamp.
_STAMP = 16


class Wish(Enum):
    """What a caller wants of the order that is being carried out."""

    GO_ON = "go on"
    STOP = "stop"  # with what there is by then, or without if that takes long
    END = "end"  # at once


class PlanningEnded(Exception):  # noqa: N818 - mostly as was wished
    """The process was ended as wished, and there is no result."""


class PlanningDied(Exception):  # noqa: N818 - named for what happened
    """The process ended by itself; its text says how."""


class Worker(Protocol):
    """A process that serves :mod:`focus_planner.runtime.planning_process`."""

    pid: int
    connection: Connection

    def kill(self) -> None:
        """End it at once."""

    def how_it_ended(self) -> str:
        """Return how it ended, in words."""

    def cpu_seconds(self) -> float:
        """Return how long it has run on processors."""


@dataclass
class Inbox:
    """The inputs of a kind: those that have arrived, and those that the process has.

    Attributes
    ----------
    kind : str
        "surface" or "rig".
    unheard : Unheard
        Publishers that are not received; any thread may replace it.
    state : InputState
        What was in force when the process last told.
    in_force : Arrival or None
        As of then, the newest.
    states : tuple of InputState
    all_in_force : tuple of Arrival
        The same of all that were in force, the oldest first.
    refused : tuple of int
        The numbers of those that the last digest refused; of surfaces only.
    """

    kind: str
    unheard: Unheard = field(default_factory=Unheard)
    in_force: Arrival[Any] | None = None

    def __post_init__(self) -> None:
        self.refused: tuple[int, ...] = ()
        self.state = InputState(self.kind)
        self.states: tuple[InputState, ...] = ()
        self.all_in_force: tuple[Arrival[Any], ...] = ()
        self.known: dict[int, Arrival[Any]] = {}
        self._new: deque[Arrival[Any]] = deque()
        self._most = BACKLOG

    def keep(self, most: int) -> None:
        """Keep at least so many of the newest messages for the next digest."""
        self._most = max(BACKLOG, most)

    def receive(self, arrival: Arrival[Any]) -> None:
        """Keep a message for the next digest; safe to call from any thread."""
        self._new.append(arrival)
        with suppress(IndexError):  # if they have just been taken
            while len(self._new) > self._most:
                self._new.popleft()

    @property
    def has_new(self) -> bool:
        """Whether anything has arrived since the last :meth:`take`."""
        return bool(self._new)

    def take(self) -> tuple[Arrival[Any], ...]:
        """Return what has arrived since the last call."""
        taken = []
        with suppress(IndexError):
            while True:
                taken.append(self._new.popleft())
        self.known |= {arrival.number: arrival for arrival in taken}
        return tuple(taken)

    def all_known(self) -> tuple[Arrival[Any], ...]:
        """Return the inputs that the process has, or had, in the order of arrival."""
        return tuple(self.known[number] for number in sorted(self.known))

    def forget_all_but(self, kept: tuple[int, ...]) -> None:
        """Forget the inputs that do not matter any more."""
        self.known = {number: each for number, each in self.known.items() if number in kept}

    def forget_all_new(self) -> None:
        """Forget the inputs of a digest that was ended, but for the newest."""
        in_force = (each.number for each in (*self.all_in_force, self.in_force) if each)
        self.forget_all_but((*in_force, *sorted(self.known)[-self._most :]))


@dataclass(frozen=True)
class _Digest:
    """An order to parse inputs, when they were taken, and what came of it, if that is known."""

    order: orders.Digest
    taken: datetime
    result: orders.Result | None = None


class RemotePlanner:
    """Has a process parse inputs and plan, and starts it anew whenever it has ended.

    Apart from ``receive`` and ``unheard`` of the inboxes, it is for one thread only.

    Parameters
    ----------
    start : callable
        Starts a process.
    log : Log
    on_rig : callable
        Called with every rig that comes into force.
    give_up : callable
        Called, with the reason, when process after process ended before it could do anything.

    Attributes
    ----------
    surface, rig : Inbox
    arrivals : list of Arrival
        The messages that the next answer depends on, in the order of arrival.
    taken : datetime
        When the last digest took the messages that had arrived.
    """

    def __init__(
        self,
        start: Callable[[], Worker],
        log: Log,
        on_rig: Callable[[orders.RigInForce], None] = lambda _: None,
        give_up: Callable[[str], None] = lambda _: None,
    ) -> None:
        self.surface = Inbox("surface")
        self.rig = Inbox("rig")
        self.arrivals: list[Arrival[Any]] = []
        self.taken = datetime.now(timezone.utc)
        self._start = start
        self._log = log
        self._on_rig = on_rig
        self._give_up = give_up
        self._failed_loads = 0  # in a row
        self._worker: Worker | None = None
        self._reading = _NOTHING
        self._begun: _Digest | None = None
        self._rig_in_force: orders.RigInForce | None = None

    @property
    def pid(self) -> int | None:
        """The process; None while there is none."""
        worker = self._worker
        return worker.pid if worker else None

    @property
    def frame_id(self) -> str:
        """The frame of the rig in force."""
        return self._rig_in_force.frame_id if self._rig_in_force else ""

    def load(
        self, wish: Callable[[], Wish], tell: Callable[[Standing], object] = lambda _: None
    ) -> str:
        """Start the process, and have it compile or load all kernels; tell how far it has come.

        Return what was compiled and kept, in words; nothing if all was found compiled.

        Raises
        ------
        PlanningEnded
            If that was not to be waited for.
        PlanningDied
        """
        try:
            compiled = self._load(wish, tell)
        except PlanningDied as error:
            self._failed_loads += 1
            if self._failed_loads >= _MOST_FAILED_LOADS:
                self._give_up(f"the planning process does not start any more: {error}")
            raise
        self._failed_loads = 0
        return compiled

    def digest(
        self,
        optics: Optics,
        max_memory: int,
        wish: Callable[[], Wish],
        tell: Callable[[Standing], object] = lambda _: None,
        subjects: int = 1,
    ) -> None:
        """Have the inputs parsed that have arrived, and note which are in force.

        An input that ends the process is refused. How far that is, if any are, is told.

        Raises
        ------
        PlanningEnded
            If that was not to be waited for; the inputs are kept for the next time.
        """
        began = time.monotonic()
        self.surface.keep(subjects)

        def handle(event: Any) -> None:
            elapsed = time.monotonic() - began
            if isinstance(event, orders.Reading):
                tell(Standing("reading", elapsed=elapsed))
            elif isinstance(event, orders.Preparing):
                tell(Standing("preparing", share=event.share, elapsed=elapsed))

        has_died = False
        refused: tuple[int, ...] = ()
        while True:
            restored = self._ready(wish, tell)
            begun, self._begun = self._begun, None
            digest = begun or self._next_digest(optics, max_memory, subjects, restored=restored)
            try:
                result = digest.result or self._ask(
                    digest.order, wish, handle, sent=begun is not None
                )
                self._check_memory(result)
            except PlanningEnded:
                for inbox in (self.surface, self.rig):
                    inbox.forget_all_new()
                raise
            except PlanningDied as error:
                # One that was idle when it died, such as for want of memory, had read nothing.
                if not self._refuse_guilty(str(error)) and has_died:
                    raise
                has_died = True
                continue
            assert isinstance(result, orders.Digested), result
            self._note(result)
            self.taken = digest.taken
            refused += self.surface.refused
            if begun is None or not self._is_more(digest.order, optics, max_memory, subjects):
                break
        self.surface.refused = refused

    def begin_digest(self, optics: Optics, max_memory: int, subjects: int = 1) -> None:
        """Have surfaces parsed that have arrived, if any have, while something else is done here.

        What is told of inputs stays as it is until :meth:`digest`, which waits for that.
        """
        if self._worker is None or self._begun is not None or not self.surface.has_new:
            return
        digest = self._next_digest(optics, max_memory, subjects, restored=False)
        with suppress(ConnectionError):  # which will be noticed
            self._send(digest.order)
            self._begun, self._reading = digest, _NOTHING

    def plan(
        self,
        order: orders.Plan,
        on_step: Callable[[Any], bool],
        tell: Callable[[Standing], object],
        wish: Callable[[], Wish],
    ) -> orders.Result:
        """Return the result of planning on what was in force when :meth:`digest` returned.

        Raises
        ------
        PlanningEnded
            If the plan was to stop, and did not in time.
        PlanningDied
        """

        def handle(event: Any) -> None:
            if isinstance(event, orders.Feedback):
                tell(event.standing)
            elif isinstance(event, orders.Step):
                more = on_step(event.progress)
                if event.progress.stage == "solving":
                    self._send(orders.GoOn() if more else orders.Stop())

        result = self._ask(order, wish, handle)
        if isinstance(result, orders.OutOfMemory):
            self.close()  # what is left of it may lack what it could not allocate
        return result

    def describe(self, order: orders.Describe) -> orders.Description:
        """Return what is told of a plan besides the plan itself.

        Whatever is wished meanwhile: it takes no time, and without it a record is not whole.

        Raises
        ------
        PlanningDied
        """
        if self._begun is not None and self._begun.result is None:
            digest = self._begun
            self._begun = replace(digest, result=self._ask(digest.order, _go_on, sent=True))
        result = self._ask(order, _go_on)
        if not isinstance(result, orders.Description):
            raise PlanningDied(f"the plan could not be described: {result}")
        return result

    def close(self) -> None:
        """End the process."""
        worker, self._worker, self._begun = self._worker, None, None
        if worker:
            worker.kill()

    # --- the process ---------------------------------------------------------------------------

    def _ready(self, wish: Callable[[], Wish], tell: Callable[[Standing], object]) -> bool:
        """Start the process if there is none; return whether it has to be given the inputs."""
        if self._worker is not None:
            return False
        self.load(wish, tell)
        return True

    def _load(self, wish: Callable[[], Wish], tell: Callable[[Standing], object]) -> str:
        tracker, compiled = Tracker(), ""

        def handle(event: Any) -> None:
            nonlocal compiled
            if isinstance(event, orders.Compiling):
                tell(tracker.note(event.progress))
            elif isinstance(event, orders.Compiled):
                if event.is_kept:
                    compiled = event.text
                else:  # every process has to compile them
                    self._log.warning(event.text)

        result = self._ask(orders.Load(), wish, handle)
        if not isinstance(result, orders.Done):
            self.close()
            if isinstance(result, orders.Failed):
                log_lines(self._log, result.details)
            raise PlanningDied(_in_words(result))
        return compiled

    def _ask(
        self,
        order: Any,
        wish: Callable[[], Wish],
        handle: Callable[[Any], None] = lambda _: None,
        *,
        sent: bool = False,
    ) -> orders.Result:
        """Return the result of an order, which may have been sent, handling events until then."""
        if self._worker is None:
            self._worker = self._start()
        worker, self._reading = self._worker, _NOTHING
        patience: _Patience | None = None
        try:
            if not sent:
                worker.connection.send(order)
            while True:
                if worker.connection.poll(_SECONDS_BETWEEN_LOOKS):
                    event = worker.connection.recv()
                    if isinstance(event, orders.Result):
                        return event
                    self._note_event(event)
                    handle(event)
                wished = wish()
                if wished is Wish.STOP and patience is None:
                    patience = _Patience(worker)
                    worker.connection.send(orders.Stop())
                if wished is Wish.END or (patience is not None and patience.is_over()):
                    self.close()
                    raise PlanningEnded
        except (EOFError, ConnectionError):
            how = worker.how_it_ended()
            self.close()
            self._log.error(f"the planning process has gone, and is started anew: {how}")
            raise PlanningDied(how) from None

    def _send(self, order: Any) -> None:
        assert self._worker is not None
        self._worker.connection.send(order)

    def _note_event(self, event: Any) -> None:
        if isinstance(event, orders.Reading):
            self._reading = event.number
        elif isinstance(event, orders.Logged):
            (self._log.error if event.is_error else self._log.warning)(event.text)

    # --- inputs --------------------------------------------------------------------------------

    def _is_more(
        self, order: orders.Digest, optics: Optics, max_memory: int, subjects: int
    ) -> bool:
        """Return whether there is more to digest than an order had."""
        unheard = self.surface.unheard, self.rig.unheard
        now = orders.Digest((), (), unheard, optics, subjects, max_memory)
        had = replace(order, surfaces=(), rigs=())
        return self.surface.has_new or self.rig.has_new or had != now

    def _next_digest(
        self, optics: Optics, max_memory: int, subjects: int, *, restored: bool
    ) -> _Digest:
        """Return the order to parse what has arrived, or all for a process that was restored."""
        surfaces, rigs = self.surface.take(), self.rig.take()
        taken = datetime.now(timezone.utc)
        if restored:
            surfaces, rigs = self.surface.all_known(), self.rig.all_known()
        unheard = self.surface.unheard, self.rig.unheard
        order = orders.Digest(surfaces, rigs, unheard, optics, subjects, max_memory)
        return _Digest(order, taken)

    def _note(self, digested: orders.Digested) -> None:
        self.surface.state, self.rig.state = digested.surface, digested.rig
        surface, rig = digested.in_force
        self.surface.in_force = None if surface is None else self.surface.known[surface]
        self.rig.in_force = None if rig is None else self.rig.known[rig]
        self.surface.states = digested.surfaces
        self.surface.refused = digested.refused_surfaces
        self.surface.all_in_force = tuple(self.surface.known[each] for each in digested.subjects)
        known = self.surface.known | self.rig.known
        self.arrivals = [known[number] for number in digested.needed]
        for inbox in (self.surface, self.rig):
            inbox.forget_all_but(digested.kept)
        if digested.new_rig and digested.new_rig != self._rig_in_force:
            self._rig_in_force = digested.new_rig
            self._on_rig(digested.new_rig)

    def _check_memory(self, result: orders.Result) -> None:
        if isinstance(result, orders.OutOfMemory):
            self.close()
            raise PlanningDied("it took more memory than parameter max_memory allows")

    def _refuse_guilty(self, how: str) -> bool:
        """Have the input that ended the process refused by the next one; return if there is one."""
        for inbox in (self.surface, self.rig):
            guilty = inbox.known.get(self._reading)
            if guilty and len(guilty.payload) > _STAMP:
                why = f"one that ended the planning process ({how})"
                read = partial(_refuse, inbox.kind, why)
                # Its stamp is told, not its content.
                inbox.known[guilty.number] = replace(
                    guilty, payload=guilty.payload[:_STAMP], read=read
                )
                return True
        return False


def _go_on() -> Wish:
    return Wish.GO_ON


def _in_words(result: orders.Result) -> str:
    """Return what went wrong, of an order that nothing should go wrong with."""
    return result.why if isinstance(result, orders.Failed) else "it is out of memory"


class _Patience:
    """How long a process that was told to stop is waited for."""

    def __init__(self, worker: Worker) -> None:
        self._worker = worker
        self._began = time.monotonic()
        self._cpu_began = worker.cpu_seconds()

    def is_over(self) -> bool:
        """Return whether it has had enough time."""
        elapsed = time.monotonic() - self._began
        if elapsed < _SECONDS_TO_STOP:
            return False
        used = self._worker.cpu_seconds() - self._cpu_began
        return used >= _SECONDS_TO_STOP or elapsed >= _SECONDS_TO_STOP_AT_ALL


def _refuse(kind: str, why: str, _: Optics) -> Any:
    raise InputError(kind, "one that can be read here", why, "see the log")
