# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Shows the plan in force in 3D: ``~/markers`` and ``~/quality_cloud``."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from threading import Lock
from typing import Any

from rclpy.event_handler import PublisherEventCallbacks
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy
from sensor_msgs.msg import PointCloud2
from visualization_msgs.msg import Marker, MarkerArray

from focus_planner.messages.quality_cloud import quality_cloud_to_fields
from focus_planner.messages.writing import Stamp
from focus_planner.ros.conversions import message_to_ros
from focus_planner.ros.qos import LATCHED
from focus_planner.runtime.planning_orders import Visuals

# A subscriber that is being discovered may miss a message, and Fast DDS offers it again after three
# seconds only: what it is to see is published once it has probably discovered the planner.
_DISCOVERY_SECONDS = 0.3
_TOPICS = {"~/markers": MarkerArray, "~/quality_cloud": PointCloud2}


class VisualsPublisher:
    """Publishes what shows a plan, as bytes made elsewhere, and tells when somebody subscribes.

    Safe to use from any thread.

    Parameters
    ----------
    node : Node
    on_watcher : callable
        Called, on the executor's thread, when subscribers have been discovered.
    """

    def __init__(self, node: Node, on_watcher: Callable[[], None]) -> None:
        self._node = node
        self._on_watcher = on_watcher
        self._publishers: list[Publisher] = []
        self._latched: list[bytes] = []
        self._welcome_at = math.inf
        self._lock = Lock()

    @property
    def is_watched(self) -> bool:
        """Whether anybody subscribes."""
        with self._lock:
            return any(each.get_subscription_count() for each in self._publishers)

    def open(self) -> None:
        """Create the topics."""
        events = PublisherEventCallbacks(matched=self._matched, use_default_callbacks=False)
        with self._lock:
            self._publishers = [
                self._node.create_publisher(kind, topic, LATCHED, event_callbacks=events)
                for topic, kind in _TOPICS.items()
            ]

    def close(self) -> None:
        """Destroy the topics, and with them what they show."""
        with self._lock:
            for publisher in self._publishers:
                self._node.destroy_publisher(publisher)
            self._publishers, self._latched = [], []

    def show(self, visuals: Visuals) -> None:
        """Show a plan in place of what was shown before."""
        with self._lock:
            self._latched = [visuals.markers, visuals.quality_cloud]
            self._publish(self._latched)

    def hide(self, frame_id: str, stamp: Stamp) -> None:
        """Show no plan any more, neither now nor to those who subscribe later."""
        with self._lock:
            if self._latched:
                self._latched = []
                self._publish(_nothing(frame_id, stamp))

    def welcome_if_due(self) -> None:
        """Show the plan to those who have been discovered; to be called now and then."""
        if time.monotonic() < self._welcome_at:
            return
        self._welcome_at = math.inf
        with self._lock:
            if self._latched and self._has_volatile_subscriber():
                self._publish(self._latched)
        self._on_watcher()

    def _publish(self, messages: list[Any]) -> None:
        if self._publishers:  # not closed
            for publisher, message in zip(self._publishers, messages, strict=True):
                publisher.publish(message)

    def _matched(self, status: Any) -> None:
        if status.current_count_change > 0:
            self._welcome_at = time.monotonic() + _DISCOVERY_SECONDS

    def _has_volatile_subscriber(self) -> bool:
        """Return whether anybody is not sent what is latched, as displays that a user adds."""
        return any(
            subscriber.qos_profile.durability == DurabilityPolicy.VOLATILE
            for publisher in self._publishers
            for subscriber in self._node.get_subscriptions_info_by_topic(publisher.topic_name)
        )


def _nothing(frame_id: str, stamp: Stamp) -> list[Any]:
    # Viewers ignore a cloud whose frame they do not know.
    cloud = message_to_ros(PointCloud2, quality_cloud_to_fields(None, frame_id, stamp))
    gone = Marker(header=cloud.header, action=Marker.DELETEALL)
    return [MarkerArray(markers=[gone]), cloud]
