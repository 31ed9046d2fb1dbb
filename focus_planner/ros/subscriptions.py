# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The planner's input topics: messages are taken in order of arrival, and parsed later."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, fields, replace
from datetime import datetime, timezone
from functools import partial
from typing import Any

from focus_planner_msgs.msg import CameraRig
from geometry_msgs.msg import PoseArray
from rclpy.exceptions import ParameterException
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSPolicyKind, QoSProfile, ReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions
from rclpy.subscription import Subscription
from sensor_msgs.msg import PointCloud2
from shape_msgs.msg import Mesh

from focus_planner.core.validation import InputError, first_few
from focus_planner.io.camera_frames import is_optical
from focus_planner.messages.cdr import header_frame
from focus_planner.messages.frames import TF_STATIC, HeardFrames, frame_name
from focus_planner.messages.reading import NO_FRAMES, Optics
from focus_planner.messages.typestore import MESH, RIG
from focus_planner.parameters.planner_settings import Settings
from focus_planner.ros.conversions import type_name_of
from focus_planner.ros.gated_group import GatedCallbackGroup
from focus_planner.ros.publishers import unheard_publishers
from focus_planner.ros.rig_from_frames import RigFromFrames
from focus_planner.runtime.input_reader import InputReader
from focus_planner.runtime.inputs import Arrival, Unheard
from focus_planner.runtime.static_frames import StaticFrames

try:
    from tf2_msgs.msg import TFMessage
except ImportError:  # of a set-up that is older than this
    TFMessage = None

# A burst of messages is kept: if the newest is refused, an older one may be valid.
_DEPTH = 4
# Each publisher of /tf_static latches a message of its own, and all arrive at once.
_DEPTH_OF_FRAMES = 1000
_FRAMES = "frames"
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


