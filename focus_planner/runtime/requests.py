"""Requests for plans: one is planned at a time, the others wait, end early, or are turned away.

Calls of the service and goals of the action are the same here, but that a call waits for a limited
time and a goal may have to make way for the next.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from threading import Lock

from focus_planner.messages.reading import Message
from focus_planner.messages.writing import Fields
from focus_planner.parameters.planner import Serving, Settings
from focus_planner.runtime.reason import Reason

#: What a caller is told that gets no plan.
MESSAGES = {
    Reason.INACTIVE: "the planner was deactivated",
    Reason.SHUTTING_DOWN: "the node is shutting down",
    Reason.CANCELLED: "cancelled before its turn",
    Reason.PREEMPTED: "a newer goal took its place before its turn",
}


def _nothing(*_: object) -> None:
    """Do nothing."""


@dataclass(frozen=True)
class Outcome:
    """What a caller is answered, and what is left to do once that is sent."""

    reason: Reason
    message: str
    plan: Message | None = None
    afterwards: Callable[[], object] = _nothing


@dataclass(eq=False)
class Request:
    """One request, with the parameters as they were when it came.

    It is answered once, by whoever is first: the planning thread, or what ends it before.

    Parameters
    ----------
    asked : dict
        The fields of the service's request or the action's goal.
    settings : Settings
    plan_id : str
    answer : callable
        Called with the outcome, once, from any thread.
    waits_until : float
        By :func:`time.perf_counter`, for its turn; inf for a goal, which waits as long as it takes.
    tell : callable
        Called on the planning thread with feedback, as fields.

    Attributes
    ----------
    started : float
        By :func:`time.perf_counter`.
    at : int
        Nanoseconds since the epoch.
    """

    asked: Fields
    settings: Settings
    plan_id: str
    answer: Callable[[Outcome], None]
    waits_until: float = math.inf
    tell: Callable[[Fields], None] = _nothing
    started: float = field(default_factory=time.perf_counter)
    at: int = field(default_factory=time.time_ns)
    _stop: Reason = Reason.NONE
    _begun: bool = False
    _settled: bool = False
    _answered: bool = False
    _lock: Lock = field(default_factory=Lock)

    @property
    def is_goal(self) -> bool:
        """Whether it is a goal of the action, not a call of the service."""
        return math.isinf(self.waits_until)

    @property
    def goes_on(self) -> bool:
        """Whether nobody wants it to end."""
        return self._stop is Reason.NONE

    @property
    def begun(self) -> bool:
        """Whether its turn has come."""
        return self._begun

    def begin(self) -> bool:
        """Take its turn; return whether it still wants it."""
        with self._lock:
            self._begun = not self._answered
            return self._begun

    def stop(self, reason: Reason, outcome: Outcome | None = None) -> bool:
        """End it: at once if its turn has not come, else with its best plan so far.

        Parameters
        ----------
        reason : Reason
        outcome : Outcome, optional
            What it is answered if its turn has not come.

        Returns
        -------
        bool
            Whether that was in time.
        """
        with self._lock:
            if self._settled or self._answered:
                return False
            if self.goes_on:
                self._stop = reason
            if self._begun:
                return True
            self._answered = self._settled = True
        self.answer(outcome or Outcome(reason, MESSAGES[reason]))
        return True

    def drop(self, reason: Reason) -> None:
        """End it without a plan, whether its turn has come or not.

        One whose plan is about to be published, or answered, keeps it.
        """
        with self._lock:
            if self._settled or self._answered:
                return
            # Whoever wanted it to end with a plan is overruled.
            self._stop = reason
            self._answered = self._settled = True
        self.answer(Outcome(reason, MESSAGES[reason]))

    def settle(self) -> Reason:
        """Return why it was ended, if it was; it cannot be from now on."""
        with self._lock:
            self._settled = True
            return self._stop

    def finish(self, outcome: Outcome) -> bool:
        """Answer it; return whether nobody has before."""
        with self._lock:
            if self._answered:
                return False
            self._answered = self._settled = True
        self.answer(outcome)
        return True

    @property
    def answered(self) -> bool:
        """Whether it has its answer."""
        return self._answered


class Requests:
    """Those that have no answer yet, in the order in which they came."""

    def __init__(self) -> None:
        self._open: list[Request] = []

    @property
    def open(self) -> list[Request]:
        """All of them."""
        self._open = [request for request in self._open if not request.answered]
        return self._open

    @property
    def waiting(self) -> int:
        """How many wait for their turn."""
        return sum(not request.begun for request in self.open)

    @property
    def planned(self) -> Request | None:
        """The one whose turn it is."""
        return next((request for request in self.open if request.begun), None)

    def admit_goal(self, serving: Serving) -> bool:
        """Return whether another goal may come, and end those that it takes the place of."""
        if serving.overlap == "refuse":
            return not self.open
        makes_way = [r for r in self.open if r.is_goal and serving.overlap == "preempt"]
        stays = [r for r in self.open if not r.begun and r not in makes_way]
        if len(stays) >= serving.max_waiting:
            return False
        for request in makes_way:
            request.stop(Reason.PREEMPTED)
        return True

    def add(self, request: Request) -> bool:
        """Have a request wait for its turn; return whether it does, or was turned away."""
        if not request.is_goal and self.waiting >= request.settings.serving.max_waiting:
            return not self._turn_away(request)
        self.open.append(request)
        return True

    def turn_away_late(self) -> None:
        """Answer the calls that have waited long enough that the planner is busy."""
        now = time.perf_counter()
        for request in self.open:
            if now > request.waits_until and not request.begun:
                self._turn_away(request)

    def drop(self, reason: Reason) -> None:
        """End all of them without a plan."""
        for request in self.open:
            request.drop(reason)

    def _turn_away(self, request: Request) -> bool:
        return request.stop(Reason.BUSY, Outcome(Reason.BUSY, self._busy(request)))

    def _busy(self, request: Request) -> str:
        planned = self.planned
        what = "others" if planned is None else f"{planned.plan_id} since {_since(planned)}"
        waiting = sum(not other.begun and other.at < request.at for other in self.open)
        return (
            f"busy: planning {what}, waiting before this one: {waiting}; call again, or send a"
            " goal to ~/plan, which waits for its turn"
        )


def _since(request: Request) -> str:
    return f"{time.perf_counter() - request.started:.1f} s"
