# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Publishers of an input whose messages do not arrive, and what to do about it."""

from __future__ import annotations

from collections.abc import Iterator

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.subscription import Subscription
from rclpy.topic_endpoint_info import TopicEndpointInfo

from focus_planner.ros.graph import UNKNOWN, full_name_of
from focus_planner.runtime.inputs import Unheard


def unheard_publishers(
    node: Node, subscription: Subscription, type_name: str, *, received: bool
) -> Unheard:
    """Return what is known of the publishers of a topic that a subscription does not hear.

    Parameters
    ----------
    node : Node
    subscription : Subscription
    type_name : str
        Of its messages, such as ``"sensor_msgs/msg/PointCloud2"``.
    received : bool
        Whether it has received a message.
    """
    topic, wanted = subscription.topic_name, subscription.qos_profile
    never, missed = [], []
    for publisher in node.get_publishers_info_by_topic(topic):
        reasons = list(_incompatible(publisher, topic, type_name, wanted))
        never += [f"{publisher_name(publisher)} {reason}" for reason in reasons]
        if not reasons and not received:
            missed.append(f"{publisher_name(publisher)} {_missed(publisher, topic, wanted)}")
    return Unheard(tuple(dict.fromkeys(never)), tuple(dict.fromkeys(missed)))


def _incompatible(
    publisher: TopicEndpointInfo, topic: str, type_name: str, wanted: QoSProfile
) -> Iterator[str]:
    """Yield the reasons why a publisher's messages will never arrive."""
    offered = publisher.qos_profile
    if publisher.topic_type != type_name:
        yield (
            f"publishes {publisher.topic_type} on {topic}, where {type_name} is expected; publish"
            " that, or on another topic"
        )
        return
    if (
        offered.reliability == ReliabilityPolicy.BEST_EFFORT
        and wanted.reliability == ReliabilityPolicy.RELIABLE
    ):
        yield (
            f"publishes {topic} best effort, and the planner asks for reliable; publish reliably,"
            f" or start the planner with -p {_override(topic, 'reliability')}:=best_effort"
        )
    if (
        offered.durability == DurabilityPolicy.VOLATILE
        and wanted.durability == DurabilityPolicy.TRANSIENT_LOCAL
    ):
        yield (
            f"does not latch {topic} (volatile), and the planner asks for latched; latch it"
            " (transient local), or start the planner with"
            f" -p {_override(topic, 'durability')}:=volatile"
        )


def _missed(publisher: TopicEndpointInfo, topic: str, wanted: QoSProfile) -> str:
    """Return how the messages may have been missed that a compatible publisher has sent."""
    if publisher.qos_profile.durability != DurabilityPolicy.TRANSIENT_LOCAL:
        return (
            f"does not latch {topic} (volatile), and has sent nothing since the planner subscribed;"
            " publish again"
        )
    if wanted.durability != DurabilityPolicy.TRANSIENT_LOCAL:
        return (
            f"latches {topic}, and what it sent before the planner subscribed is not received;"
            f" publish again, or start the planner with"
            f" -p {_override(topic, 'durability')}:=transient_local"
        )
    return f"latches {topic}, and has sent nothing yet"


def _override(topic: str, policy: str) -> str:
    return f"qos_overrides.{topic}.subscription.{policy}"


def publisher_name(publisher: TopicEndpointInfo) -> str:
    """Return the full name of a publisher's node, or that it is not known."""
    if publisher.node_name == UNKNOWN:
        return "a publisher"
    return full_name_of(publisher)
