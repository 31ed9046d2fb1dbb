"""A thing to plan with that comes by messages: the one in force, and what became of newer ones.

Without ROS. All but :meth:`Input.receive` belongs to one thread.
"""

from __future__ import annotations

import traceback
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import datetime, timezone
from typing import Generic, Protocol, TypeVar

from focus_planner.core.validation import InputError
from focus_planner.messages.cdr import header_stamp
from focus_planner.messages.reading import Optics

# Messages that came while a plan was made. Only the newest good one counts; a few older ones are
# kept in case that it is refused.
_BACKLOG = 4
_WITHOUT_HEADER = "shape_msgs/msg/Mesh"

Said = TypeVar("Said")
Value = TypeVar("Value")


class Log(Protocol):
    """What is needed of a logger."""

    def warning(self, message: str) -> object:
        """Report what the user should know."""

    def error(self, message: str) -> object:
        """Report what should not have happened."""


class SparingLog:
    """Tells of some in a row, then of one a second, and how many it left out.

    A sender that sends what is refused does so again and again.

    Parameters
    ----------
    log : Log
    """

    _IN_A_ROW = 10.0
    _PER_SECOND = 1.0

    def __init__(self, log: Log) -> None:
        self._log = log
        self._credit = self._IN_A_ROW
        self._since: datetime | None = None
        self._left_out = 0

    def warning(self, message: str, at: datetime) -> None:
        """Report what happened then, unless that is too much."""
        passed = (at - (self._since or at)).total_seconds()
        if passed >= 0:  # messages of one backlog are read from the newest on
            self._credit = min(self._IN_A_ROW, self._credit + passed * self._PER_SECOND)
            self._since = at
        if self._credit < 1:
            self._left_out += 1
            return
        more = f" ({self._left_out} more were not logged)" if self._left_out else ""
        self._credit, self._left_out = self._credit - 1, 0
        self._log.warning(message + more)


@dataclass(frozen=True, eq=False)
class Arrival(Generic[Said]):
    """A message as it came; it is read later, on the planning thread.

    Attributes
    ----------
    topic, type_name : str
        The topic's full name, and its type's.
    payload : bytes
        Two messages of the same bytes say the same.
    read : callable
        Returns what the message says, given what it leaves out.
    at : datetime
    """

    topic: str
    type_name: str
    payload: bytes
    read: Callable[[Optics], Said]
    at: datetime = field(default_factory=lambda: datetime.now(timezone.utc))

    @property
    def stamp(self) -> tuple[int, int]:
        """When its header says that it was measured or made: seconds, nanoseconds; or zero."""
        return (0, 0) if self.type_name == _WITHOUT_HEADER else header_stamp(self.payload)

    def __str__(self) -> str:
        return f"received on {self.topic} at {self.at:%H:%M:%S} UTC"


@dataclass(frozen=True, eq=False)
class AcceptedInput(Generic[Said, Value]):
    """What became of a message that could be read."""

    arrival: Arrival[Said]
    value: Value


@dataclass(frozen=True)
class InputState:
    """What there is of an input, to be told.

    Attributes
    ----------
    name : str
    topic : str
        That it came by; empty while there is none.
    received : datetime or None
    stamp : tuple of int
        When it was measured or made, by its header: seconds, nanoseconds; zero without one.
    refused : str
        Why a newer one is not in force; empty if there is none.
    """

    name: str
    topic: str = ""
    received: datetime | None = None
    stamp: tuple[int, int] = (0, 0)
    refused: str = ""


