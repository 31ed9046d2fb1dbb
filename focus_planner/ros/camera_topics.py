# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""One topic per camera: ``~/cameras/<name>/focus``."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from functools import cached_property
from typing import Any

from focus_planner_msgs.msg import CameraFocus, FocusPlan
from rclpy.event_handler import PublisherEventCallbacks
from rclpy.node import Node

from focus_planner.core.rig.names import MAX_NAME
from focus_planner.ros.qos import LATCHED
from focus_planner.runtime.input_reader import check_length

# Every default callback is one more entity per camera for the executor to wait on.
_NO_EVENTS = PublisherEventCallbacks(use_default_callbacks=False)


class CameraTopics:
    """The publishers of the rig in force, created before there is a plan for it."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._publishers: dict[str, Any] = {}
        self._told: dict[str, CameraFocus] = {}

    @cached_property
    def longest_name(self) -> int:
        """The most characters that a camera's name may have to be part of a topic's name."""
        for length in range(MAX_NAME, 0, -1):
            try:
                self._node.resolve_topic_name(_topic("a" * length))
            except RuntimeError:
                continue
            return length
        return 0

    def check_names(self, names: Sequence[str]) -> None:
        """Raise ``InputError`` if a camera's name is too long to be part of a topic's name."""
        check_length(max(names, key=len), self.longest_name)

    def follow(self, names: Sequence[str]) -> None:
        """Create missing publishers, and destroy those of cameras no longer in the rig."""
        for name in set(self._publishers).difference(names):
            self._node.destroy_publisher(self._publishers.pop(name))
            self._told.pop(name, None)
        for name in names:
            if name not in self._publishers:
                self._publishers[name] = self._node.create_publisher(
                    CameraFocus, _topic(name), LATCHED, event_callbacks=_NO_EVENTS
                )

    def changed(self, plan: FocusPlan) -> set[str]:
        """Return the cameras that a plan has other orders for than they were last told."""
        return {
            focus.name
            for focus in plan.cameras
            if focus.name not in self._told or _order(focus) != _order(self._told[focus.name])
        }

    def publish(self, plan: FocusPlan, told: Collection[str] | None = None) -> None:
        """Publish each camera's part of the plan; by default all cameras'."""
        for focus in plan.cameras:
            if told is None or focus.name in told:
                self._publishers[focus.name].publish(focus)
                self._told[focus.name] = focus

    def clear(self) -> None:
        """Destroy all publishers."""
        self.follow(())


def _order(focus: CameraFocus) -> tuple[object, ...]:
    """Return what a lens and its camera are to do."""
    unit = focus.device_unit  # without one the values are NaN, which equal nothing
    values = (focus.device_value, *focus.device_bracket) if unit else ()
    return focus.focus_distance, tuple(focus.bracket), unit, values


def _topic(name: str) -> str:
    return f"~/cameras/{name}/focus"
