# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A rig put together from frames that were heard, and the ``CameraInfo`` of each.

It is a message like those on ``~/rig``: whatever becomes of those, becomes of it.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase

from focus_planner.core.validation import InputError, first_few
from focus_planner.io.camera_frames import (
    body_frames,
    device_of,
    frame_from_optical,
    note_on_bodies,
    without_optical,
)
from focus_planner.io.names import camera_names
from focus_planner.messages.frames import HeardFrames, frame_name
from focus_planner.messages.limits import MAX_CAMERA_INFO_BYTES, MAX_FRAME_NAME, check_bytes
from focus_planner.messages.reading import Message
from focus_planner.messages.typestore import CAMERA_INFO, RIG, deserialize, fields_of, serialize
from focus_planner.messages.writing import Fields, pose_to_fields
from focus_planner.parameters.camera_frames import CameraFrames

# What intrinsics are made of; R and P are for rectified images.
_IMAGE = ("width", "height", "distortion_model", "d", "k", "binning_x", "binning_y", "roi")
_STAMP = slice(4, 12)  # of a serialized message with a header
_NUMBER = re.compile(r"(\d+)")


@dataclass(frozen=True)
class _Info:
    """What was heard of a camera's intrinsics.

    Attributes
    ----------
    topic : str
    frame : str
        Which the message names.
    camera : str
        Which the topic names; "" if it names none.
    image : dict
        Fields of the message; empty if it cannot be used.
    fault : str
        Why.
    """

    topic: str
    frame: str
    camera: str
    image: Fields
    fault: str = ""


@dataclass(frozen=True)
class Composed:
    """A rig as far as it is known.

    Attributes
    ----------
    payload : bytes
        A serialized ``focus_planner_msgs/msg/CameraRig``; empty while the rig is not complete.
    lacks : str
        What is missing; empty if nothing is.
    """

    payload: bytes = b""
    lacks: str = ""


