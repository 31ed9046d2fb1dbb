# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Static transforms between frames, as heard on ``/tf_static``, and what they relate.

As in tf2, a transform gives the pose of a child frame in its parent, quaternions are x, y, z, w,
and a slash before a frame's name is not part of it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

from focus_planner.core.text import did_you_mean
from focus_planner.core.validation import MAX_FRAME_DEPTH, InputError, first_few, shown

if TYPE_CHECKING:
    from focus_planner.core.rig.frames import FrameTransform, Similarity

#: The topic of static transforms.
TF_STATIC = "/tf_static"
# Names among which one that was meant is looked for.
_MOST_COMPARED = 1000


def frame_name(name: str) -> str:
    """Return a frame's name as tf2 has it."""
    return name.removeprefix("/")


@dataclass(frozen=True)
class StaticTransform:
    """The pose of a frame in its parent.

    Attributes
    ----------
    parent, child : str
    translation : tuple of 3 floats
        Metres.
    rotation : tuple of 4 floats
        Quaternion x, y, z, w.
    """

    parent: str
    child: str
    translation: tuple[float, float, float]
    rotation: tuple[float, float, float, float]

    def pose(self) -> FrameTransform:
        """Return it for a tree.

        Raises
        ------
        InputError
            If a number is not finite, or the quaternion is not of length 1.
        """
        from focus_planner.core.rig.frames import (  # noqa: PLC0415 - loads SciPy
            FrameTransform,
            similarity_from_pose,
        )

        where = f"transform from {self.child} to {self.parent}"
        pose = similarity_from_pose(where, self.translation, self.rotation)
        return FrameTransform(self.parent, self.child, pose)


@dataclass(frozen=True)
class HeardFrames:
    """Frames that were heard of, each with its pose in a parent.

    Attributes
    ----------
    transforms : tuple of StaticTransform
        One of each child.
    """

    transforms: tuple[StaticTransform, ...] = ()

    @cached_property
    def names(self) -> tuple[str, ...]:
        """All frames, in the order of the transforms, a parent before its child."""
        return tuple(
            dict.fromkeys(name for each in self.transforms for name in (each.parent, each.child))
        )

    @cached_property
    def _of_child(self) -> dict[str, StaticTransform]:
        return {each.child: each for each in self.transforms}

    def root_of(self, frame: str) -> str:
        """Return the topmost frame above a frame, possibly itself."""
        *_, last = (frame, *(each.parent for each in self._ancestry(frame)))
        return last

    def between(self, target: str, source: str) -> HeardFrames | None:
        """Return just the transforms that relate two frames; None if none do."""
        up_from_source, up_from_target = (list(self._ancestry(frame)) for frame in (source, target))
        above_target = [target, *(each.parent for each in up_from_target)]
        depth = {frame: i for i, frame in enumerate(above_target)}
        passed: list[StaticTransform] = []
        frame = source
        for each in (*up_from_source, None):
            if frame in depth:
                return HeardFrames((*passed, *up_from_target[: depth[frame]]))
            if each is not None:
                passed.append(each)
                frame = each.parent
        return None

    def lookup(self, target: str, source: str) -> Similarity | None:
        """Return ``target_from_source``; None if nothing relates the two.

        It depends on nothing but the transforms between them.

        Raises
        ------
        InputError
            If one of those is not valid.
        """
        from focus_planner.core.rig.frames import (  # noqa: PLC0415 - loads SciPy
            FrameTree,
            Similarity,
        )

        if target == source:
            return Similarity()
        path = self.between(target, source)
        if path is None:
            return None
        return FrameTree(each.pose() for each in path.transforms).lookup(target, source)

    def lack(self, target: str, source: str) -> str:
        """Return why nothing relates two frames, as a clause."""
        if not self.transforms:
            return f"nothing was heard on {TF_STATIC}"
        known = set(self.names)
        for frame in (source, target):
            if frame not in known:
                meant = did_you_mean(frame, self.names[:_MOST_COMPARED])
                lacks = f"{TF_STATIC} has no frame {shown(frame)}{meant and f' ({meant})'}"
                return f"{lacks}, only {first_few(self.names)}"
        tops = [self.root_of(frame) for frame in (source, target)]
        above = [
            "at the top" if top == frame else f"below {shown(top)}"
            for top, frame in zip(tops, (source, target), strict=True)
        ]
        return (
            f"on {TF_STATIC} {shown(source)} is {above[0]} and {shown(target)} is {above[1]},"
            " with no transform between the two trees"
        )

    def _ancestry(self, frame: str) -> Iterator[StaticTransform]:
        """Yield the transforms above a frame; not without end, should there be a cycle."""
        for _ in range(MAX_FRAME_DEPTH):
            above = self._of_child.get(frame)
            if above is None:
                return
            yield above
            frame = above.parent


def pose_of_message(header: Any, frame_id: str, heard: HeardFrames) -> Similarity | None:
    """Return ``planner_from_message``, for a message in another frame than the planner's.

    Parameters
    ----------
    header : std_msgs/msg/Header
    frame_id : str
        The planner's frame.
    heard : HeardFrames

    Returns
    -------
    Similarity or None
        None for a message in the planner's frame.

    Raises
    ------
    InputError
        If nothing that was heard relates the two frames; the error names both.
    """
    target, source = frame_name(frame_id), frame_name(header.frame_id)
    if source == target:
        return None
    if not source or not heard.transforms:
        raise InputError(
            "header.frame_id",
            f"{frame_id!r} (parameter frame_id)",
            shown(header.frame_id),
            "transform the message into that frame first",
        )
    pose = heard.lookup(target, source)
    if pose is None:
        raise InputError(
            "header.frame_id",
            f"{frame_id!r} (parameter frame_id), or a frame that {TF_STATIC} relates to it",
            f"{shown(header.frame_id)}, and {heard.lack(target, source)}",
            f"publish the transform on {TF_STATIC}, or transform the message first",
        )
    return pose
