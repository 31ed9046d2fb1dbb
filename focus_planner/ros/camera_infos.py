# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""``CameraInfo`` of cameras on the graph, whoever publishes it and however often.

A rig may publish 168 of them thirty times a second, each the same as the one before. So nobody is
woken by them: they wait in the middleware, one a topic, until somebody looks.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.subscription import Subscription
from sensor_msgs.msg import CameraInfo

from focus_planner.ros.gated_group import GatedCallbackGroup

_TYPE = "sensor_msgs/msg/CameraInfo"
# Topics whose publishers are looked up again at a time, which takes long where there are hundreds.
_AT_A_TIME = 20


class CameraInfos:
    """Subscribes to ``CameraInfo`` as it turns up on the graph.

    Parameters
    ----------
    node : Node
    is_wanted : callable
        Returns whether a topic is to be subscribed to.
    most : float
        The greatest number of topics.

    Attributes
    ----------
    gone : set of str
        Topics that had publishers, and have none any more.
    """

    def __init__(self, node: Node, is_wanted: Callable[[str], bool], most: float) -> None:
        self.gone: set[str] = set()
        self._node = node
        self._is_wanted = is_wanted
        self._most = most
        self._group = GatedCallbackGroup()  # never open
        self._subscriptions: dict[str, tuple[Subscription, QoSProfile]] = {}
        self._silent: dict[str, None] = {}  # since the last look; those looked up last come last

    def discover(self) -> None:
        """Subscribe to topics that have come, in the way that their publishers offer."""
        for topic, types in self._node.get_topic_names_and_types():
            if _TYPE not in types or topic in self._subscriptions or not self._is_wanted(topic):
                continue
            if len(self._subscriptions) >= self._most:
                break
            self._subscribe(topic)
        for topic in list(self._silent)[:_AT_A_TIME]:
            self._silent[topic] = self._silent.pop(topic)
            self._subscribe(topic)

    def look(self) -> Iterator[tuple[str, bytes]]:
        """Yield the newest message of each topic that has had one since the last look."""
        for topic, (subscription, _) in self._subscriptions.items():
            with subscription.handle:
                taken = subscription.handle.take_message(CameraInfo, True)
            if taken is None:
                self._silent.setdefault(topic)
                continue
            self._silent.pop(topic, None)
            self.gone.discard(topic)
            yield topic, taken[0]

    def _subscribe(self, topic: str) -> None:
        """Subscribe to a topic unless it has no publisher, or is subscribed to as they offer it.

        A driver that is started again, or another one, may offer less than the one before.
        """
        offered = [
            each.qos_profile
            for each in self._node.get_publishers_info_by_topic(topic)
            if each.topic_type == _TYPE
        ]
        before, qos = self._subscriptions.get(topic, (None, None))
        if not offered:
            self.gone |= {topic} if before else set()
            return
        self.gone.discard(topic)
        wanted = _heard_from_all(offered)
        if wanted == qos:
            return
        if before is not None:
            self._node.destroy_subscription(before)
        subscription = self._node.create_subscription(
            CameraInfo, topic, lambda _: None, wanted, callback_group=self._group, raw=True
        )
        self._subscriptions[topic] = subscription, wanted

    def destroy(self) -> None:
        """Unsubscribe."""
        for subscription, _ in self._subscriptions.values():
            self._node.destroy_subscription(subscription)
        self._subscriptions.clear()


def _heard_from_all(offered: list[QoSProfile]) -> QoSProfile:
    """Return the most that all publishers offer; what was latched is heard if all latch."""
    reliable = all(each.reliability == ReliabilityPolicy.RELIABLE for each in offered)
    latched = all(each.durability == DurabilityPolicy.TRANSIENT_LOCAL for each in offered)
    return QoSProfile(
        depth=1,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
    )
