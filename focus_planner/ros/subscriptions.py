"""The planner's input topics: messages are taken in order of arrival, and parsed later."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

from focus_planner_msgs.msg import CameraRig
from geometry_msgs.msg import PoseArray
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.exceptions import ParameterException
from rclpy.node import Node
from rclpy.qos import QoSPolicyKind, QoSProfile, ReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions
from rclpy.subscription import Subscription
from sensor_msgs.msg import PointCloud2
from shape_msgs.msg import Mesh

from focus_planner.core.validation import InputError
from focus_planner.messages.reading import Optics
from focus_planner.parameters.planner_settings import Settings
from focus_planner.ros.conversions import type_name_of
from focus_planner.ros.publishers import unheard_publishers
from focus_planner.runtime.input_reader import InputReader
from focus_planner.runtime.inputs import Arrival, Unheard

# A burst of messages is kept: if the newest is refused, an older one may be valid.
_DEPTH = 4
# Parameters adapt the node to a sensor that publishes best effort, or to a latched surface.
_OVERRIDES = QoSOverridingOptions(
    [
        QoSPolicyKind.HISTORY,
        QoSPolicyKind.DEPTH,
        QoSPolicyKind.RELIABILITY,
        QoSPolicyKind.DURABILITY,
    ]
)

Read = Callable[[InputReader, bytes, Optics], Any]


@dataclass(frozen=True)
class _Received:
    """A message, and when the middleware received it, nanoseconds."""

    at: int
    payload: bytes
    receive: Callable[[bytes], None]


@dataclass(frozen=True)
class _Input:
    """A subscription, the kind and type of its messages, and their receiver."""

    subscription: Subscription
    kind: str
    type_name: str
    receive: Callable[[bytes], None]

    def take(self) -> list[_Received]:
        """Take a message from the middleware, if one has arrived."""
        with self.subscription.handle:
            taken = self.subscription.handle.take_message(self.subscription.msg_type, True)
        if taken is None:
            return []
        payload, info = taken
        return [_Received(info["received_timestamp"], payload, self.receive)]


class GatedCallbackGroup(ReentrantCallbackGroup):
    """Executes callbacks only while it is open; messages and calls wait in the middleware."""

    is_open = False

    def can_execute(self, entity: Any) -> bool:
        """Return whether a callback may run now."""
        return self.is_open and bool(super().can_execute(entity))


class Subscriptions:
    """Receives surfaces and rigs from all topics in order of arrival.

    They are parsed later, in another process.

    Parameters
    ----------
    node : Node
    group : GatedCallbackGroup
        Messages wait while it is closed.
    settings : callable
        Returns the current parameters.
    longest_name : int
        The most characters that a camera's name may have.
    surface, rig : callable
        Called with what arrives.
    unheard : callable
        Called with the publishers of surfaces and of rigs that are not received.

    Raises
    ------
    InputError
        If a topic's quality of service is overridden with something invalid.
    """

    def __init__(
        self,
        node: Node,
        group: GatedCallbackGroup,
        settings: Callable[[], Settings],
        longest_name: int,
        surface: Callable[[Arrival[Any]], None],
        rig: Callable[[Arrival[Any]], None],
        unheard: Callable[[Unheard, Unheard], None],
    ) -> None:
        self._node = node
        self._group = group
        self._settings = settings
        self._longest_name = longest_name
        self._keep = {"surface": surface, "rig": rig}
        self._unheard = unheard
        self._received: set[str] = set()
        self._inputs: list[_Input] = []
        self._add(Mesh, "~/mesh", "surface", InputReader.mesh)
        self._add(PointCloud2, "~/cloud", "surface", InputReader.cloud)
        self._add(PoseArray, "~/camera_poses", "rig", InputReader.poses)
        self._add(CameraRig, "~/rig", "rig", InputReader.rig)

    def take_all(self) -> None:
        """Receive all messages that have arrived, such as those sent just before a request."""
        self._take_all([])
        self.check_publishers()

    def check_publishers(self) -> None:
        """Find the publishers whose messages do not arrive."""
        found = {
            each: unheard_publishers(
                self._node,
                each.subscription,
                each.type_name,
                received=each.subscription.topic_name in self._received,
            )
            for each in self._inputs
        }
        self._unheard(*(_of_kind(found, kind) for kind in ("surface", "rig")))

    def destroy(self) -> None:
        """Unsubscribe."""
        for each in self._inputs:
            self._node.destroy_subscription(each.subscription)
        self._inputs = []

    def _add(self, message_type: type, topic: str, kind: str, read: Read) -> None:
        name, type_name = self._node.resolve_topic_name(topic), type_name_of(message_type)
        keep = self._keep[kind]

        def receive(payload: bytes) -> None:
            self._received.add(name)
            keep(Arrival(name, type_name, payload, partial(read, self._reader(), payload)))

        def take(payload: bytes, info: dict[str, int]) -> None:
            self._take_all([_Received(info["received_timestamp"], payload, receive)])

        subscription = self._subscribe(message_type, topic, take)
        self._inputs.append(_Input(subscription, kind, type_name, receive))

    def _subscribe(self, message_type: type, topic: str, take: Callable[..., None]) -> Subscription:
        try:
            return self._node.create_subscription(
                message_type,
                topic,
                take,
                # Not shared: rclpy writes overrides into it.
                QoSProfile(depth=_DEPTH, reliability=ReliabilityPolicy.RELIABLE),
                callback_group=self._group,
                raw=True,
                qos_overriding_options=_OVERRIDES,
            )
        except (ParameterException, RuntimeError, ValueError) as error:
            raise InputError(
                f"qos_overrides.{self._node.resolve_topic_name(topic)}.subscription",
                "history, depth, reliability and durability as ROS names them",
                f"what rclpy refuses ({error})",
                "for instance durability:=transient_local",
            ) from None

    def _take_all(self, taken: list[_Received]) -> None:
        """Receive messages that were taken, and all others that have arrived, in order of arrival.

        The executor serves entities in an order of its own: topic by topic, calls in between.
        """
        while more := [one for each in self._inputs for one in each.take()]:
            taken += more
        for one in sorted(taken, key=lambda one: one.at):
            one.receive(one.payload)

    def _reader(self) -> InputReader:
        settings = self._settings()
        return InputReader(
            settings.frame_id, settings.importance_field, settings.limits, self._longest_name
        )


def _of_kind(found: dict[_Input, Unheard], kind: str) -> Unheard:
    parts = [unheard for each, unheard in found.items() if each.kind == kind]
    return Unheard(
        tuple(text for part in parts for text in part.never),
        tuple(text for part in parts for text in part.missed),
    )
