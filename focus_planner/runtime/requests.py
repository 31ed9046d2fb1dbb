# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Requests for plans: one is planned at a time; the others wait, are ended early, or are rejected.

Calls of the service and goals of the action are treated alike, except that a call waits for a
limited time only, and a goal may be preempted by the next.
"""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from threading import Lock

from focus_planner.messages.reading import Message
from focus_planner.messages.writing import Fields
from focus_planner.parameters.planner_settings import Serving, Settings
from focus_planner.runtime.reason import Reason

#: Answers to requests that end without a plan.
MESSAGES = {
    Reason.INACTIVE: "the planner was deactivated",
    Reason.SHUTTING_DOWN: "the node is shutting down",
    Reason.CANCELLED: "cancelled before planning began",
    Reason.PREEMPTED: "preempted by a newer goal before planning began",
}

#: Answers to requests whose planning was ended before there was a plan.
ENDED_MESSAGES = {
    **MESSAGES,
    Reason.CANCELLED: "cancelled; there was no plan within a second of that",
    Reason.PREEMPTED: "preempted by a newer goal; there was no plan within a second of that",
    Reason.TIME_LIMIT: "no plan within the longest time that planning may take (parameter"
    " max_planning_time); ask for fewer samples or shots, or raise the parameter",
}


def _do_nothing(*_: object) -> None:
    """Do nothing."""


@dataclass(frozen=True)
class Outcome:
    """How a request ended.

    Attributes
    ----------
    reason : Reason
        ``NONE`` if the plan is the one asked for.
    message : str
    plan : FocusPlan message or None
    on_sent : callable
        To be called once the caller has been sent its answer.
    """

    reason: Reason
    message: str
    plan: Message | None = None
    on_sent: Callable[[], object] = _do_nothing


@dataclass(eq=False)
class Request:
    """A request for a plan, with the parameters as they were when it arrived.

    It is answered exactly once, by the planning thread or by whatever ends it before; any thread
    may call its methods.

    Parameters
    ----------
    asked : dict
        Fields of the service's request or the action's goal.
    settings : Settings
    plan_id : str
    answer : callable
        Called once with the outcome, from any thread.
    waits_until : float
        Deadline for planning to begin, by :func:`time.perf_counter`; inf for a goal, which waits
        for its turn however long that takes.
    send_feedback : callable
        Called on the planning thread with the fields of a feedback message.
    caller : bytes
        Who sent it; empty if that is not known.
    is_asked : bool
        Whether somebody asked for it, rather than a surface having arrived.

    Attributes
    ----------
    arrived : float
        When it arrived, by :func:`time.perf_counter`.
    at : int
        When it arrived, nanoseconds since the epoch.
    """

    asked: Fields
    settings: Settings
    plan_id: str
    answer: Callable[[Outcome], None]
    waits_until: float = math.inf
    send_feedback: Callable[[Fields], None] = _do_nothing
    caller: bytes = b""
    is_asked: bool = True
    arrived: float = field(default_factory=time.perf_counter)
    at: int = field(default_factory=time.time_ns)
    _stop_reason: Reason = Reason.NONE
    _has_begun: bool = False
    _is_committed: bool = False
    _is_answered: bool = False
    _lock: Lock = field(default_factory=Lock)

    @property
    def is_goal(self) -> bool:
        """Whether it is a goal of the action, not a call of the service."""
        return math.isinf(self.waits_until)

    @property
    def stop_requested(self) -> bool:
        """Whether planning should stop at the next step."""
        return self._stop_reason is not Reason.NONE

    @property
    def has_begun(self) -> bool:
        """Whether its planning has begun."""
        return self._has_begun

    @property
    def is_answered(self) -> bool:
        """Whether it has been answered."""
        return self._is_answered

    @property
    def starts_warm(self) -> bool:
        """Whether it is planned from the last plan on."""
        return self.settings.warm_start or not self.is_asked

    @property
    def keeps_warm(self) -> bool:
        """Whether the next plan may be planned from this one on."""
        return self.starts_warm or self.settings.replan.is_on

    def begin(self) -> bool:
        """Begin planning; return False if the request has been answered already."""
        with self._lock:
            self._has_begun = not self._is_answered
            return self._has_begun

    def stop(self, reason: Reason, outcome: Outcome | None = None) -> bool:
        """End it: at once if planning has not begun, else with the best plan so far.

        Parameters
        ----------
        reason : Reason
        outcome : Outcome, optional
            The answer if planning has not begun; by default that of :data:`MESSAGES`.

        Returns
        -------
        bool
            False if it came too late to have an effect.
        """
        with self._lock:
            if self._is_committed or self._is_answered:
                return False
            if not self.stop_requested:
                self._stop_reason = reason
            if self._has_begun:
                return True
            self._is_answered = self._is_committed = True
        self.answer(outcome or Outcome(reason, MESSAGES[reason]))
        return True

    def abort(self, reason: Reason) -> None:
        """Answer it without a plan, whether planning has begun or not.

        A request whose plan is about to be published is left to be answered with that.
        """
        with self._lock:
            if self._is_committed or self._is_answered:
                return
            # Overrides an earlier stop, which would have returned the best plan so far.
            self._stop_reason = reason
            self._is_answered = self._is_committed = True
        self.answer(Outcome(reason, MESSAGES[reason]))

    def commit(self) -> Reason:
        """Return why it was stopped, if it was; from now on it cannot be."""
        with self._lock:
            self._is_committed = True
            return self._stop_reason

    def finish(self, outcome: Outcome) -> bool:
        """Answer it; return False if it has been answered already."""
        with self._lock:
            if self._is_answered:
                return False
            self._is_answered = self._is_committed = True
        self.answer(outcome)
        return True


class Requests:
    """The unanswered requests, in order of arrival."""

    def __init__(self) -> None:
        self._open: list[Request] = []

    @property
    def open(self) -> list[Request]:
        """The unanswered requests."""
        self._open = [request for request in self._open if not request.is_answered]
        return self._open

    @property
    def waiting(self) -> int:
        """How many wait for their turn."""
        return sum(not request.has_begun for request in self.open)

    @property
    def planned(self) -> Request | None:
        """The one being planned."""
        return next((request for request in self.open if request.has_begun), None)

    def admit_goal(self, serving: Serving, caller: bytes = b"") -> bool:
        """Return whether a caller's goal is accepted; if so, stop those that it preempts."""
        if serving.overlap == "refuse":
            return not self.open
        preempted = [r for r in self.open if r.is_goal and serving.overlap == "preempt"]
        waiting = [r for r in self._waiting(caller) if r not in preempted]
        if len(waiting) >= serving.max_waiting:
            return False
        for request in preempted:
            request.stop(Reason.PREEMPTED)
        return True

    def add(self, request: Request) -> bool:
        """Queue a request; return False if it was rejected because too many of its caller wait."""
        most = request.settings.serving.max_waiting
        if not request.is_goal and len(self._waiting(request.caller)) >= most:
            return not self._reject(request)
        self.open.append(request)
        return True

    def reject_overdue(self) -> None:
        """Reject the calls that have waited too long."""
        now = time.perf_counter()
        for request in self.open:
            if now > request.waits_until and not request.has_begun:
                self._reject(request)

    def abort_all(self, reason: Reason) -> None:
        """Answer all of them without a plan."""
        for request in self.open:
            request.abort(reason)

    def _waiting(self, caller: bytes) -> list[Request]:
        return [r for r in self.open if not r.has_begun and r.caller == caller]

    def _reject(self, request: Request) -> bool:
        return request.stop(Reason.BUSY, Outcome(Reason.BUSY, self._busy_message(request)))

    def _busy_message(self, request: Request) -> str:
        planned = self.planned
        what = (
            "reading inputs" if planned is None else f"planning {planned.plan_id} ({_age(planned)})"
        )
        others = sum(not other.has_begun and other is not request for other in self.open)
        return (
            f"busy: {what}, other requests waiting: {others}; call again later, or"
            " send a goal to ~/plan, which waits for its turn"
        )


