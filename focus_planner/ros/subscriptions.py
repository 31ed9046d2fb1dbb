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

from focus_planner.core.rig.rig import Rig
from focus_planner.core.surface.surface import Surface
from focus_planner.core.validation import InputError
from focus_planner.messages.reading import (
    Optics,
    cloud_from_message,
    mesh_from_bytes,
    poses_from_message,
    rig_from_message,
)
from focus_planner.messages.typestore import CLOUD, POSES, RIG, deserialize
from focus_planner.parameters.planner import Settings
from focus_planner.ros.conversions import type_name_of
from focus_planner.ros.publishers import unheard_publishers
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

Read = Callable[[bytes, Optics], Any]


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

    They are parsed later, by the functions that a replay uses too, so that both refuse the same
    messages for the same reasons.

    Parameters
    ----------
    node : Node
    group : GatedCallbackGroup
        Messages wait while it is closed.
    settings : callable
        Returns the current parameters.
    check : callable
        Returns the rig, or raises ``InputError`` if this node cannot plan for it.
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
        check: Callable[[Rig], Rig],
        surface: Callable[[Arrival[Any]], None],
        rig: Callable[[Arrival[Any]], None],
        unheard: Callable[[Unheard, Unheard], None],
    ) -> None:
        self._node = node
        self._group = group
        self._settings = settings
        self._check = check
        self._keep = {"surface": surface, "rig": rig}
        self._unheard = unheard
        self._received: set[str] = set()
        self._inputs: list[_Input] = []
        self._add(Mesh, "~/mesh", "surface", self._read_mesh)
        self._add(PointCloud2, "~/cloud", "surface", self._read_cloud)
        self._add(PoseArray, "~/camera_poses", "rig", self._read_poses)
        self._add(CameraRig, "~/rig", "rig", self._read_rig)

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
            keep(Arrival(name, type_name, payload, partial(read, payload)))

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

    def _read_mesh(self, payload: bytes, _: Optics) -> Surface:
        return mesh_from_bytes(payload, self._settings().limits)

    def _read_cloud(self, payload: bytes, _: Optics) -> Surface:
        settings = self._settings()
        return cloud_from_message(
            deserialize(CLOUD, payload),
            settings.frame_id,
            settings.limits,
            settings.importance_field,
        )

    def _read_poses(self, payload: bytes, optics: Optics) -> Rig:
        self._settings().limits.check_rig(payload)
        message = deserialize(POSES, payload)
        return self._check(poses_from_message(message, optics, self._settings().frame_id))

    def _read_rig(self, payload: bytes, optics: Optics) -> Rig:
        self._settings().limits.check_rig(payload)
        message = deserialize(RIG, payload)
        return self._check(rig_from_message(message, optics, self._settings().frame_id))


def _of_kind(found: dict[_Input, Unheard], kind: str) -> Unheard:
    parts = [unheard for each, unheard in found.items() if each.kind == kind]
    return Unheard(
        tuple(text for part in parts for text in part.never),
        tuple(text for part in parts for text in part.missed),
    )
