# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""``tf2_msgs/msg/TFMessage`` to static transforms and back."""

from __future__ import annotations

from collections.abc import Iterable

from focus_planner.messages.frames import StaticTransform, frame_name
from focus_planner.messages.typestore import TRANSFORMS, deserialize, serialize


def transforms_from_bytes(payload: bytes) -> list[StaticTransform]:
    """Return the transforms of a serialized message, valid or not.

    Raises
    ------
    InputError
        If these are not the bytes of such a message.
    """
    return [
        StaticTransform(
            frame_name(each.header.frame_id),
            frame_name(each.child_frame_id),
            (at.translation.x, at.translation.y, at.translation.z),
            (at.rotation.x, at.rotation.y, at.rotation.z, at.rotation.w),
        )
        for each in deserialize(TRANSFORMS, payload).transforms
        for at in (each.transform,)
    ]


def transforms_to_bytes(transforms: Iterable[StaticTransform]) -> bytes:
    """Return the serialized message of these transforms, whose stamps are zero."""
    fields = [
        {
            "header": {"frame_id": each.parent},
            "child_frame_id": each.child,
            "transform": {
                "translation": dict(zip("xyz", each.translation, strict=True)),
                "rotation": dict(zip("xyzw", each.rotation, strict=True)),
            },
        }
        for each in transforms
    ]
    return serialize(TRANSFORMS, {"transforms": fields})
