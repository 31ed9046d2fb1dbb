# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Transforms between frames, and trees of frames.

A transform ``a_from_b`` maps coordinates in frame b to frame a; ``a_from_b @ b_from_c`` is
``a_from_c``. The pose of a camera in a rig is ``rig_from_camera``.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from focus_planner.core.arrays import FloatArray
from focus_planner.core.validation import (
    MAX_FRAME_DEPTH,
    InputError,
    check_array,
    check_finite,
)

_TOLERANCE = 1e-3  # of what should be 1, as for a camera's orientation
_SAME_PLACE = 1e-9  # metres, and radians
# Of any unit of length: beyond it squares are of no use, and products overflow.
_LARGEST = 1e50


@dataclass(frozen=True, eq=False)
class Similarity:
    """A similarity transform ``target_from_source``: p ↦ scale · R p + t.

    Attributes
    ----------
    rotation : scipy.spatial.transform.Rotation
        R.
    translation : (3,) array
        t, in the target frame's unit of length.
    scale : float
        The source frame's unit of length in the target frame's; above 0.
    """

    rotation: Rotation = field(default_factory=Rotation.identity)
    translation: FloatArray = field(default_factory=lambda: np.zeros(3))
    scale: float = 1.0

    def __matmul__(self, other: Similarity) -> Similarity:
        """Return the composition: ``other`` first, then this."""
        with np.errstate(over="ignore", invalid="ignore"):  # a camera there is refused
            moved = self.scale * self.rotation.apply(other.translation) + self.translation
        return Similarity(self.rotation * other.rotation, moved, self.scale * other.scale)

    def inverse(self) -> Similarity:
        """Return ``source_from_target``."""
        rotation = self.rotation.inv()
        return Similarity(rotation, -rotation.apply(self.translation) / self.scale, 1 / self.scale)

    def points(self, points: FloatArray) -> FloatArray:
        """Return (N, 3) points of the source frame in the target frame.

        Every sum has a fixed order, so that all machines agree to the bit.
        """
        with np.errstate(over="ignore", invalid="ignore"):  # points there are refused
            return self.scale * self.directions(points) + self.translation

    def directions(self, vectors: FloatArray) -> FloatArray:
        """Return (N, 3) vectors of the source frame in the target frame, turned only."""
        x, y, z = vectors.T
        with np.errstate(over="ignore", invalid="ignore"):
            return np.stack([a * x + b * y + c * z for a, b, c in self.rotation.as_matrix()], 1)

    @property
    def position(self) -> tuple[float, float, float]:
        """The source frame's origin in the target frame."""
        x, y, z = (float(value) + 0.0 for value in self.translation)  # + 0.0: no −0
        return x, y, z

    @property
    def orientation(self) -> tuple[float, float, float, float]:
        """The source frame's orientation in the target frame, as a unit quaternion x, y, z, w."""
        x, y, z, w = (float(value) + 0.0 for value in self.rotation.as_quat())
        return x, y, z, w


#: REP 103: body frames are x forward, y left, z up; optical frames z forward, x right, y down.
BODY_FROM_OPTICAL = Similarity(Rotation.from_quat([-0.5, 0.5, -0.5, 0.5]))
#: Cameras of OpenGL and of photogrammetry are x right, y up, z back.
OPENGL_FROM_OPTICAL = Similarity(Rotation.from_quat([1.0, 0.0, 0.0, 0.0]))


def similarity_from_pose(
    argument: str, translation: ArrayLike, quaternion: ArrayLike
) -> Similarity:
    """Return the transform with this translation and this unit quaternion x, y, z, w.

    Parameters
    ----------
    argument : str
        The pose's name in errors.
    translation : (3,) array
    quaternion : (4,) array

    Raises
    ------
    InputError
        If a number is not finite, or the quaternion's norm differs from 1 by more than 0.001.
    """
    t = check_array(f"{argument}: translation", translation, (3,))
    _check_lengths(f"{argument}: translation", t)
    q = check_array(f"{argument}: rotation", quaternion, (4,))
    norm = math.hypot(*q)
    if not abs(norm - 1) <= _TOLERANCE:
        raise InputError(
            f"{argument}: rotation",
            "a unit quaternion x, y, z, w",
            f"{tuple(q.tolist())} of norm {norm:g}",
        )
    return Similarity(Rotation.from_quat(q), t.copy())  # SciPy wants writeable arrays


def quaternion_from_rpy(roll: float, pitch: float, yaw: float) -> tuple[float, ...]:
    """Return x, y, z, w of rotations about the fixed x, y and z axes, in that order, radians.

    Equivalent to tf2's ``setRPY``.
    """
    x, y, z, w = Rotation.from_euler("xyz", [roll, pitch, yaw]).as_quat()
    return float(x), float(y), float(z), float(w)


