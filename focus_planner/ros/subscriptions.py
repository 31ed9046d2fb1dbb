"""The planner's inputs: topics as they arrive, to be read on the planning thread."""

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
from focus_planner.runtime.inputs import Arrival

# Some messages that come in one go are kept: if the newest is refused an older one may do.
_NEWEST = 4
# A sensor that publishes best effort, or a latched surface, is a matter of the node's parameters.
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
class _Taken:
    """A message, and when the middleware received it, nanoseconds."""

    at: int
    payload: bytes
    receive: Callable[[bytes], None]


@dataclass(frozen=True)
class _Listener:
    """A subscription, and what becomes of its messages."""

    subscription: Subscription
    receive: Callable[[bytes], None]

    def take(self) -> list[_Taken]:
        """Take a message if one has arrived."""
        with self.subscription.handle:
            taken = self.subscription.handle.take_message(self.subscription.msg_type, True)
        if taken is None:
            return []
        payload, info = taken
        return [_Taken(info["received_timestamp"], payload, self.receive)]


class GatedCallbackGroup(ReentrantCallbackGroup):
    """What is read at certain times only; until then messages and calls wait, as QoS allows."""

    is_open = False

    def can_execute(self, entity: Any) -> bool:
        """Return whether an entity may be served now."""
        return self.is_open and bool(super().can_execute(entity))


class Subscriptions:
    """Receives surfaces and rigs, whatever their topics, in the order of arrival.

    They are read later, by the functions that a replay reads with, so that what is refused is
    refused alike.

    Parameters
    ----------
    node : Node
    gate : GatedCallbackGroup
        Messages wait while it is closed.
    settings : callable
        Returns the parameters as they are now.
    check : callable
        Returns a rig that can be planned with here, or raises ``InputError``.
    surface, rig : callable
        Called with what arrives.

    Raises
    ------
    InputError
        If an override of a topic's quality of service cannot be.
    """

    def __init__(
        self,
        node: Node,
        gate: GatedCallbackGroup,
        settings: Callable[[], Settings],
        check: Callable[[Rig], Rig],
        surface: Callable[[Arrival[Any]], None],
        rig: Callable[[Arrival[Any]], None],
    ) -> None:
        self._node = node
        self._gate = gate
        self._settings = settings
        self._check = check
        self._listeners: list[_Listener] = []
        self._listen(Mesh, "~/mesh", surface, self._read_mesh)
        self._listen(PointCloud2, "~/cloud", surface, self._read_cloud)
        self._listen(PoseArray, "~/camera_poses", rig, self._read_poses)
        self._listen(CameraRig, "~/rig", rig, self._read_rig)

    def take_all(self) -> None:
        """Receive all that has arrived: what was sent before a request is planned with."""
        self._take_all([])

    def destroy(self) -> None:
        """Listen no more."""
        for listener in self._listeners:
            self._node.destroy_subscription(listener.subscription)
        self._listeners = []

    def _listen(
        self, message_type: type, topic: str, keep: Callable[[Arrival[Any]], None], read: Read
    ) -> None:
        name, type_name = self._node.resolve_topic_name(topic), type_name_of(message_type)

        def receive(payload: bytes) -> None:
            keep(Arrival(name, type_name, payload, partial(read, payload)))

        def take(payload: bytes, info: dict[str, int]) -> None:
            self._take_all([_Taken(info["received_timestamp"], payload, receive)])

        self._listeners.append(_Listener(self._subscribe(message_type, topic, take), receive))

    def _subscribe(self, message_type: type, topic: str, take: Callable[..., None]) -> Subscription:
        try:
            return self._node.create_subscription(
                message_type,
                topic,
                take,
                # Its own: what is overridden is written into it.
                QoSProfile(depth=_NEWEST, reliability=ReliabilityPolicy.RELIABLE),
                callback_group=self._gate,
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

    def _take_all(self, taken: list[_Taken]) -> None:
        """Receive what was taken and all else that has arrived, in the order of arrival.

        The executor goes by topic, not by time, and takes messages before calls only by chance.
        """
        while more := [one for listener in self._listeners for one in listener.take()]:
            taken += more
        for one in sorted(taken, key=lambda one: one.at):
            one.receive(one.payload)

    def _read_mesh(self, payload: bytes, _: Optics) -> Surface:
        return mesh_from_bytes(payload, self._settings().limits)

    def _read_cloud(self, payload: bytes, _: Optics) -> Surface:
        return cloud_from_message(
            deserialize(CLOUD, payload), self._settings().frame_id, self._settings().limits
        )

    def _read_poses(self, payload: bytes, optics: Optics) -> Rig:
        self._settings().limits.check_rig(payload)
        message = deserialize(POSES, payload)
        return self._check(poses_from_message(message, optics, self._settings().frame_id))

    def _read_rig(self, payload: bytes, optics: Optics) -> Rig:
        self._settings().limits.check_rig(payload)
        message = deserialize(RIG, payload)
        return self._check(rig_from_message(message, optics, self._settings().frame_id))
