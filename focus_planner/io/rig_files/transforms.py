# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Rigs from lists of transforms, as published to tf2."""

from __future__ import annotations

import re
import shlex
from collections.abc import Callable, Iterator, Sequence
from fnmatch import fnmatchcase
from os import PathLike
from pathlib import Path
from typing import Any

from focus_planner.core.rig.camera import Camera, CameraIntrinsics
from focus_planner.core.rig.defaults import keys_of
from focus_planner.core.rig.frames import (
    FrameTransform,
    FrameTree,
    quaternion_from_rpy,
    similarity_from_pose,
)
from focus_planner.core.rig.lens import Lens
from focus_planner.core.rig.rig import Rig
from focus_planner.core.text import did_you_mean
from focus_planner.core.validation import InputError, check_number, first_few
from focus_planner.io.camera_frames import (
    body_frames,
    frame_from_optical,
    is_optical,
    note_on_bodies,
    without_optical,
)
from focus_planner.io.files import read_text
from focus_planner.io.names import camera_names
from focus_planner.io.quoting import abbreviated, key_name, kind_of
from focus_planner.io.rig_files.alignment import to_metres
from focus_planner.io.rig_files.nerfstudio import nerfstudio_frames
from focus_planner.io.yaml_values import (
    errors_within,
    number,
    read_yaml_documents,
    value_at,
)

EXPECTED = "a list of transforms"
_MAX_BYTES = 16 << 20  # 100,000 transforms
_PUBLISHER = "static_transform_publisher"
_FLAGS = {
    "translation": ("--x", "--y", "--z"),
    "quaternion": ("--qx", "--qy", "--qz", "--qw"),
    "angles": ("--roll", "--pitch", "--yaw"),
    "frames": ("--frame-id", "--child-frame-id"),
}


def load_transforms(
    path: str | PathLike[str],
    *,
    root: str = "",
    cameras: str = "",
    convention: str = "",
    scale: float | None = None,
    intrinsics_of: Callable[[str], CameraIntrinsics] | None = None,
    lens: Lens | None = None,
    frame_id: str = "",
) -> tuple[Rig, list[str]]:
    """Read transforms; some of their frames become the cameras of the rig.

    Parameters
    ----------
    path : path
        ``TransformStamped`` messages as YAML or JSON: a list, or the output of ``ros2 topic echo
        /tf_static``. Or text with one transform per line: ``x y z qx qy qz qw parent child``,
        ``x y z yaw pitch roll parent child``, or the arguments of ``static_transform_publisher``;
        metres and radians.
    root : str
        The frame of the rig; by default the only frame without a parent.
    cameras : str
        A pattern for the cameras' frames, such as ``cam*_optical_frame``. By default the frames
        without children, restricted to those named like optical frames if there are any.
    convention : str
        The orientation of the cameras' frames: ``"optical"`` (z forward, x right, y down) or
        ``"body"`` (x forward, y left, z up). By default, as in REP 103, frames whose names end in
        ``_optical_frame`` or ``_optical`` are optical, others body frames.
    scale : float, optional
        Metres per unit of translation. By default 1, but cameras far apart are rejected.
    intrinsics_of : callable, optional
        A function from a camera's name to its intrinsics; by default the paper's.
    lens : Lens, optional
        Shared by all cameras.
    frame_id : str
        The frame's name in the rig; ``root`` by default.

    Returns
    -------
    rig : Rig
        Cameras in the order of their first transforms, named after their frames without
        ``_optical_frame``; see :func:`~focus_planner.io.names.camera_names`.
    notes : list of str
        Assumptions that were made.

    Raises
    ------
    InputError
        If the file cannot be read, its frames do not form a tree, or a frame does not exist.
    """
    path = Path(path)
    text = read_text(path, EXPECTED, _MAX_BYTES)
    if nerfstudio_frames(text) is not None:
        got = "frames of images, as nerfstudio has them"
        raise InputError(str(path), EXPECTED, got, "read them with focus_planner rig nerfstudio")
    notes: list[str] = []
    with errors_within(str(path)):
        tree = FrameTree(_transforms(path, text))
    root = _root(path, tree, root.lstrip("/"))
    frames = _camera_frames(path, tree, root, cameras, notes)
    names = camera_names(f"{path}: frames", [without_optical(frame) for frame in frames])
    bodies = _body_frames(frames, convention, notes)
    poses = [
        tree.lookup(root, frame) @ frame_from_optical(is_body=frame in bodies) for frame in frames
    ]
    metres = to_metres(f"{path}: translations", poses, scale)
    assumed = {} if intrinsics_of else dict.fromkeys(names, keys_of("image"))
    intrinsics_of, shared_lens = intrinsics_of or (lambda _: CameraIntrinsics()), lens or Lens()
    rig = Rig(
        tuple(
            Camera(name, at.position, at.orientation, intrinsics_of(name), shared_lens)
            for name, at in zip(names, (metres @ pose for pose in poses), strict=True)
        ),
        frame_id or root,
        assumed=assumed,
    )
    return rig, notes