def similarity_from_matrix(argument: str, matrix: ArrayLike) -> Similarity:
    """Return the transform of a 4 × 4 matrix (s·R, t; 0 0 0 1).

    Parameters
    ----------
    argument : str
        The matrix's name in errors.
    matrix : (4, 4) array

    Raises
    ------
    InputError
        If the matrix is not a similarity, within a tolerance of 0.001: it mirrors, shears or
        flattens.
    """
    values = check_array(argument, matrix, (4, 4))
    _check_lengths(argument, values)
    if not np.array_equal(values[3], [0, 0, 0, 1]):
        got = " ".join(f"{value:g}" for value in values[3])
        raise InputError(argument, "the last row 0 0 0 1", got, "write the numbers row by row")
    with np.errstate(over="ignore", under="ignore"):
        scale = float(np.cbrt(np.linalg.det(values[:3, :3])))
    _check_rotation(argument, values[:3, :3], scale)
    return Similarity(Rotation.from_matrix(values[:3, :3] / scale), values[:3, 3].copy(), scale)


def _check_lengths(argument: str, values: FloatArray) -> None:
    """Raise unless numbers are finite, and products of some of them too."""
    check_finite(argument, values, "row" if values.ndim > 1 else "number")
    if np.abs(values).max() > _LARGEST:
        raise InputError(argument, f"numbers up to {_LARGEST:g}", f"{np.abs(values).max():g}")


def _check_rotation(argument: str, matrix: FloatArray, scale: float) -> None:
    expected = "a rotation times a positive scale as the upper left 3 × 3 block"
    if scale < 0:
        raise InputError(argument, expected, "one that mirrors")
    rotation = matrix / scale if scale > 1 / _LARGEST else np.zeros((3, 3))
    if not (np.abs(rotation @ rotation.T - np.eye(3)) <= _TOLERANCE).all():
        raise InputError(argument, expected, "one that shears or flattens")


class FrameTransform(NamedTuple):
    """The pose of a frame in its parent."""

    parent: str
    child: str
    parent_from_child: Similarity


class FrameTree:
    """Frames, each with its pose in a parent, except for the roots.

    Parameters
    ----------
    transforms : iterable of FrameTransform
        A child may occur more than once with the same pose, as in repeated messages.

    Raises
    ------
    InputError
        If a frame has two parents or two poses, or is its own ancestor.
    """

    def __init__(self, transforms: Iterable[FrameTransform]) -> None:
        self._to_parent: dict[str, FrameTransform] = {}
        self._frames: dict[str, None] = {}  # an ordered set
        for transform in transforms:
            self._add(transform)
        for frame in self._to_parent:
            self._check_acyclic(frame)

    def __contains__(self, frame: str) -> bool:
        """Return whether the tree has this frame."""
        return frame in self._frames

    @property
    def frames(self) -> list[str]:
        """All frames, in the order in which they were first named."""
        return list(self._frames)

    @property
    def roots(self) -> list[str]:
        """Frames without a parent, in the order of :attr:`frames`."""
        return [frame for frame in self._frames if frame not in self._to_parent]

    @property
    def leaves(self) -> list[str]:
        """Frames without a child, in the order of :attr:`frames`."""
        inner = {transform.parent for transform in self._to_parent.values()}
        return [frame for frame in self._frames if frame not in inner]

    def root_of(self, frame: str) -> str:
        """Return the root of the tree that the frame is in, possibly itself."""
        *_, last = (frame, *(transform.parent for transform in self._ancestors(frame)))
        return last

    def lookup(self, target: str, source: str) -> Similarity:
        """Return ``target_from_source`` for two frames with the same root."""
        assert self.root_of(target) == self.root_of(source)
        return self._root_from(target).inverse() @ self._root_from(source)

    def _root_from(self, frame: str) -> Similarity:
        root_from_frame = Similarity()
        for transform in self._ancestors(frame):
            root_from_frame = transform.parent_from_child @ root_from_frame
        return root_from_frame

    def _ancestors(self, frame: str) -> Iterator[FrameTransform]:
        while frame in self._to_parent:
            yield self._to_parent[frame]
            frame = self._to_parent[frame].parent

    def _add(self, new: FrameTransform) -> None:
        known = self._to_parent.get(new.child, new)
        if known.parent != new.parent:
            raise InputError(
                f"frame {new.child}", "one parent", f"two: {known.parent} and {new.parent}"
            )
        if not _agree(known.parent_from_child, new.parent_from_child):
            raise InputError(
                f"frame {new.child}",
                f"one pose in {new.parent}",
                "two that differ",
                "keep only the one that is valid",
            )
        self._to_parent[new.child] = new
        self._frames |= {new.parent: None, new.child: None}

    def _check_acyclic(self, frame: str) -> None:
        seen = [frame]
        for transform in self._ancestors(frame):
            seen.append(transform.parent)
            if transform.parent == frame:
                raise InputError(f"frame {frame}", "a tree", f"a cycle: {' → '.join(seen)}")
            if len(seen) > MAX_FRAME_DEPTH + 1:
                if len(set(seen)) == len(seen):
                    expected = f"at most {MAX_FRAME_DEPTH} frames above it"
                    raise InputError(f"frame {frame}", expected, "more")
                return  # a cycle further up: its own frames report it


def _agree(one: Similarity, other: Similarity) -> bool:
    return bool(
        np.abs(one.translation - other.translation).max() <= _SAME_PLACE
        and (one.rotation.inv() * other.rotation).magnitude() <= _SAME_PLACE
    )
