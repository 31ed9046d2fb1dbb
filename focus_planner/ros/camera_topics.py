"""One topic per camera: ``~/cameras/<name>/focus``."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from focus_planner_msgs.msg import CameraFocus, FocusPlan
from rclpy.event_handler import PublisherEventCallbacks
from rclpy.node import Node

from focus_planner.core.rig.rig import Rig
from focus_planner.core.validation import InputError
from focus_planner.ros.qos import LATCHED

# Every default callback is one more entity per camera for the executor to wait on.
_NO_EVENTS = PublisherEventCallbacks(use_default_callbacks=False)


class CameraTopics:
    """The publishers of the rig in force, created before there is a plan for it."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._publishers: dict[str, Any] = {}

    def check(self, rig: Rig) -> Rig:
        """Return the rig.

        Raises
        ------
        InputError
            If a camera's name cannot be part of a topic's name.
        """
        self.check_names([camera.name for camera in rig.cameras])
        return rig

    def check_names(self, names: Sequence[str]) -> None:
        """Raise ``InputError`` if a camera's name cannot be part of a topic's name."""
        longest = max(names, key=len)
        try:
            # Only the length is left to check: the core checks the characters.
            self._node.resolve_topic_name(_topic(longest))
        except RuntimeError as error:
            raise InputError(
                "camera name", "part of a topic's name", f"{longest!r} ({error})"
            ) from None

    def follow(self, names: Sequence[str]) -> None:
        """Create missing publishers, and destroy those of cameras no longer in the rig."""
        for name in set(self._publishers).difference(names):
            self._node.destroy_publisher(self._publishers.pop(name))
        for name in names:
            if name not in self._publishers:
                self._publishers[name] = self._node.create_publisher(
                    CameraFocus, _topic(name), LATCHED, event_callbacks=_NO_EVENTS
                )

    def publish(self, plan: FocusPlan) -> None:
        """Publish each camera's part of the plan."""
        for focus in plan.cameras:
            self._publishers[focus.name].publish(focus)

    def clear(self) -> None:
        """Destroy all publishers."""
        self.follow(())


def _topic(name: str) -> str:
    return f"~/cameras/{name}/focus"