class RigOfFrames:
    """Keeps what was heard of cameras' intrinsics, and puts rigs together.

    Parameters
    ----------
    wanted : CameraFrames
    frame_id : str
        The planner's frame, which is the rig's.
    note : callable
        Called with an assumption that is made, once.
    """

    def __init__(
        self, wanted: CameraFrames, frame_id: str, note: Callable[[str], object] = lambda _: None
    ) -> None:
        self._wanted = wanted
        self._frame_id = frame_id
        self._note = note
        self._noted = ""
        self._infos: dict[str, _Info] = {}
        self._last: dict[str, tuple[bytes, bytes]] = {}

    def receive_info(self, topic: str, payload: bytes) -> bool:
        """Take a serialized ``sensor_msgs/msg/CameraInfo``; return whether it says anything new."""
        content = payload[: _STAMP.start], payload[_STAMP.stop :]
        if self._last.get(topic) == content:
            return False
        self._last[topic] = content
        info = self._read(topic, payload)
        changed = self._infos.get(topic) != info
        self._infos[topic] = info
        return changed

    def compose(self, heard: HeardFrames, gone: Collection[str] = ()) -> Composed:
        """Return the rig of all cameras' frames, or what is missing for it.

        Parameters
        ----------
        heard : HeardFrames
        gone : collection of str
            Topics that nobody publishes any more: what was heard there counts if nothing else does.
        """
        try:
            frames = self._frames(heard)
            names = dict(zip(frames, self._names(frames), strict=True))
            infos = {
                frame: [each for each in found if each.topic not in gone] or found
                for frame, found in self._infos_of(frames).items()
            }
            lacks = [*self._lacking(heard, frames, infos)]
            if lacks:
                return Composed(lacks=self._told("; ".join(lacks)))
            bodies = body_frames(frames, self._wanted.convention)
            cameras = [
                self._camera(heard, frame, names[frame], infos[frame][0], is_body=frame in bodies)
                for frame in frames
            ]
        except InputError as error:
            return Composed(lacks=self._told(str(error)))
        self._note_bodies(bodies)
        fields = {"header": {"frame_id": self._frame_id}, "cameras": cameras}
        return Composed(serialize(RIG, fields))

    # --- frames --------------------------------------------------------------------------------

    def _frames(self, heard: HeardFrames) -> list[str]:
        """Return the cameras' frames: in the order of their names, whoever was heard first."""
        names = self._wanted.names
        found = {
            frame
            for frame in heard.names
            if any(fnmatchcase(frame, each) for each in self._wanted.patterns)
        }
        return [*names, *sorted(found.difference(names), key=_natural)]

    def _names(self, frames: Sequence[str]) -> list[str]:
        paths = [without_optical(frame) for frame in frames]
        return camera_names("camera_frames", paths, "rename one, or name the frames one by one")

    def _camera(
        self, heard: HeardFrames, frame: str, name: str, info: _Info, *, is_body: bool
    ) -> Fields:
        pose = heard.lookup(frame_name(self._frame_id), frame)
        assert pose is not None, frame
        at = pose @ frame_from_optical(is_body=is_body)
        pose_fields = pose_to_fields(at.position, at.orientation)
        return {"name": name, "pose": pose_fields, "camera_info": info.image}

    def _note_bodies(self, bodies: Sequence[str]) -> None:
        text = "" if self._wanted.convention or not bodies else note_on_bodies(bodies)
        if text and text != self._noted:
            self._note(f"camera_frames: {text}; set camera_convention to decide")
        self._noted = text

    # --- intrinsics ----------------------------------------------------------------------------

    def _read(self, topic: str, payload: bytes) -> _Info:
        camera, frame = self._wanted.camera_of(topic) or "", ""
        try:
            check_bytes("CameraInfo", payload, MAX_CAMERA_INFO_BYTES)
            message = deserialize(CAMERA_INFO, payload)
            frame = frame_name(message.header.frame_id)[:MAX_FRAME_NAME]
            return _Info(topic, frame, camera, _image_of(message))
        except InputError as error:
            return _Info(topic, frame, camera, {}, str(error))

    def _infos_of(self, frames: Sequence[str]) -> dict[str, list[_Info]]:
        """Return what was heard of each camera's intrinsics.

        A topic that names the camera comes first, then the frame that a message names, then
        another frame of the same camera.
        """
        by_camera, by_frame, by_device = (defaultdict[str, list[_Info]](list) for _ in range(3))
        own = set(frames)
        for topic in sorted(self._infos):
            info = self._infos[topic]
            if info.camera:
                by_camera[info.camera].append(info)
            elif info.frame in own:
                by_frame[info.frame].append(info)
            elif info.frame:
                by_device[device_of(info.frame)].append(info)
        return {
            frame: by_camera.get(name) or by_frame.get(frame) or by_device.get(device_of(frame), [])
            for frame, name in zip(frames, self._names(frames), strict=True)
        }

    # --- what is missing -----------------------------------------------------------------------

    def _told(self, lacks: str) -> str:
        return f"the rig of camera_frames ({first_few(self._wanted.frames)}): {lacks}"

    def _lacking(
        self, heard: HeardFrames, frames: Sequence[str], infos: dict[str, list[_Info]]
    ) -> Iterable[str]:
        target = frame_name(self._frame_id)
        if not frames:
            yield f"no frame has such a name{self._heard_of(heard)}"
            return
        apart = [frame for frame in frames if not _is_related(heard, target, frame)]
        if apart:
            more = f" (and {len(apart) - 1} more)" if len(apart) > 1 else ""
            yield f"no transform from {apart[0]}{more} to {target}: {heard.lack(target, apart[0])}"
        silent = [frame for frame in frames if not infos[frame]]
        if silent:
            yield f"no CameraInfo of {first_few(silent)}{self._heard_infos(frames, infos)}"
        yield from self._strangers(frames)
        for frame in frames:
            faults = [info for info in infos[frame] if info.fault]
            if faults:
                yield f"{faults[0].topic}: {faults[0].fault}"
                return
            others = [info for info in infos[frame] if info.image != infos[frame][0].image]
            if others:
                yield (
                    f"CameraInfo of {frame} is not the same on {infos[frame][0].topic} and"
                    f" {others[0].topic}: choose with camera_info_topics"
                )
                return

    def _heard_of(self, heard: HeardFrames) -> str:
        if not heard.transforms:
            return ": nothing was heard on /tf_static"
        return f", only {first_few(heard.names)}"

    def _heard_infos(self, frames: Sequence[str], infos: dict[str, list[_Info]]) -> str:
        """Return what was heard instead: what is of no camera is likelier to be a missing one's."""
        used = {info.topic: frame for frame in frames for info in infos[frame]}
        others = [info for topic, info in sorted(self._infos.items()) if topic not in used]
        if others:
            topics = [f"{each.topic} ({_whose(each)})" for each in others]
            heard = f"; heard, of others, on {first_few(topics, 3)}"
            if all(each.camera for each in others):
                return heard
            return f"{heard}: set the driver's frame_id, or name topics with camera_info_topics"
        if used:
            return f"; heard on {first_few([f'{each} ({used[each]})' for each in used], 3)}"
        if self._wanted.topics:
            return f"; none heard on camera_info_topics ({first_few(self._wanted.topics, 3)})"
        return "; none heard"

    def _strangers(self, frames: Sequence[str]) -> Iterable[str]:
        """Yield the cameras that have intrinsics, and no frame yet."""
        known = set(frames) | {device_of(frame) for frame in frames}
        absent = [
            f"{info.frame} ({info.topic})"
            for info in self._infos.values()
            if not (info.camera or known & {info.frame, device_of(info.frame)})
            if self._wanted.has(info.frame)
        ]
        if absent:
            yield f"no transform of {first_few(absent, 3)}, whose CameraInfo was heard"


def _image_of(message: Message) -> Fields:
    """Return what a ``CameraInfo`` says of the image; raise if its camera is not calibrated."""
    if not (message.width and message.height and message.k[0] > 0):
        raise InputError(
            "CameraInfo",
            "that of a calibrated camera",
            f"{message.width} × {message.height} pixels and fx {message.k[0]:g}",
            "give the camera's driver its calibration",
        )
    fields = fields_of(message)
    image = {name: fields[name] for name in _IMAGE}
    return image | {name: image[name].tolist() for name in ("d", "k")}


def _whose(info: _Info) -> str:
    return f"camera {info.camera!r}" if info.camera else f"frame {info.frame!r}"


def _is_related(heard: HeardFrames, target: str, frame: str) -> bool:
    return target == frame or heard.between(target, frame) is not None


def _natural(frame: str) -> list[tuple[bool, int, str]]:
    """Return a key that sorts cam2 before cam10."""
    parts = _NUMBER.split(frame)
    return [(part.isdecimal(), int(part[:18]) if part.isdecimal() else 0, part) for part in parts]
