# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Gives a running planner a surface and a rig, and finds out whether it uses them."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass

from focus_planner_msgs.msg import InputStatus, PlannerStatus
from focus_planner_msgs.srv import PlanFocus

from focus_planner.core.rig.rig import Rig
from focus_planner.core.surface.surface import Mesh, Surface
from focus_planner.messages.writing import Stamp
from focus_planner.ros.client import PlannerClient
from focus_planner.ros.reaching import NotReached, first_status
from focus_planner.ros.status_watch import StatusWatch

_ACTIVE = "active"
_NO_STAMP: Stamp = (0, 0)
# What ends neither by itself nor soon, and what to do about it.
_RESTING = {
    "unconfigured": "ros2 lifecycle set {name} configure, then activate",
    "inactive": "ros2 lifecycle set {name} activate",
    "finalized": "start it anew",
}
# Seconds. A refusal in the same words as one before cannot be told from that one but by waiting.
_SECONDS_TO_REPEAT = 10.0


@dataclass(frozen=True)
class _Given:
    """An input that was published.

    Attributes
    ----------
    kind : str
        As ``PlannerStatus`` calls it.
    topic : str
        Full name.
    stamp : tuple of int
        By which it is recognised; zero for a mesh, which has none.
    before : InputStatus
        What the planner said of this kind of input until then.
    """

    kind: str
    topic: str
    stamp: Stamp
    before: InputStatus

    def is_taken(self, status: PlannerStatus) -> bool:
        """Return whether the planner has this input in force."""
        now = self._of(status)
        if now.topic != self.topic:
            return False
        if any(self.stamp):
            return _pair(now.stamp) == self.stamp
        return _pair(now.received) > _pair(self.before.received)

    def refusal(self, status: PlannerStatus) -> str:
        """Return why the planner refused an input of this kind since then; "" if it did not."""
        refused: str = self._of(status).refused
        return "" if refused == self.before.refused else refused

    def old_refusal(self, status: PlannerStatus) -> str:
        """Return a refusal that is there as it was before; "" if there is none."""
        refused: str = self._of(status).refused
        return refused if refused == self.before.refused else ""

    def _of(self, status: PlannerStatus) -> InputStatus:
        return getattr(status, self.kind)


class Feeder:
    """Publishes inputs of a planner, and waits until it uses them.

    Parameters
    ----------
    client : PlannerClient
    name : str
        Full name of the planner.
    tell : callable
        Called with what is being waited for.
    patience : float
        How long to wait for the planner to appear, and to become active, seconds.
    timeout : float
        How long to wait while it starts, and until it has taken the inputs, seconds.
    """

    def __init__(
        self,
        client: PlannerClient,
        name: str,
        tell: Callable[[str], None],
        patience: float,
        timeout: float,
    ) -> None:
        self._client = client
        self._name = name
        self._tell = tell
        self._patience = patience
        self._timeout = timeout
        self._watch: StatusWatch = client.watch_status()

    def feed(self, surface: Surface | None, rig: Rig | None) -> PlannerStatus:
        """Publish a surface, a rig or both; return the status that says they are in force.

        Raises
        ------
        NotReached
            If there is no such planner, it is not active, or does not take them.
        """
        self._wait_until_active()
        self._tell(f"publishing to {self._name}")
        try:
            given = self._publish(surface, rig)
        except TimeoutError as error:
            raise NotReached(str(error)) from None
        self._tell(f"waiting for {self._name} to read it")
        return self._wait_until_taken(given)

    def plan(self, method: str) -> PlanFocus.Response:
        """Request a plan by a method, "" for the planner's own; return the response.

        Raises
        ------
        NotReached
            If there is none within the time that the planner itself allows a request.
        """
        self._tell(f"waiting for the plan of {self._name}")
        try:
            limits = self._client.get_parameters(["service_max_wait", "max_planning_time"])
            waiting, planning = limits.values()
            timeout = waiting + planning + self._timeout if planning else math.inf
            return self._client.plan(timeout, method=method)
        except TimeoutError as error:
            raise NotReached(f"{self._name} did not plan: {error}") from None

    def _wait_until_active(self) -> None:
        self._tell(f"looking for {self._name}")
        state = first_status(self._client, self._watch, self._name, self._patience).message.state
        if state == _ACTIVE:
            return
        self._tell(f"waiting for {self._name}, which is {state}")
        rests = self._watch.wait_for(lambda status: status.state not in _RESTING, self._patience)
        until_active = self._timeout if rests else 0.0
        if self._watch.wait_for(lambda status: status.state == _ACTIVE, until_active) is None:
            raise NotReached(self._inactive())

    def _inactive(self) -> str:
        state = self._status.state
        said = f"{self._name} is {state}, and reads nothing until it is active"
        remedy = _RESTING.get(state)
        if remedy is not None:
            return f"{said}: {remedy.format(name=self._name)}"
        return f"{said}: it loads, and compiles the first time; give it longer with --timeout"

    def _publish(self, surface: Surface | None, rig: Rig | None) -> list[_Given]:
        given, stamp = [], divmod(time.time_ns(), 1_000_000_000)
        if isinstance(surface, Mesh):
            given.append(self._given("surface", "mesh", _NO_STAMP))
            self._client.publish_mesh(surface)
        elif surface is not None:
            frame = self._frame(rig)
            given.append(self._given("surface", "cloud", stamp))
            self._client.publish_cloud(surface, frame, stamp)
        if rig is not None:
            given.append(self._given("rig", "rig", stamp))
            self._client.publish_rig(rig, stamp)
        return given

    def _given(self, kind: str, topic: str, stamp: Stamp) -> _Given:
        return _Given(kind, f"{self._name}/{topic}", stamp, getattr(self._status, kind))

    def _frame(self, rig: Rig | None) -> str:
        """Return the frame of a cloud's file: the rig's, or else the planner's."""
        if rig is not None:
            return rig.frame_id
        return str(self._client.get_parameters(["frame_id"])["frame_id"])

    def _wait_until_taken(self, given: list[_Given]) -> PlannerStatus:
        published = time.monotonic()

        def is_settled(status: PlannerStatus) -> bool:
            repeats = time.monotonic() - published > _SECONDS_TO_REPEAT and not status.planning
            return all(
                each.is_taken(status)
                or each.refusal(status)
                or (repeats and each.old_refusal(status))
                for each in given
            )

        self._watch.wait_for(is_settled, self._timeout)
        status = self._status
        missing = [each for each in given if not each.is_taken(status)]
        if missing:
            raise NotReached("; ".join(self._why(each, status) for each in missing))
        return status

    def _why(self, given: _Given, status: PlannerStatus) -> str:
        if refused := given.refusal(status) or given.old_refusal(status):
            return f"{self._name} refused the {given.kind}: {refused}"
        said = (
            f"{self._name} received the {given.kind}, but does not say within"
            f" {self._timeout:g} s that it uses it"
        )
        if status.state != _ACTIVE:
            return f"{said}: it is {status.state}"
        if status.planning:
            return f"{said}: it is planning {status.planning}, and reads inputs after that"
        return f"{said}; see its log, or give it longer with --timeout"

    @property
    def _status(self) -> PlannerStatus:
        newest = self._watch.newest
        assert newest is not None
        return newest.message


def _pair(time_message: object) -> Stamp:
    return time_message.sec, time_message.nanosec  # type: ignore[attr-defined]