# --- which frames ------------------------------------------------------------------------------


def _root(path: Path, tree: FrameTree, root: str) -> str:
    if root:
        if root not in tree:
            raise InputError(
                f"{path}: root",
                f"one of {first_few(tree.frames)}",
                repr(root),
                did_you_mean(root, tree.frames),
            )
        return root
    if len(tree.roots) > 1:
        raise InputError(
            f"{path}: frames",
            "one tree",
            f"{len(tree.roots)}, with the roots {first_few(tree.roots)}",
            "add the transform between them, or select one with --root",
        )
    return tree.roots[0]


def _camera_frames(
    path: Path, tree: FrameTree, root: str, pattern: str, notes: list[str]
) -> list[str]:
    if not pattern:
        return _optical_leaves(path, tree, root, notes)
    chosen = [frame for frame in tree.frames if fnmatchcase(frame, pattern.lstrip("/"))]
    apart = [frame for frame in chosen if tree.root_of(frame) != tree.root_of(root)]
    if apart:
        raise InputError(
            f"{path}: frame {apart[0]}",
            f"a frame of the tree below {root}",
            f"one below {tree.root_of(apart[0])}",
        )
    if not chosen:
        raise InputError(
            f"{path}: cameras", f"frames that match {pattern}", f"only {first_few(tree.frames)}"
        )
    return chosen


def _optical_leaves(path: Path, tree: FrameTree, root: str, notes: list[str]) -> list[str]:
    leaves = [frame for frame in tree.leaves if frame != root]
    joined = [frame for frame in leaves if tree.root_of(frame) == tree.root_of(root)]
    chosen = [frame for frame in joined if is_optical(frame)] or joined
    if not chosen:
        raise InputError(f"{path}: root {root}", "cameras in its tree", "none")
    left = [frame for frame in leaves if frame not in set(chosen)]
    if left:
        notes.append(
            f"not used as cameras: {first_few(left)}; select the cameras' frames with --cameras"
        )
    return chosen


def _body_frames(frames: Sequence[str], convention: str, notes: list[str]) -> set[str]:
    """Return those of the frames that are body frames."""
    bodies = body_frames(frames, convention)
    if bodies and not convention:
        notes.append(f"{note_on_bodies(bodies)}; set --convention to decide")
    return set(bodies)


# --- the file ----------------------------------------------------------------------------------


