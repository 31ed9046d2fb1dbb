# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The planner's inputs as they arrive: the one in force, and why newer ones were refused.

Without ROS. Apart from :meth:`InputSlot.receive`, all of it is for one thread only.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import datetime, timezone
from itertools import count
from typing import Generic, TypeVar

from focus_planner.core.notes import Note
from focus_planner.core.validation import InputError
from focus_planner.messages.cdr import header_stamp
from focus_planner.messages.frames import HeardFrames
from focus_planner.messages.reading import NO_FRAMES, Optics
from focus_planner.runtime.log import Log, ThrottledLog, log_exception

# Messages kept while a plan is being made. Only the newest valid one counts; a few older ones stay
# as substitutes in case it is refused.
BACKLOG = 4
_WITHOUT_HEADER = "shape_msgs/msg/Mesh"

_NOT_RECEIVED = "; not received: "

Content = TypeVar("Content")
Value = TypeVar("Value")


@dataclass(frozen=True, eq=False)
class Arrival(Generic[Content]):
    """A message as received, to be parsed later on the planning thread.

    Attributes
    ----------
    topic, type_name : str
        Full name of the topic, and of its type.
    payload : bytes
        Messages of equal bytes have equal content, if they depend on the same transforms.
    read : callable
        Returns the message's content, given the optics that it leaves out.
    at : datetime
        When it was received.
    number : int
        In the order of arrival; no other of this process has it.
    heard : HeardFrames
        The static transforms that its content depends on; none for one in the planner's frame.
    """

    topic: str
    type_name: str
    payload: bytes
    read: Callable[[Optics], Content]
    at: datetime = field(default_factory=lambda: datetime.now(timezone.utc))
    number: int = field(default_factory=count().__next__)
    heard: HeardFrames = field(default=NO_FRAMES, repr=False)

    def equals(self, other: Arrival[Content]) -> bool:
        """Return whether another has the same content."""
        return (self.payload, self.heard) == (other.payload, other.heard)

    @property
    def stamp(self) -> tuple[int, int]:
        """The header's stamp, seconds and nanoseconds; zero without a header."""
        return (0, 0) if self.type_name == _WITHOUT_HEADER else header_stamp(self.payload)

    def __str__(self) -> str:
        return f"received on {self.topic} at {self.at:%H:%M:%S} UTC"


@dataclass(frozen=True, eq=False)
class AcceptedInput(Generic[Content, Value]):
    """A message that was parsed successfully, and what it was turned into for planning."""

    arrival: Arrival[Content]
    value: Value


@dataclass(frozen=True)
class KnownSubject:
    """What is known of a surface besides itself, which was read from a file.

    Attributes
    ----------
    name : str
    weight : float
        How much it counts, relative to others.
    notes : tuple of Note
        What was noticed when it was read.
    """

    name: str
    weight: float
    notes: tuple[Note, ...] = ()


@dataclass(frozen=True)
class Unheard:
    """Publishers of an input whose messages do not arrive, and what to do about each.

    Attributes
    ----------
    never : tuple of str
        Those whose messages will never arrive.
    missed : tuple of str
        Those of which none has arrived so far.
    incomplete : tuple of str
        What is still missing of an input that is put together from several.
    """

    never: tuple[str, ...] = ()
    missed: tuple[str, ...] = ()
    incomplete: tuple[str, ...] = ()


def with_unheard(message: str, unheard: str) -> str:
    """Return what a caller is told, with the publishers that are not received."""
    return f"{message}{_NOT_RECEIVED}{unheard}" if unheard else message


def without_unheard(message: str) -> str:
    """Return what a caller was told, without what depends on who else is on the graph."""
    return message.partition(_NOT_RECEIVED)[0]


@dataclass(frozen=True)
class InputState:
    """What is reported of an input.

    Attributes
    ----------
    name : str
    topic : str
        Where it was received; empty while none is in force.
    received : datetime or None
    stamp : tuple of int
        Its header's stamp, seconds and nanoseconds; zero without a header.
    refused : str
        Why a newer one is not in force; empty if there is none.
    unheard : str
        Which publishers' messages do not arrive, and what to do; empty if there are none.
    """

    name: str
    topic: str = ""
    received: datetime | None = None
    stamp: tuple[int, int] = (0, 0)
    refused: str = ""
    unheard: str = ""


