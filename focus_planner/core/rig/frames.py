"""Transforms between frames, and trees of frames.

A transform ``a_from_b`` takes points of frame b to frame a; ``a_from_b @ b_from_c`` is
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
from focus_planner.core.validation import InputError, check_array, check_finite

_TOLERANCE = 1e-3  # of lengths that are to be 1, as for the orientation of a camera
_SAME = 1e-9


@dataclass(frozen=True, eq=False)
class Similarity:
    """A change of frame: p ↦ scale · R p + t.

    Attributes
    ----------
    rotation : scipy.spatial.transform.Rotation
        R.
    translation : (3,) array
        t, in the unit of the frame that points are taken to.
    scale : float
        How many units of the frame that points are taken to make one of theirs; above 0.
    """

    rotation: Rotation = field(default_factory=Rotation.identity)
    translation: FloatArray = field(default_factory=lambda: np.zeros(3))
    scale: float = 1.0

    def __matmul__(self, other: Similarity) -> Similarity:
        """Return the change of frame by ``other``, then by this."""
        moved = self.scale * self.rotation.apply(other.translation) + self.translation
        return Similarity(self.rotation * other.rotation, moved, self.scale * other.scale)

    def inverse(self) -> Similarity:
        """Return the way back."""
        rotation = self.rotation.inv()
        return Similarity(rotation, -rotation.apply(self.translation) / self.scale, 1 / self.scale)

    @property
    def position(self) -> tuple[float, float, float]:
        """Where the origin of the one frame is in the other."""
        x, y, z = (float(value) + 0.0 for value in self.translation)  # + 0.0: no −0
        return x, y, z

    @property
    def orientation(self) -> tuple[float, float, float, float]:
        """The axes of the one frame in the other, as a unit quaternion x, y, z, w."""
        x, y, z, w = (float(value) + 0.0 for value in self.rotation.as_quat())
        return x, y, z, w


#: REP 103: the body frame's x points forward, y left, z up; the optical frame's z, −x, −y.
BODY_FROM_OPTICAL = Similarity(Rotation.from_quat([-0.5, 0.5, -0.5, 0.5]))


def pose(argument: str, translation: ArrayLike, quaternion: ArrayLike) -> Similarity:
    """Return the transform of a translation and a unit quaternion x, y, z, w.

    Parameters
    ----------
    argument : str
        What the pose is called in errors.
    translation : (3,) array
    quaternion : (4,) array

    Raises
    ------
    InputError
        If a number is not finite, or the quaternion's length is not 1, to a thousandth.
    """
    moved = check_array(f"{argument}: translation", translation, (3,))
    check_finite(f"{argument}: translation", moved, "number")
    turned = check_array(f"{argument}: rotation", quaternion, (4,))
    length = math.hypot(*turned)
    if not abs(length - 1) <= _TOLERANCE:
        raise InputError(
            f"{argument}: rotation",
            "a unit quaternion x, y, z, w",
            f"{tuple(turned.tolist())} of length {length:g}",
        )
    return Similarity(Rotation.from_quat(turned), moved.copy())  # SciPy turns what it may write to


def quaternion_from_angles(roll: float, pitch: float, yaw: float) -> tuple[float, ...]:
    """Return x, y, z, w of turns about the fixed x, y and z axes, in that order, radians.

    The same as tf2's ``setRPY``.
    """
    x, y, z, w = Rotation.from_euler("xyz", [roll, pitch, yaw]).as_quat()
    return float(x), float(y), float(z), float(w)


def similarity_from_matrix(argument: str, matrix: ArrayLike) -> Similarity:
    """Return the transform of a 4 × 4 matrix (s·R, t; 0 0 0 1).

    Parameters
    ----------
    argument : str
        What the matrix is called in errors.
    matrix : (4, 4) array

    Raises
    ------
    InputError
        If it does more, or less, than to turn, move and scale, to a thousandth.
    """
    values = check_array(argument, matrix, (4, 4))
    check_finite(argument, values, "row")
    if not np.array_equal(values[3], [0, 0, 0, 1]):
        got = " ".join(f"{value:g}" for value in values[3])
        raise InputError(argument, "the last row 0 0 0 1", got, "write the numbers row by row")
    with np.errstate(over="ignore", under="ignore"):
        scale = float(np.cbrt(np.linalg.det(values[:3, :3])))
    _check_turns(argument, values[:3, :3], scale)
    return Similarity(Rotation.from_matrix(values[:3, :3] / scale), values[:3, 3].copy(), scale)


def _check_turns(argument: str, matrix: FloatArray, scale: float) -> None:
    expected = "a rotation, times a scale above 0, as its first three columns and rows"
    if scale < 0:
        raise InputError(argument, expected, "one that mirrors")
    turn = matrix / scale if 0 < scale < math.inf else np.zeros((3, 3))
    if not (np.abs(turn @ turn.T - np.eye(3)) <= _TOLERANCE).all():
        raise InputError(argument, expected, "one that shears or flattens")


class FrameTransform(NamedTuple):
    """Where a frame is in its parent."""

    parent: str
    child: str
    parent_from_child: Similarity


class FrameTree:
    """Frames, each but the roots with its place in a parent.

    Parameters
    ----------
    transforms : iterable of FrameTransform
        A child may occur twice if both say the same, as in a repeated message.

    Raises
    ------
    InputError
        If a frame has two parents or two places, or is its own ancestor.
    """

    def __init__(self, transforms: Iterable[FrameTransform]) -> None:
        self._above: dict[str, FrameTransform] = {}
        self._frames: dict[str, None] = {}  # a set in the order of the list
        for transform in transforms:
            self._add(transform)
        for frame in self._above:
            self._check_ends(frame)

    def __contains__(self, frame: str) -> bool:
        """Whether there is such a frame."""
        return frame in self._frames

    @property
    def frames(self) -> list[str]:
        """All frames, in the order of the list."""
        return list(self._frames)

    @property
    def roots(self) -> list[str]:
        """Frames without a parent, in the order of the list."""
        return [frame for frame in self._frames if frame not in self._above]

    @property
    def leaves(self) -> list[str]:
        """Frames without a child, in the order of the list."""
        inner = {transform.parent for transform in self._above.values()}
        return [frame for frame in self._frames if frame not in inner]

    def root_of(self, frame: str) -> str:
        """Return the last of a frame's ancestors, itself if it has none."""
        *_, last = (frame, *(transform.parent for transform in self._up(frame)))
        return last

    def lookup(self, target: str, source: str) -> Similarity:
        """Return ``target_from_source``, of two frames of one tree."""
        assert self.root_of(target) == self.root_of(source)
        return self._root_from(target).inverse() @ self._root_from(source)

    def _root_from(self, frame: str) -> Similarity:
        root_from_frame = Similarity()
        for transform in self._up(frame):
            root_from_frame = transform.parent_from_child @ root_from_frame
        return root_from_frame

    def _up(self, frame: str) -> Iterator[FrameTransform]:
        while frame in self._above:
            yield self._above[frame]
            frame = self._above[frame].parent

    def _add(self, new: FrameTransform) -> None:
        known = self._above.get(new.child, new)
        if known.parent != new.parent:
            raise InputError(
                f"frame {new.child}", "one parent", f"two: {known.parent} and {new.parent}"
            )
        if not _are_same(known.parent_from_child, new.parent_from_child):
            raise InputError(
                f"frame {new.child}",
                f"one place in {new.parent}",
                "two that differ",
                "leave only the one that holds",
            )
        self._above[new.child] = new
        self._frames |= {new.parent: None, new.child: None}

    def _check_ends(self, frame: str) -> None:
        seen = [frame]
        for transform in self._up(frame):
            seen.append(transform.parent)
            if transform.parent == frame:
                raise InputError(f"frame {frame}", "a tree", f"a cycle: {' → '.join(seen)}")
            if len(seen) > len(self._frames):  # into a cycle that it is not in itself
                return


def _are_same(one: Similarity, other: Similarity) -> bool:
    return bool(
        np.abs(one.translation - other.translation).max() <= _SAME
        and (one.rotation.inv() * other.rotation).magnitude() <= _SAME
    )