def _transforms(path: Path, text: str) -> list[FrameTransform]:
    lines = [
        (f"{path}: line {i}", line.strip())
        for i, line in enumerate(text.splitlines(), start=1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if lines and _is_command(lines[0][1]):
        return [_transform_of_line(where, line) for where, line in lines]
    entries = _entries(path, read_yaml_documents(str(path), text))
    transforms = [
        _transform_of_message(f"{path}: transforms[{i}]", entry) for i, entry in enumerate(entries)
    ]
    if not transforms:
        raise InputError(str(path), EXPECTED, "none")
    return transforms


def _is_command(line: str) -> bool:
    """Return whether a file that starts with this line has one transform per line, unlike YAML."""
    return _PUBLISHER in line or re.match(r"--[a-z]|[-+]?[.\d][-+.e\d]*\s", line) is not None


def _entries(path: Path, documents: Sequence[Any]) -> Iterator[Any]:
    for document in documents:
        messages = document
        if isinstance(document, dict):
            messages = document.get("transforms", [document])
        if messages is None:  # after the last ---
            continue
        if not isinstance(messages, list):
            raise InputError(f"{path}: transforms", EXPECTED, kind_of(messages))
        yield from messages


def _transform_of_message(where: str, data: Any) -> FrameTransform:
    translation, rotation = (
        [
            number(
                f"{where}.transform.{part}.{axis}", value_at(where, data, "transform", part, axis)
            )
            for axis in axes
        ]
        for part, axes in (("translation", "xyz"), ("rotation", "xyzw"))
    )
    return FrameTransform(
        _frame(where, value_at(where, data, "header", "frame_id")),
        _frame(where, value_at(where, data, "child_frame_id")),
        similarity_from_pose(where, translation, rotation),
    )


def _frame(where: str, name: Any) -> str:
    if not isinstance(name, str) or not name.lstrip("/"):
        raise InputError(where, "a frame's name", abbreviated(name))
    return name.lstrip("/")


def _transform_of_line(where: str, line: str) -> FrameTransform:
    words = _arguments(where, line)
    if any(word.startswith("--") for word in words):
        return _transform_of_flags(where, words)
    *numbers, parent, child = words if len(words) in (8, 9) else ["", ""]
    if not numbers:
        raise InputError(
            where,
            "x y z qx qy qz qw parent child, or x y z yaw pitch roll parent child",
            f"{len(words)} words",
        )
    x, y, z, *rotation = (check_number(where, number(where, value)) for value in numbers)
    if len(rotation) == 3:
        rotation = list(quaternion_from_rpy(*reversed(rotation)))
    return FrameTransform(
        _frame(where, parent),
        _frame(where, child),
        similarity_from_pose(where, (x, y, z), rotation),
    )


def _arguments(where: str, line: str) -> list[str]:
    """Return the words of a line without the command that they are arguments of."""
    try:
        words = shlex.split(line, comments=True)
    except ValueError as error:
        raise InputError(where, "words", str(error).lower()) from None
    ends = [i for i, word in enumerate(words) if word.endswith(_PUBLISHER)]
    words = words[ends[-1] + 1 :] if ends else words
    return words[: words.index("&")] if "&" in words else words


def _transform_of_flags(where: str, words: Sequence[str]) -> FrameTransform:
    given = _flags(where, words)

    def values(kind: str) -> list[float]:
        return [
            check_number(where, number(where, given.get(flag, float(flag == "--qw"))))
            for flag in _FLAGS[kind]
        ]

    by_angles = any(flag in given for flag in _FLAGS["angles"])
    if by_angles and any(flag in given for flag in _FLAGS["quaternion"]):
        raise InputError(where, "either a quaternion or roll, pitch and yaw", "both")
    rotation = quaternion_from_rpy(*values("angles")) if by_angles else values("quaternion")
    parent, child = (_frame(where, given.get(flag)) for flag in _FLAGS["frames"])
    return FrameTransform(
        parent, child, similarity_from_pose(where, values("translation"), rotation)
    )


def _flags(where: str, words: Sequence[str]) -> dict[str, str]:
    known = [flag for flags in _FLAGS.values() for flag in flags]
    given = dict(zip(words[::2], words[1::2], strict=False))
    if not given.keys() <= set(known) or 2 * len(given) != len(words):
        others = [key_name(word.lstrip("-")) for word in given if word not in known]
        got = f"also {first_few(others)}" if others else f"{len(words)} words"
        raise InputError(where, f"a value after each of {' '.join(known)}", got)
    return given
