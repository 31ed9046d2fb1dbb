"""``~/status``: planned, sent and read back for every camera, and the age of the inputs."""

from __future__ import annotations

import math
import time
from collections import Counter
from datetime import datetime, timezone
from threading import Lock

from focus_planner_msgs.msg import CameraFocus, FocusPlan, InputStatus, LensState, PlannerStatus
from rclpy.node import Node

from focus_planner.core.validation import InputError
from focus_planner.lenses.driver import LensStatus
from focus_planner.messages.reading import Message
from focus_planner.messages.typestore import fields_of
from focus_planner.ros.conversions import message_to_ros
from focus_planner.ros.qos import LATCHED
from focus_planner.runtime.status import PlannerReport, input_to_fields

# Between messages about changes.
_MIN_PERIOD = 0.1


class StatusPublisher:
    """Publishes the planner's state, the plan in force, and what is known of every lens.

    Any thread may call. Its message is kept and modified, not made anew: a rig may have thousands
    of cameras.

    Parameters
    ----------
    node : Node
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        self._publisher = node.create_publisher(PlannerStatus, "~/status", LATCHED)
        self._message = PlannerStatus()
        self._places: dict[str, int] = {}
        self._lock = Lock()
        self._has_changed = True
        self._published = 0.0

    def planned(self, plan: FocusPlan, *, from_record: bool = False) -> None:
        """Note the plan now in force; its lenses have not reported yet."""
        lenses = [_unreported(plan, camera) for camera in plan.cameras]
        with self._lock:
            self._has_changed, message = True, self._message
            message.plan_id, message.planned_at = plan.plan_id, plan.header.stamp
            message.from_record = from_record
            message.plan_surface, message.plan_rig = plan.surface, plan.rig
            message.lenses = lenses
            self._places = {lens.name: place for place, lens in enumerate(lenses)}

    def reported(self, state: Message) -> bool:
        """Note the state of a lens; return False if it is about another plan.

        Raises
        ------
        InputError
            If its status is unknown.
        """
        if state.status not in set(LensStatus):
            expected = f"{min(LensStatus)} to {max(LensStatus)}, as LensState names them"
            raise InputError("status", expected, str(state.status))
        with self._lock:
            message = self._message
            place = self._places.get(state.name)
            if place is None or state.plan_id != message.plan_id:
                return False
            self._has_changed = True
            lens = message_to_ros(LensState, fields_of(state))
            lens.planned_distance = message.lenses[place].planned_distance
            message.lenses[place] = lens
        return True

    def clear(self) -> None:
        """Forget the plan and its lenses."""
        with self._lock:
            self._message, self._places = PlannerStatus(), {}
            self._has_changed, self._published = True, 0.0

    def changed(self) -> None:
        """Publish soon: something else that it reports has changed."""
        self._has_changed = True

    @property
    def lens_counts(self) -> Counter[int]:
        """How many lenses of the plan in force are in which status."""
        with self._lock:
            return self._count()

    def publish_if_due(self, report: PlannerReport, period: float) -> None:
        """Publish if something has changed, or ``period`` seconds have passed."""
        elapsed = time.monotonic() - self._published
        changed = self._has_changed or report.state != self._message.state
        if elapsed >= period or (changed and elapsed >= _MIN_PERIOD):
            self._publish(report)

    def _publish(self, report: PlannerReport) -> None:
        now = datetime.now(timezone.utc)
        surface, rig = (
            message_to_ros(InputStatus, input_to_fields(state, now))
            for state in (report.snapshot.surface, report.snapshot.rig)
        )
        with self._lock:
            self._has_changed, self._published = False, time.monotonic()
            message, counts = self._message, self._count()
            message.header.stamp = self._node.get_clock().now().to_msg()
            message.state, message.planning = report.state, report.planning
            message.waiting = report.waiting
            message.surface, message.rig = surface, rig
            message.unreported = counts[LensStatus.UNREPORTED]
            message.sent = counts[LensStatus.SENT]
            message.verified = counts[LensStatus.VERIFIED]
            message.differ = counts[LensStatus.DIFFERS]
            message.failed = counts[LensStatus.FAILED]
            message.accepted = counts[LensStatus.ACCEPTED]
            self._publisher.publish(message)

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
