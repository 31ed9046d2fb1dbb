# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Reading messages as inputs: by the functions that a replay uses too, in any process."""

from __future__ import annotations

from dataclasses import dataclass

from focus_planner.core.rig.rig import Rig
from focus_planner.core.surface.surface import Mesh, PointCloud
from focus_planner.core.validation import InputError
from focus_planner.messages.frames import HeardFrames
from focus_planner.messages.limits import Limits
from focus_planner.messages.reading import (
    NO_FRAMES,
    Optics,
    cloud_from_message,
    mesh_from_bytes,
    poses_from_message,
    rig_from_message,
)
from focus_planner.messages.typestore import CLOUD, POSES, RIG, deserialize


@dataclass(frozen=True)
class InputReader:
    """Reads messages with the parameters as they were when these arrived.

    Attributes
    ----------
    frame_id, importance_field : str
    limits : Limits
    longest_name : int
        The most characters that a camera's name may have to be part of a topic's name here.
    heard : HeardFrames
        What relates a message's frame to ``frame_id``.
    """

    frame_id: str
    importance_field: str
    limits: Limits
    longest_name: int
    heard: HeardFrames = NO_FRAMES

    def mesh(self, payload: bytes, _: Optics) -> Mesh:
        """Return a mesh."""
        return mesh_from_bytes(payload, self.limits)

    def cloud(self, payload: bytes, _: Optics) -> PointCloud:
        """Return a cloud."""
        message = deserialize(CLOUD, payload)
        return cloud_from_message(
            message, self.frame_id, self.limits, self.importance_field, self.heard
        )

    def poses(self, payload: bytes, optics: Optics) -> Rig:
        """Return the rig of cameras with these poses."""
        self.limits.check_rig(payload)
        message = deserialize(POSES, payload)
        return self._checked(poses_from_message(message, optics, self.frame_id, self.heard))

    def rig(self, payload: bytes, optics: Optics) -> Rig:
        """Return a rig."""
        self.limits.check_rig(payload)
        message = deserialize(RIG, payload)
        return self._checked(rig_from_message(message, optics, self.frame_id, self.heard))

    def _checked(self, rig: Rig) -> Rig:
        """Return the rig, if its cameras' names can be parts of topics' names.

        Only the length is left to check: the core checks the characters.
        """
        check_length(max((camera.name for camera in rig.cameras), key=len), self.longest_name)
        return rig


def check_length(name: str, longest: int) -> None:
    """Raise ``InputError`` if a camera's name is too long to be part of a topic's name."""
    if len(name) > longest:
        raise InputError(
            "camera name",
            f"at most {longest} characters, so that its topic can have a name",
            f"{name!r}, {len(name)} characters",
        )
