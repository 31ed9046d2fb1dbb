# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What drivers publish of their lenses with every frame, taken only when it is asked for."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.callback_groups import CallbackGroup
from rclpy.clock import JumpThreshold, TimeJump
from rclpy.duration import Duration
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy

from focus_planner.lenses.frames import Frame, FrameLog, FrameSource, frame_from_message, unclear
from focus_planner.lenses.orders import Time

TOPIC = "/diagnostics"
# Of every camera more than arrives between two looks, beside what others publish there.
_FRAMES_PER_CAMERA, _OTHERS = 8, 16


class PolledFrames:
    """The newest frames on ``/diagnostics``, for :class:`DriverLens`.

    All frames of all cameras arrive here, and only a few of them matter: the middleware keeps the
    newest, and the executor never wakes for them. They are taken by the thread that asks.

    Parameters
    ----------
    node : Node
    cameras : int
        How many drivers there are.
    others : collection of str
        Full names of nodes that publish on the topic, but no frames.
    """

    def __init__(self, node: Node, cameras: int, others: Collection[str]) -> None:
        self._node = node
        self._others = set(others)
        self._log = FrameLog()
        self._was_set_back = False
        # Kept: it is called for as long as it lives.
        self._jumps = node.get_clock().create_jump_callback(
            JumpThreshold(
                min_forward=None, min_backward=Duration(nanoseconds=-1), on_clock_change=True
            ),
            post_callback=self._note_jump,
        )
        self._subscription = node.create_subscription(
            DiagnosticArray,
            TOPIC,
            _not_called,
            QoSProfile(
                depth=_FRAMES_PER_CAMERA * cameras + _OTHERS,
                reliability=ReliabilityPolicy.BEST_EFFORT,
            ),
            callback_group=_NotExecuted(),
            event_callbacks=SubscriptionEventCallbacks(use_default_callbacks=False),
        )

    def expect(self, driver: str, source: FrameSource | None) -> None:
        """Note what a driver node's frames are called."""
        self._log.expect(driver, source)

    def frames_of(self, driver: str, after: Time) -> tuple[Frame, ...]:
        """Return a driver's newest frames, at most :data:`AGREEING`, of those not before a time.

        Raises
        ------
        InputError
            If it is not certain which frames are this driver's.
        """
        self._take()
        frames = self._log.frames_of(driver, after)
        # Frames with the name that all have by default may be of any camera in the graph.
        if frames and self._log.is_unnamed(driver) and self._has_others(driver):
            raise unclear(frames[0].frame_id)
        return frames

    def _note_jump(self, _: TimeJump) -> None:
        self._was_set_back = True

    def _take(self) -> None:
        with self._subscription.handle:
            while taken := self._subscription.handle.take_message(DiagnosticArray, False):
                frame = frame_from_message(taken[0])
                if frame is not None:
                    self._log.add(frame)
        if self._was_set_back:
            # Frames from before have stamps that only look newer than what is sent from now on.
            self._was_set_back = False
            self._log.forget()

    def _has_others(self, driver: str) -> bool:
        publishers = self._node.get_publishers_info_by_topic(self._subscription.topic_name)
        names = {f"{each.node_namespace.rstrip('/')}/{each.node_name}" for each in publishers}
        return bool(names - self._others - {driver})


class _NotExecuted(CallbackGroup):
    """Of what no executor waits for."""

    def can_execute(self, *_: Any) -> bool:
        return False

    def beginning_execution(self, *_: Any) -> bool:
        return False

    def ending_execution(self, *_: Any) -> None:
        pass


def _not_called(_: DiagnosticArray) -> None:
    raise AssertionError