class InputSlot(Generic[Content, Value]):
    """Holds the last valid input of a kind, and why newer ones were refused.

    Parameters
    ----------
    name : str
        What it is, for messages: "surface" or "rig".
    sources : str
        The topics that may provide it, for the error that none has arrived.
    make : callable
        Turns a message's content into what is planned with; raises ``InputError``.
    log : Log
    on_reading : callable
        Called with every message that is about to be parsed.

    Attributes
    ----------
    in_force : AcceptedInput or None
    misfit : AcceptedInput or None
        The newest one, if it was refused only because it does not fit the other input.
    unheard : Unheard
        Publishers that are not received; any thread may replace it.
    older : list of AcceptedInput
        Others in force, received before it, the oldest first; all of different content.
    """

    def __init__(
        self,
        name: str,
        sources: str,
        make: Callable[[Content], Value],
        log: Log,
        on_reading: Callable[[Arrival[Content]], None] = lambda _: None,
    ) -> None:
        self.name = name
        self.in_force: AcceptedInput[Content, Value] | None = None
        self.misfit: AcceptedInput[Content, Value] | None = None
        self.unheard = Unheard()
        self.older: list[AcceptedInput[Content, Value]] = []
        self._most = 1
        self._sources = sources
        self._make = make
        self._log = log
        self._on_reading = on_reading
        self._throttled_log = ThrottledLog(log)
        self._inbox: deque[Arrival[Content]] = deque(maxlen=BACKLOG)
        self._refused: tuple[Arrival[Content], InputError] | None = None
        self._objected = False
        self._refused_since: set[int] = set()
        self._unusable: Arrival[Content] | None = None

    @property
    def all_in_force(self) -> list[AcceptedInput[Content, Value]]:
        """All that are in force, the oldest first."""
        return [*self.older, self.in_force] if self.in_force else []

    @property
    def has_more(self) -> bool:
        """Whether messages wait for :meth:`newest`."""
        return bool(self._inbox)

    def keep(self, most: int) -> None:
        """Keep so many of the newest in force."""
        if most != self._most:
            self._most = most
            self._inbox = deque(self._inbox, maxlen=max(BACKLOG, most))
            self._forget_oldest()

    def receive(self, arrival: Arrival[Content]) -> None:
        """Keep a message for :meth:`newest`; safe to call from any thread."""
        self._inbox.append(arrival)

    def newest(self, optics: Optics) -> AcceptedInput[Content, Value] | None:
        """Return the newest valid message received, if it is new; refuse invalid ones after it.

        Where several are kept in force, the message that comes next is taken for the newest.
        """
        taken = len(self._inbox) if self._most == 1 else min(len(self._inbox), 1)
        backlog = [self._inbox.popleft() for _ in range(taken)]
        for arrival in reversed(backlog):
            accepted = self._read(arrival, optics)
            if accepted is not None:
                break
        else:
            return None
        if self.in_force and accepted.value == self.in_force.value:
            self.put_in_force(accepted)
            return None
        return accepted

    def refuse(self, arrival: Arrival[Content], error: InputError) -> None:
        """Log why a message is not used, and keep the reason for :meth:`objection`."""
        self._throttled_log.warning(f"refused the {self.name} {arrival}: {error}", arrival.at)
        self._refused_since.add(arrival.number)
        if self._refused is None or arrival.at >= self._refused[0].at:
            self._refused = arrival, error
            self._objected = False
        if self.in_force is None and (self._unusable is None or arrival.at >= self._unusable.at):
            self._unusable = arrival

    def take_refused(self) -> tuple[int, ...]:
        """Return the numbers of the messages that were refused since the last call."""
        refused, self._refused_since = self._refused_since, set()
        return tuple(sorted(refused))

    def put_in_force(self, accepted: AcceptedInput[Content, Value]) -> None:
        """Plan with this from now on, and forget refusals of older messages."""
        before = [each for each in self.all_in_force if not each.arrival.equals(accepted.arrival)]
        self.older = before
        self.in_force, self.misfit = accepted, None
        self._forget_oldest()
        if self._refused and accepted.arrival.at >= self._refused[0].at:
            self._refused = None

    def read_again(self, optics: Optics) -> None:
        """Parse the input in force again, with other optics.

        If it is invalid with them it is refused, and parsed again when the optics next change.
        """
        candidate = self.in_force.arrival if self.in_force else self._unusable
        self.in_force = None
        if candidate:
            self.in_force = self._read(candidate, optics)
        if self.in_force and self._refused and self._refused[0] is candidate:
            self._refused = None
        if self.misfit:
            self.misfit = self._read(self.misfit.arrival, optics)

    def objection(self) -> str | None:
        """Return why a caller gets no plan, or None.

        Without an input in force every caller is told so. If the newest was refused and an older
        one stays in force, the next caller is told, once.
        """
        if self.in_force is None:
            return str(InputError(self.name, self._sources, self._missing()))
        if self._refused is None or self._objected:
            return None
        self._objected = True
        arrival, error = self._refused
        return (
            f"{error}. So the {self.name} {arrival} was refused, and the {self.name}"
            f" {self.in_force.arrival} stays in force: call again to plan with that one"
        )

    def arrivals(self) -> list[Arrival[Content]]:
        """Return the messages that the next answer depends on.

        The one in force, and the refused one if the next caller will be told of it.
        """
        if self.in_force is None:
            return [self._refused[0]] if self._refused else []
        refused = [self._refused[0]] if self._refused and not self._objected else []
        return [*(each.arrival for each in self.all_in_force), *refused]

    def kept(self) -> list[Arrival[Content]]:
        """Return the messages that may matter later on: these, and one that may fit one day."""
        return self.arrivals() + ([self.misfit.arrival] if self.misfit else [])

    def reminder(self) -> str | None:
        """Return what a caller is told along with a plan that ignores a refused newer input."""
        if self.in_force is None or self._refused is None:
            return None
        return f"on the {self.name} {self.in_force.arrival}, as a newer one was refused"

    def warning(self) -> str:
        """Return what a caller is told of publishers that are not received; empty if all are."""
        missed = () if self.in_force or self._refused else self.unheard.missed
        return "; ".join((*self.unheard.incomplete, *self.unheard.never, *missed))

    @property
    def state(self) -> InputState:
        """What is in force, and why a newer one is not."""
        refused, unheard = str(self._refused[1]) if self._refused else "", self.warning()
        if self.in_force is None:
            return InputState(self.name, refused=refused, unheard=unheard)
        arrival = self.in_force.arrival
        return InputState(self.name, arrival.topic, arrival.at, arrival.stamp, refused, unheard)

    @property
    def states(self) -> tuple[InputState, ...]:
        """What is in force, the oldest first."""
        arrivals = (each.arrival for each in self.all_in_force)
        return tuple(InputState(self.name, each.topic, each.at, each.stamp) for each in arrivals)

    @property
    def lacks(self) -> int:
        """How many more could be in force."""
        return self._most - len(self.all_in_force)

    def _forget_oldest(self) -> None:
        self.older = self.older[max(len(self.older) - self._most + 1, 0) :]

    def _missing(self) -> str:
        if self._refused is None:
            return "none yet"
        arrival, error = self._refused
        return f"none that can be used: the {self.name} {arrival} was refused ({error})"

    def _read(
        self, arrival: Arrival[Content], optics: Optics
    ) -> AcceptedInput[Content, Value] | None:
        """Return the accepted message, or refuse it and return None."""
        for known in self.all_in_force:
            if arrival.equals(known.arrival):
                return AcceptedInput(arrival, known.value)
        self._on_reading(arrival)
        try:
            return AcceptedInput(arrival, self._make(arrival.read(optics)))
        except MemoryError:
            raise
        except InputError as error:
            self.refuse(arrival, error)
        except Exception as error:  # noqa: BLE001 - no message may end the node
            log_exception(self._log)
            self.refuse(arrival, internal_input_error(self.name, error))
        return None


def internal_input_error(name: str, error: Exception) -> InputError:
    """Return the refusal of a message that made this program fail."""
    return InputError(name, "one that can be read", f"internal error: {error!r}", "see the log")
