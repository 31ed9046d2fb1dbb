# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Publishes the plan in force, for the whole rig and for each camera."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Collection, Sequence
from pathlib import Path
from threading import Lock
from typing import Protocol

from focus_planner_msgs.msg import FocusPlan
from rclpy.node import Node
from rclpy.publisher import Publisher

from focus_planner.core.validation import InputError
from focus_planner.messages.reading import Message
from focus_planner.messages.typestore import fields_of
from focus_planner.recording.last_plan import LastPlan, Skipped, last_plan
from focus_planner.ros.camera_topics import CameraTopics
from focus_planner.ros.conversions import message_to_ros
from focus_planner.ros.qos import LATCHED

# A subscriber that is being discovered may miss a message, and Fast DDS offers it again after three
# seconds only: a restored plan is published once most subscribers have been discovered, and again
# after these times.
_DISCOVERY_SECONDS = 0.3
_REPEAT_SECONDS = (0.3, 0.7, 1.5)
# Lines of the log.
_MAX_TOLD = 20


class PlanObserver(Protocol):
    """Is notified of a plan before it is published."""

    def __call__(
        self, plan: FocusPlan, *, from_record: bool = False, told: Collection[str] | None = None
    ) -> None:
        """Take note of a plan that is about to be published, and of which cameras are told it."""


class PlanPublisher:
    """Publishes ``~/focus_plan`` and ``~/cameras/<name>/focus``.

    Plans and rigs come from the planning thread, all else from the thread of a transition or the
    executor's; a lock orders them.

    Parameters
    ----------
    node : Node
    cameras : CameraTopics
    on_plan : PlanObserver
        Called before a plan is published, so that it is known when lenses report on it.

    Attributes
    ----------
    skipped : tuple
        The runs that were skipped in the search for the last plan, and why: names and texts.
    """

    def __init__(self, node: Node, cameras: CameraTopics, on_plan: PlanObserver) -> None:
        self._node = node
        self._cameras = cameras
        self._on_plan = on_plan
        self._publisher: Publisher | None = None
        self._repeats: deque[tuple[float, FocusPlan]] = deque()
        self._lock = Lock()
        self.skipped: tuple[tuple[str, str], ...] = ()

    def open(self) -> None:
        """Create the topic of the whole plan."""
        self._publisher = self._node.create_publisher(FocusPlan, "~/focus_plan", LATCHED)

    def close(self) -> None:
        """Destroy all topics, and with them the plan in force."""
        with self._lock:
            self._repeats.clear()
        self._cameras.clear()
        if self._publisher:
            self._node.destroy_publisher(self._publisher)

    def follow(self, names: Sequence[str]) -> None:
        """Create and destroy topics for the cameras of a new rig."""
        with self._lock:
            self._repeats.clear()
            self._cameras.follow(names)

    def publish(self, plan: FocusPlan, *, from_record: bool = False) -> None:
        """Put a plan in force."""
        with self._lock:
            self._repeats.clear()
            self._on_plan(plan, from_record=from_record)
            self._send(plan)

    def publish_changes(self, plan: FocusPlan) -> None:
        """Put a plan in force, and tell only the cameras that have something else to do."""
        with self._lock:
            self._repeats.clear()
            told = self._cameras.changed(plan)
            self._on_plan(plan, told=told)
            self._send(plan, told)

    def restore(self, directory: Path) -> None:
        """Put the last plan that this planner recorded below a directory in force again.

        Raises nothing, whatever there is in the directory.
        """
        self.skipped = ()
        try:
            found = last_plan(directory, self._node.get_fully_qualified_name(), self._check)
        except OSError as error:
            self._node.get_logger().error(f"cannot look for the last plan: {error}")
            return
        self._tell_skipped(found.skipped)
        if found.plan is None:
            return
        try:
            self._put_in_force(found.plan)
        except Exception as error:  # noqa: BLE001 - no run may keep the node from starting
            self._node.get_logger().error(f"cannot restore the plan of {found.plan.run}: {error!r}")

    def _tell_skipped(self, skipped: Sequence[Skipped]) -> None:
        self.skipped = tuple((each.run.name, each.why) for each in skipped)
        for name, why in self.skipped[:_MAX_TOLD]:
            text = f"skipped {name} in the search for the last plan: {why}"
            self._node.get_logger().warning(text)
        if len(skipped) > _MAX_TOLD:
            text = f"skipped {len(skipped) - _MAX_TOLD} more in the search for the last plan"
            self._node.get_logger().warning(text)

    def _put_in_force(self, last: LastPlan) -> None:
        plan = message_to_ros(FocusPlan, fields_of(last.message))
        self._cameras.follow([camera.name for camera in plan.cameras])
        time.sleep(_DISCOVERY_SECONDS)
        self.publish(plan, from_record=True)
        now = time.monotonic()
        self._repeats = deque((now + seconds, plan) for seconds in _REPEAT_SECONDS)
        self._node.get_logger().info(
            f"restored the last plan, {plan.plan_id}, from its record {last.run}"
        )

    def _check(self, message: Message) -> None:
        """Raise ``InputError`` unless a plan can be published."""
        try:
            message_to_ros(FocusPlan, fields_of(message))
        except (AssertionError, TypeError, ValueError) as error:
            raise InputError("plan", "one that can be published", repr(error)) from None
        self._cameras.check_names([camera.name for camera in message.cameras])

    def repeat_if_due(self) -> None:
        """Publish a restored plan again, unless a newer plan or rig has arrived since."""
        with self._lock:
            if self._repeats and self._repeats[0][0] <= time.monotonic():
                self._send(self._repeats.popleft()[1])

    def _send(self, plan: FocusPlan, told: Collection[str] | None = None) -> None:
        if self._publisher:
            self._publisher.publish(plan)
        self._cameras.publish(plan, told)
