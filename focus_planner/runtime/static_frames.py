# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The static transforms that were heard: kept by child frame, the newest of each, as in tf2."""

from __future__ import annotations

import math
from datetime import datetime, timezone

from focus_planner.core.validation import MAX_FRAME_DEPTH, InputError, shown
from focus_planner.messages.frames import TF_STATIC, HeardFrames, StaticTransform
from focus_planner.messages.limits import (
    MAX_FRAME_NAME,
    MAX_TRANSFORM_BYTES,
    MAX_TRANSFORMS,
    check_bytes,
)
from focus_planner.messages.transforms import transforms_from_bytes
from focus_planner.runtime.log import Log, ThrottledLog

# Metres, and by how much the length of a quaternion of a few digits is off: below it, no doubt.
_PLAIN = 1e6
_ROUNDED = 1e-4


class StaticFrames:
    """Accumulates what all publishers of ``/tf_static`` say, each of which latches its own part.

    A transform that is not valid is refused by itself: the one before it stays in force.

    Parameters
    ----------
    log : Log

    Attributes
    ----------
    heard : HeardFrames
        What is in force; replaced as a whole.
    """

    def __init__(self, log: Log) -> None:
        self.heard = HeardFrames()
        self._of_child: dict[str, StaticTransform] = {}
        self._log = ThrottledLog(log)

    def receive(self, payload: bytes) -> bool:
        """Take a serialized ``tf2_msgs/msg/TFMessage``; return whether anything has changed."""
        try:
            check_bytes(f"message on {TF_STATIC}", payload, MAX_TRANSFORM_BYTES)
            transforms = transforms_from_bytes(payload)
        except InputError as error:
            self._refuse(error)
            return False
        changed = False
        for transform in transforms:
            if self._of_child.get(transform.child) == transform:
                continue
            try:
                self._check(transform)
            except InputError as error:
                self._refuse(error)
                continue
            self._of_child[transform.child] = transform
            changed = True
        if changed:
            self.heard = HeardFrames(tuple(self._of_child.values()))
        return changed

    def _refuse(self, error: InputError) -> None:
        self._log.warning(f"refused from {TF_STATIC}: {error}", datetime.now(timezone.utc))

    def _check(self, new: StaticTransform) -> None:
        for what, name in (("frame_id", new.parent), ("child_frame_id", new.child)):
            if not name:
                raise InputError(f"transform {what}", "the name of a frame", "''")
            if len(name) > MAX_FRAME_NAME:
                expected = f"at most {MAX_FRAME_NAME} characters"
                raise InputError(f"transform {what}", expected, f"{len(name):,}")
        if new.child not in self._of_child and len(self._of_child) >= MAX_TRANSFORMS:
            raise InputError(
                TF_STATIC, f"at most {MAX_TRANSFORMS:,} frames", f"one more, {shown(new.child)}"
            )
        if not _is_plain(new):
            new.pose()
        frame = new.parent
        for _ in range(MAX_FRAME_DEPTH):
            if frame == new.child:
                raise InputError(
                    f"frame {new.child}", "a parent that is not below it", shown(new.parent)
                )
            above = self._of_child.get(frame)
            if above is None:
                return
            frame = above.parent
        raise InputError(f"frame {new.child}", f"at most {MAX_FRAME_DEPTH} frames above it", "more")


def _is_plain(transform: StaticTransform) -> bool:
    """Return whether there is no need to look closer, which takes a hundred times as long."""
    numbers_are = all(abs(number) < _PLAIN for number in transform.translation)
    return numbers_are and abs(math.hypot(*transform.rotation) - 1) < _ROUNDED
