# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A rig from ``/tf_static`` and ``CameraInfo``: looks at the graph now and then."""

from __future__ import annotations

import time

from rclpy.node import Node

from focus_planner.messages.frames import HeardFrames
from focus_planner.parameters.planner_settings import Settings
from focus_planner.ros.camera_infos import CameraInfos
from focus_planner.runtime.rig_of_frames import Composed, RigOfFrames

# Between two looks, seconds: while something is missing, and afterwards.
_WHILE_LACKING = 0.2
_WHILE_COMPLETE = 1.0


class RigFromFrames:
    """Puts a rig together from what is on the graph.

    Parameters
    ----------
    node : Node
    settings : Settings

    Attributes
    ----------
    lacks : str
        What is missing; empty if nothing is.
    """

    def __init__(self, node: Node, settings: Settings) -> None:
        wanted = settings.camera_frames
        self.lacks = ""
        self._rig = RigOfFrames(wanted, settings.frame_id, node.get_logger().info)
        self._infos = CameraInfos(
            node, lambda topic: wanted.camera_of(topic) is not None, settings.limits.max_cameras
        )
        self._heard: HeardFrames | None = None
        self._gone: frozenset[str] = frozenset()
        self._payload = b""
        self._due = 0.0

    def is_due(self) -> bool:
        """Return whether it is time to look."""
        return time.monotonic() >= self._due

    def look(self, heard: HeardFrames) -> bytes:
        """Look at the graph; return the serialized rig if it is complete and new, else nothing."""
        self._infos.discover()
        changed = [self._rig.receive_info(*info) for info in self._infos.look()]
        gone = frozenset(self._infos.gone)
        if any(changed) or heard is not self._heard or gone != self._gone:
            self._heard, self._gone = heard, gone
            composed = self._rig.compose(heard, gone)
        else:
            composed = Composed(self._payload, self.lacks)
        self.lacks = composed.lacks
        self._due = time.monotonic() + (_WHILE_LACKING if self.lacks else _WHILE_COMPLETE)
        if not composed.payload or composed.payload == self._payload:
            return b""
        self._payload = composed.payload
        return composed.payload

    def destroy(self) -> None:
        """Unsubscribe."""
        self._infos.destroy()