@dataclass(frozen=True)
class _Message:
    """A message of a kind of input, when it arrived, and what reads it."""

    kind: str
    topic: str
    type_name: str
    payload: bytes
    read: Read
    at: datetime = field(default_factory=lambda: datetime.now(timezone.utc))


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
        self._frames = StaticFrames(node.get_logger())
        self._frames_changed = False
        self._newest: dict[str, tuple[_Message, HeardFrames]] = {}  # in other frames
        self._rig_from_frames = self._from_frames()
        self._add(Mesh, "~/mesh", "surface", InputReader.mesh)
        self._add(PointCloud2, "~/cloud", "surface", InputReader.cloud)
        self._add(PoseArray, "~/camera_poses", "rig", InputReader.poses)
        self._add(CameraRig, "~/rig", "rig", InputReader.rig)
        self._add_frames()

    def take_all(self) -> None:
        """Receive all messages that have arrived, such as those sent just before a request."""
        self._take_all([])
        self._look_at_frames()
        self.check_publishers()

    def look_if_due(self) -> None:
        """Look for what makes a rig of frames, unless inputs are left unread."""
        if self._group.is_open and self._rig_from_frames and self._rig_from_frames.is_due():
            before = self._rig_from_frames.lacks
            self._look_at_frames()
            if self._rig_from_frames.lacks != before:
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
        surface, rig, frames = (_of_kind(found, kind) for kind in ("surface", "rig", _FRAMES))
        if self._rig_from_frames:
            rig = _together(rig, frames)
            if self._rig_from_frames.lacks:
                rig = replace(rig, incomplete=(self._rig_from_frames.lacks,))
        else:
            rig = replace(rig, missed=(*rig.missed, *self._frames_not_asked_for()))
        self._unheard(
            _together(surface, self._lacking("surface", frames)),
            _together(rig, self._lacking("rig", frames)),
        )

    def destroy(self) -> None:
        """Unsubscribe."""
        for each in self._inputs:
            self._node.destroy_subscription(each.subscription)
        self._inputs = []
        if self._rig_from_frames:
            self._rig_from_frames.destroy()

    def _add(self, message_type: type, topic: str, kind: str, read: Read) -> None:
        name, type_name = self._node.resolve_topic_name(topic), type_name_of(message_type)

        def receive(payload: bytes) -> None:
            self._received.add(name)
            self._pass_on(_Message(kind, name, type_name, payload, read))

        qos = QoSProfile(depth=_DEPTH, reliability=ReliabilityPolicy.RELIABLE)
        self._subscribe(message_type, topic, kind, receive, qos)

    def _subscribe(
        self,
        message_type: type,
        topic: str,
        kind: str,
        receive: Callable[[bytes], None],
        qos: QoSProfile,
    ) -> None:
        """Subscribe, with a quality of service that is not shared: rclpy writes overrides in it."""

        def take(payload: bytes, info: dict[str, int]) -> None:
            self._take_all([_Received(info["received_timestamp"], payload, receive)])

        callback: Callable[..., None] = take
        try:
            subscription = self._node.create_subscription(
                message_type,
                topic,
                callback,
                qos,
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
        self._inputs.append(_Input(subscription, kind, type_name_of(message_type), receive))

    def _pass_on(self, message: _Message) -> None:
        """Have an input read, with the transforms that it depends on."""
        heard = self._depends_on(message)
        read = partial(message.read, self._reader(heard), message.payload)
        self._newest.pop(message.kind, None)
        if self._is_elsewhere(message):
            self._newest[message.kind] = message, heard
        about = message.topic, message.type_name, message.payload
        self._keep[message.kind](Arrival(*about, read, message.at, heard=heard))

    def _take_all(self, taken: list[_Received]) -> None:
        """Receive messages that were taken, and all others that have arrived, in order of arrival.

        The executor serves entities in an order of its own: topic by topic, calls in between.
        """
        while more := [one for each in self._inputs for one in each.take()]:
            taken += more
        for one in sorted(taken, key=lambda one: one.at):
            one.receive(one.payload)
        if self._frames_changed:
            self._frames_changed = False
            self._read_again()

    def _reader(self, heard: HeardFrames = NO_FRAMES) -> InputReader:
        settings = self._settings()
        field, limits = settings.importance_field, settings.limits
        return InputReader(settings.frame_id, field, limits, self._longest_name, heard)

    # --- frames --------------------------------------------------------------------------------

    def _from_frames(self) -> RigFromFrames | None:
        settings = self._settings()
        if not settings.camera_frames.frames:
            return None
        if TFMessage is None:
            raise InputError(
                "camera_frames",
                f"the package tf2_msgs, for messages on {TF_STATIC}",
                "none",
                "repeat the set-up (make setup), or install ros-jazzy-tf2-msgs",
            )
        return RigFromFrames(self._node, settings)

    def _add_frames(self) -> None:
        if TFMessage is None:
            self._node.get_logger().warning(
                f"{TF_STATIC} is not heard, so messages in other frames than"
                f" {self._settings().frame_id} are refused: there is no package tf2_msgs; repeat"
                " the set-up (make setup)"
            )
            return
        name = self._node.resolve_topic_name(TF_STATIC)

        def receive(payload: bytes) -> None:
            self._received.add(name)
            self._frames_changed |= self._frames.receive(payload)

        qos = QoSProfile(
            depth=_DEPTH_OF_FRAMES,
            reliability=ReliabilityPolicy.RELIABLE,
            durability=DurabilityPolicy.TRANSIENT_LOCAL,
        )
        self._subscribe(TFMessage, TF_STATIC, _FRAMES, receive, qos)

    def _frames_of(self, message: _Message) -> tuple[str, str]:
        """Return the planner's frame and a message's; a mesh is in the planner's."""
        target = frame_name(self._settings().frame_id)
        return target, target if message.type_name == MESH else frame_name(
            header_frame(message.payload)
        )

    def _is_elsewhere(self, message: _Message) -> bool:
        """Return whether a message names another frame than the planner's."""
        target, source = self._frames_of(message)
        return source not in {"", target}

    def _is_apart(self, message: _Message) -> bool:
        """Return whether nothing that was heard relates a message's frame to the planner's."""
        target, source = self._frames_of(message)
        return self._frames.heard.between(target, source) is None

    def _depends_on(self, message: _Message) -> HeardFrames:
        """Return the transforms that a message depends on; all, if they do not relate its frame."""
        if not self._is_elsewhere(message):
            return NO_FRAMES
        target, source = self._frames_of(message)
        return self._frames.heard.between(target, source) or self._frames.heard

    def _frames_not_asked_for(self) -> Iterator[str]:
        """Yield that there are frames of cameras, which a parameter would make a rig of."""
        optical = [frame for frame in self._frames.heard.names if is_optical(frame)]
        if optical:
            yield (
                f"a rig of {first_few(optical, 3)}, which {TF_STATIC} has: start the planner with"
                " -p camera_frames:=... to put one together"
            )

    def _lacking(self, kind: str, frames: Unheard) -> Unheard:
        """Return what is not received that the newest input needs to be in the planner's frame."""
        message, _ = self._newest.get(kind, (None, NO_FRAMES))
        if message is None or not self._is_apart(message):
            return Unheard()
        if self._frames.heard.transforms:
            return frames  # the refusal says what was heard
        target, source = self._frames_of(message)
        lack = self._frames.heard.lack(target, source)
        return replace(frames, incomplete=(f"a transform from {source} to {target}: {lack}",))

    def _read_again(self) -> None:
        """Have the newest inputs read again whose transforms have changed."""
        for message, heard in list(self._newest.values()):
            if self._depends_on(message) != heard:
                self._pass_on(message)

    def _look_at_frames(self) -> None:
        if self._rig_from_frames is None:
            return
        payload = self._rig_from_frames.look(self._frames.heard)
        if payload:
            name = self._node.resolve_topic_name(TF_STATIC)
            self._pass_on(_Message("rig", name, RIG, payload, InputReader.rig))


def _together(one: Unheard, other: Unheard) -> Unheard:
    """Return the publishers of both, each once."""
    return Unheard(
        *(
            tuple(dict.fromkeys(getattr(one, each.name) + getattr(other, each.name)))
            for each in fields(Unheard)
        )
    )


def _of_kind(found: dict[_Input, Unheard], kind: str) -> Unheard:
    parts = [unheard for each, unheard in found.items() if each.kind == kind]
    return Unheard(
        tuple(text for part in parts for text in part.never),
        tuple(text for part in parts for text in part.missed),
    )