class Input(Generic[Said, Value]):
    """The last good one, and why a newer one is not in force.

    Parameters
    ----------
    name : str
    sources : str
        Where it may come from, for the message that there is none.
    make : callable
        Makes what is planned with of what a message says; raises ``InputError``.
    log : Log

    Attributes
    ----------
    in_force : AcceptedInput or None
    misfit : AcceptedInput or None
        The newest one, if it was refused only because it does not fit the other input.
    """

    def __init__(self, name: str, sources: str, make: Callable[[Said], Value], log: Log) -> None:
        self.name = name
        self.in_force: AcceptedInput[Said, Value] | None = None
        self.misfit: AcceptedInput[Said, Value] | None = None
        self._sources = sources
        self._make = make
        self._log = log
        self._sparing = SparingLog(log)
        self._inbox: deque[Arrival[Said]] = deque(maxlen=_BACKLOG)
        self._refused: tuple[Arrival[Said], InputError] | None = None
        self._told = False
        self._waiting: Arrival[Said] | None = None

    def receive(self, arrival: Arrival[Said]) -> None:
        """Keep a message until :meth:`newest`; any thread may call."""
        self._inbox.append(arrival)

    def newest(self, optics: Optics) -> AcceptedInput[Said, Value] | None:
        """Return the newest that can be read and says anything new, refusing those after it."""
        backlog = [self._inbox.popleft() for _ in range(len(self._inbox))]
        for arrival in reversed(backlog):
            held = self._read(arrival, optics)
            if held is not None:
                break
        else:
            return None
        if self.in_force and held.value == self.in_force.value:
            self.put_in_force(held)
            return None
        return held

    def refuse(self, arrival: Arrival[Said], error: InputError) -> None:
        """Remember, and log, why a message is not planned with."""
        self._sparing.warning(f"refused the {self.name} {arrival}: {error}", arrival.at)
        if self._refused is None or arrival.at >= self._refused[0].at:
            self._refused = arrival, error
            self._told = False
        if self.in_force is None and (self._waiting is None or arrival.at >= self._waiting.at):
            self._waiting = arrival

    def put_in_force(self, held: AcceptedInput[Said, Value]) -> None:
        """Plan with this from now on; what was refused before it came is forgotten."""
        self.in_force, self.misfit = held, None
        if self._refused and held.arrival.at >= self._refused[0].at:
            self._refused = None

    def read_again(self, optics: Optics) -> None:
        """Read what is held again, with other optics.

        What does not go with them is refused, and read again when the optics change once more.
        """
        waiting = self.in_force.arrival if self.in_force else self._waiting
        self.in_force = None
        if waiting:
            self.in_force = self._read(waiting, optics)
        if self.in_force and self._refused and self._refused[0] is waiting:
            self._refused = None
        if self.misfit:
            self.misfit = self._read(self.misfit.arrival, optics)

    def objection(self) -> str | None:
        """Return what a caller has to be told instead of a plan.

        That there is nothing to plan with, again and again; that the newest was refused and an
        older one stays in force, once.
        """
        if self.in_force is None:
            return str(InputError(self.name, self._sources, self._none()))
        if self._refused is None or self._told:
            return None
        self._told = True
        arrival, error = self._refused
        return (
            f"{error}. So the {self.name} {arrival} was refused, and the {self.name}"
            f" {self.in_force.arrival} stays in force: call again to plan with that one"
        )

    def arrivals(self) -> list[Arrival[Said]]:
        """Return what the next plan, or the lack of one, rests on.

        What is in force, and what was refused if the next caller is told so instead of a plan.
        """
        if self.in_force is None:
            return [self._refused[0]] if self._refused else []
        objected = self._refused is not None and not self._told
        return [self.in_force.arrival] + ([self._refused[0]] if objected and self._refused else [])

    def reminder(self) -> str | None:
        """Return what a caller has to be told with a plan: that the newest is not in it."""
        if self.in_force is None or self._refused is None:
            return None
        return f"on the {self.name} {self.in_force.arrival}, as a newer one was refused"

    @property
    def state(self) -> InputState:
        """What is in force, and why a newer one is not."""
        refused = str(self._refused[1]) if self._refused else ""
        if self.in_force is None:
            return InputState(self.name, refused=refused)
        arrival = self.in_force.arrival
        return InputState(self.name, arrival.topic, arrival.at, arrival.stamp, refused)

    def _none(self) -> str:
        if self._refused is None:
            return "none yet"
        arrival, error = self._refused
        return f"none that can be used: the {self.name} {arrival} was refused ({error})"

    def _read(self, arrival: Arrival[Said], optics: Optics) -> AcceptedInput[Said, Value] | None:
        """Return what a message says, None if it is refused."""
        if self.in_force and arrival.payload == self.in_force.arrival.payload:
            return AcceptedInput(arrival, self.in_force.value)
        try:
            return self._made(arrival, optics)
        except InputError as error:
            self.refuse(arrival, error)
        except Exception as error:  # noqa: BLE001 - whatever came, the node goes on
            self._log.error(traceback.format_exc())
            self.refuse(arrival, internal(self.name, error))
        return None

    def _made(self, arrival: Arrival[Said], optics: Optics) -> AcceptedInput[Said, Value]:
        return AcceptedInput(arrival, self._make(arrival.read(optics)))


def internal(name: str, error: Exception) -> InputError:
    """Return the refusal of what made this program fail."""
    return InputError(name, "one that can be read", f"internal error: {error!r}", "see the log")