def unasked(settings: Settings, plan_id: str) -> Request:
    """Return a request that nobody made, for a plan with the defaults of requests."""
    return Request({}, settings, plan_id, _do_nothing, is_asked=False)


class NewestOnly:
    """A request that waits until it is taken, or a newer one takes its place; and the one taken.

    Any thread may call.
    """

    def __init__(self) -> None:
        self._waiting: Request | None = None
        self._taken: Request | None = None
        self._lock = Lock()

    def put(self, request: Request) -> bool:
        """Let a request wait; return whether none did before."""
        with self._lock:
            is_first = self._waiting is None
            self._waiting = request
            return is_first

    def take(self) -> Request | None:
        """Take the one that waits."""
        with self._lock:
            self._taken, self._waiting = self._waiting, None
            return self._taken

    def done(self) -> None:
        """Forget the one that was taken."""
        self._taken = None

    @property
    def planned(self) -> str:
        """The name of the one being planned; empty if there is none."""
        taken = self._taken
        return taken.plan_id if taken and taken.has_begun and not taken.is_answered else ""

    def stop(self, reason: Reason) -> None:
        """End the one being planned, at the next step; leave one that waits."""
        taken = self._taken
        if taken and taken.has_begun:
            taken.stop(reason)

    def clear(self, reason: Reason) -> None:
        """End both, without a plan."""
        with self._lock:
            self._waiting = None
            taken = self._taken
        if taken:
            taken.abort(reason)


class Turns:
    """Whose turn it is: one request of every caller who has any, in order of their arrival.

    So who has many waiting does not keep out who has one.
    """

    def __init__(self) -> None:
        self._waiting: dict[bytes, deque[Request]] = {}
        self._lock = Lock()

    def add(self, request: Request) -> None:
        """Let a request wait for its turn; safe to call from any thread."""
        with self._lock:
            self._waiting.setdefault(request.caller, deque()).append(request)

    def waiting(self) -> list[Request]:
        """Return the requests that wait and have not been answered."""
        with self._lock:
            return [r for turns in self._waiting.values() for r in turns if not r.is_answered]

    def next(self) -> Request | None:
        """Return the next request that has not been answered, which then no longer waits."""
        with self._lock:
            while self._waiting:
                caller = next(iter(self._waiting))
                requests = deque(r for r in self._waiting.pop(caller) if not r.is_answered)
                if not requests:
                    continue
                request = requests.popleft()
                if requests:
                    self._waiting[caller] = requests  # after all others
                return request
        return None


def _age(request: Request) -> str:
    return f"requested {time.perf_counter() - request.arrived:.1f} s ago"
