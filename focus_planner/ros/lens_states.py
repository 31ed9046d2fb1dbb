# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""``~/lens_states``: what became of the plan at the lenses, as whoever publishes there says."""

from __future__ import annotations

from collections.abc import Callable

from focus_planner_msgs.msg import LensState
from rclpy.callback_groups import CallbackGroup
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.subscription import Subscription

from focus_planner.core.text import printable
from focus_planner.core.validation import InputError
from focus_planner.lenses.claims import MAX_STATE_BYTES
from focus_planner.messages.limits import check_bytes
from focus_planner.messages.typestore import LENS_STATE, deserialize
from focus_planner.parameters.planner_settings import Settings
from focus_planner.ros.publishers import publisher_name
from focus_planner.ros.status import StatusPublisher

_TOPIC = "~/lens_states"
# All lenses of a large rig may report at once.
_QOS = QoSProfile(
    depth=10_000,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)
# Names in the status, and characters of each.
_MAX_NAMES, _MAX_NAME = 32, 256


class LensStates:
    """Receives the states of lenses, and finds out who publishes them.

    rclpy does not tell the sender of a message (its message info holds times and a sequence number
    only), so that each of the publishers may have sent any state.

    Parameters
    ----------
    node : Node
    status : StatusPublisher
        Where states, and refused ones, are noted.
    settings : callable
        Returns the current parameters.
    """

    def __init__(
        self, node: Node, status: StatusPublisher, settings: Callable[[], Settings]
    ) -> None:
        self._node = node
        self._status = status
        self._settings = settings
        self._subscription: Subscription | None = None

    def open(self, group: CallbackGroup) -> None:
        """Subscribe."""
        # In bytes, for its size to be known before it is read.
        self._subscription = self._node.create_subscription(
            LensState, _TOPIC, self.receive, _QOS, callback_group=group, raw=True
        )

    def close(self) -> None:
        """Unsubscribe."""
        if self._subscription:
            self._node.destroy_subscription(self._subscription)
        self._subscription = None
        self._status.published_by(())

    def receive(self, payload: bytes) -> None:
        """Note a serialized state, or that it is refused."""
        try:
            check_bytes("LensState message", payload, MAX_STATE_BYTES)
            state = deserialize(LENS_STATE, payload)
            settings = self._settings()
            self._status.reported(state, settings.serving.lens_tolerance, settings.lens_tables)
        except InputError as error:
            self._status.refused(str(error))
            self._node.get_logger().warning(
                f"refused a lens state: {error}; published by {self._status.publishers_in_words}",
                throttle_duration_sec=1.0,
            )

    def check_publishers(self) -> None:
        """Find the nodes that publish the topic."""
        if self._subscription is None:
            return
        infos = self._node.get_publishers_info_by_topic(self._subscription.topic_name)
        names = sorted({printable(publisher_name(info), _MAX_NAME) for info in infos})
        if len(names) > _MAX_NAMES:
            names = [*names[:_MAX_NAMES], f"and {len(names) - _MAX_NAMES} more"]
        self._status.published_by(names)
