"""``~/status``: planned, sent, read back, per camera; and how old what it rests on is."""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import datetime
from threading import Lock

from builtin_interfaces.msg import Time
from focus_planner_msgs.msg import CameraFocus, FocusPlan, InputStatus, LensState, PlannerStatus

from focus_planner.core.validation import InputError
from focus_planner.lenses.driver import LensStatus
from focus_planner.messages.reading import Message
from focus_planner.messages.typestore import fields_of
from focus_planner.ros.conversions import message_to_ros
from focus_planner.runtime.inputs import InputState
from focus_planner.runtime.status import input_to_fields

# Between messages that tell of a change.
_SECONDS_BETWEEN = 0.1


class StatusBoard:
    """Keeps what is known of the plan in force, and of every lens; any thread may call.

    Its message is kept and changed, not made anew: a rig may have thousands of cameras.
    """

    def __init__(self) -> None:
        self._message = PlannerStatus()
        self._places: dict[str, int] = {}
        self._lock = Lock()
        self._changed = True
        self._told = 0.0

    def planned(self, plan: FocusPlan, *, from_record: bool = False) -> None:
        """Take in the plan that is in force from now on; nothing is known of its lenses yet."""
        lenses = [_unreported(plan, camera) for camera in plan.cameras]
        with self._lock:
            self._changed, message = True, self._message
            message.plan_id, message.planned_at = plan.plan_id, plan.header.stamp
            message.from_record = from_record
            message.plan_surface, message.plan_rig = plan.surface, plan.rig
            message.lenses = lenses
            self._places = {lens.name: place for place, lens in enumerate(lenses)}

    def reported(self, state: Message) -> bool:
        """Take in what became of the plan at a lens; return whether it is about that plan.

        Raises
        ------
        InputError
            If its status is none.
        """
        if state.status not in set(LensStatus):
            expected = f"{min(LensStatus)} to {max(LensStatus)}, as LensState names them"
            raise InputError("status", expected, str(state.status))
        with self._lock:
            message = self._message
            place = self._places.get(state.name)
            if place is None or state.plan_id != message.plan_id:
                return False
            self._changed = True
            lens = message_to_ros(LensState, fields_of(state))
            lens.planned_distance = message.lenses[place].planned_distance
            message.lenses[place] = lens
        return True

    def changed(self) -> None:
        """Have it told soon."""
        self._changed = True

    @property
    def counts(self) -> Counter[int]:
        """How many lenses of the plan in force have which status."""
        with self._lock:
            return self._count()

    def due(self, period: float) -> bool:
        """Return whether it is time to tell."""
        since = time.monotonic() - self._told
        return since >= period or (self._changed and since >= _SECONDS_BETWEEN)

    @contextmanager
    def telling(
        self,
        state: str,
        planning: str,
        waiting: int,
        inputs: tuple[InputState, InputState],
        stamp: Time,
        now: datetime,
    ) -> Iterator[PlannerStatus]:
        """Hold the message while it is published."""
        surface, rig = (message_to_ros(InputStatus, input_to_fields(i, now)) for i in inputs)
        with self._lock:
            self._changed, self._told = False, time.monotonic()
            message, counts = self._message, self._count()
            message.header.stamp = stamp
            message.state, message.planning, message.waiting = state, planning, waiting
            message.surface, message.rig = surface, rig
            message.unreported = counts[LensStatus.UNREPORTED]
            message.sent = counts[LensStatus.SENT]
            message.verified = counts[LensStatus.VERIFIED]
            message.differ = counts[LensStatus.DIFFERS]
            message.failed = counts[LensStatus.FAILED]
            yield message

    def _count(self) -> Counter[int]:
        return Counter(lens.status for lens in self._message.lenses)


def _unreported(plan: FocusPlan, camera: CameraFocus) -> LensState:
    return LensState(
        header=plan.header,
        name=camera.name,
        plan_id=plan.plan_id,
        planned_distance=camera.focus_distance,
        sent_value=math.nan,
        read_value=math.nan,
        read_distance=math.nan,
    )
