# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""``~/status``: planned, sent and read back for every camera, and the age of the inputs."""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Collection, Sequence
from datetime import datetime, timezone
from threading import Lock

from focus_planner_msgs.msg import (
    CameraFocus,
    FocusPlan,
    InputStatus,
    LensState,
    PlanInput,
    PlannerStatus,
)
from rclpy.node import Node

from focus_planner.core.validation import InputError
from focus_planner.io.lens_tables import LensTables
from focus_planner.lenses.claims import check_claim, without_long_texts
from focus_planner.lenses.driver import LensStatus
from focus_planner.messages.reading import Message
from focus_planner.messages.typestore import fields_of
from focus_planner.ros.conversions import message_to_ros
from focus_planner.ros.qos import LATCHED
from focus_planner.runtime.status import (
    LensSummary,
    PlannerReport,
    input_to_fields,
    state_to_plan_input,
)

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
        self._message = _without_plan()
        self._places: dict[str, int] = {}
        self._cameras: Sequence[CameraFocus] = ()
        self._publishers: list[str] = []
        self._refused, self._refusal = 0, ""
        self._lock = Lock()
        self._has_changed = True
        self._published = 0.0

    def planned(
        self, plan: FocusPlan, *, from_record: bool = False, told: Collection[str] | None = None
    ) -> None:
        """Note the plan now in force, and which cameras are told it; by default all.

        Their lenses have not reported yet. What was reported of the others is still so: they were
        told the same by an earlier plan, whose name their states have.
        """
        with self._lock:
            self._has_changed, message = True, self._message
            lenses = [
                _unreported(plan, camera)
                if told is None or camera.name in told
                else message.lenses[self._places[camera.name]]
                for camera in plan.cameras
            ]
            message.plan_id, message.planned_at = plan.plan_id, plan.header.stamp
            message.from_record = from_record
            message.plan_surface, message.plan_rig = plan.surface, plan.rig
            message.lenses = lenses
            self._places = {lens.name: place for place, lens in enumerate(lenses)}
            self._cameras = plan.cameras
            self._refused, self._refusal = 0, ""

    def reported(self, state: Message, tolerance: float, tables: LensTables | None = None) -> bool:
        """Note the state of a lens; return False if it is about another plan than it was told.

        Parameters
        ----------
        state
            A ``LensState`` message.
        tolerance : float
            As :func:`focus_planner.lenses.claims.check_claim` has it.
        tables : LensTables, optional
            The planner's.

        Raises
        ------
        InputError
            If it does not fit the plan in force.
        """
        with self._lock:
            message = self._message
            place = self._places.get(state.name)
            if place is None:
                if not message.plan_id or state.plan_id != message.plan_id:
                    return False
                raise InputError("name", "a camera of the plan in force", repr(state.name))
            if state.plan_id != message.lenses[place].plan_id:
                return False
            table = tables.table_of(state.name) if tables else None
            check_claim(state, self._cameras[place], tolerance, table)
            state.unit, state.message = without_long_texts(state)
            self._has_changed = True
            message.lenses[place] = message_to_ros(LensState, fields_of(state))
        return True

    def refused(self, reason: str) -> None:
        """Note that the state of a lens was refused."""
        with self._lock:
            self._refused, self._refusal = self._refused + 1, reason

    def published_by(self, names: Sequence[str]) -> None:
        """Note the full names of the nodes that publish states of lenses."""
        if list(names) != self._publishers:
            self._publishers, self._has_changed = list(names), True

    @property
    def publishers_in_words(self) -> str:
        """The nodes that publish states of lenses."""
        return ", ".join(self._publishers)

    def clear(self) -> None:
        """Forget the plan and its lenses."""
        with self._lock:
            self._message, self._places, self._cameras = _without_plan(), {}, ()
            self._refused, self._refusal = 0, ""
            self._has_changed, self._published = True, 0.0

    def changed(self) -> None:
        """Publish soon: something else that it reports has changed."""
        self._has_changed = True

    @property
    def lens_summary(self) -> LensSummary:
        """What is known of the lenses of the plan in force."""
        with self._lock:
            publishers = self.publishers_in_words
            return LensSummary(self._count(), self._refused, self._refusal, publishers)

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
        surfaces = [
            message_to_ros(PlanInput, state_to_plan_input(state, now))
            for state in report.snapshot.surfaces
        ]
        with self._lock:
            self._has_changed, self._published = False, time.monotonic()
            message, counts = self._message, self._count()
            message.header.stamp = self._node.get_clock().now().to_msg()
            message.state, message.planning = report.state, report.planning
            message.waiting = report.waiting
            message.surface, message.rig, message.subjects = surface, rig, surfaces
            message.unreported = counts[LensStatus.UNREPORTED]
            message.sent = counts[LensStatus.SENT]
            message.verified = counts[LensStatus.VERIFIED]
            message.differ = counts[LensStatus.DIFFERS]
            message.failed = counts[LensStatus.FAILED]
            message.accepted = counts[LensStatus.ACCEPTED]
            message.lens_state_publishers = self._publishers
            self._publisher.publish(message)

    def _count(self) -> Counter[int]:
        return Counter(lens.status for lens in self._message.lenses)


def _without_plan() -> PlannerStatus:
    nothing = PlanInput(age=math.nan)
    return PlannerStatus(plan_surface=nothing, plan_rig=nothing)


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
