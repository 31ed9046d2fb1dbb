# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from focus_planner.core.rig.frames import (
    BODY_FROM_OPTICAL,
    FrameTransform,
    FrameTree,
    Similarity,
    quaternion_from_rpy,
    similarity_from_matrix,
    similarity_from_pose,
)
from focus_planner.core.rig.geometry import rotation_from_quaternion
from focus_planner.core.validation import InputError

TURNS = (
    st.tuples(*[st.floats(-1, 1)] * 4)
    .filter(lambda q: math.hypot(*q) > 0.1)
    .map(lambda q: tuple(x / math.hypot(*q) for x in q))
)
PLACES = st.tuples(*[st.floats(-10, 10)] * 3)


def matrix(similarity: Similarity) -> np.ndarray[Any, Any]:
    """Return the 4 × 4 matrix, by the planner's own rotations instead of SciPy's."""
    whole = np.eye(4)
    turn = rotation_from_quaternion(np.array(similarity.orientation))
    whole[:3, :3] = similarity.scale * turn
    whole[:3, 3] = similarity.translation
    return whole


def similarities() -> st.SearchStrategy[Similarity]:
    return st.builds(
        lambda place, turn, scale: Similarity(scale=scale) @ similarity_from_pose("", place, turn),
        *(PLACES, TURNS, st.floats(0.1, 10)),
    )


@given(one=similarities(), other=similarities())
def test_changes_of_frame_are_matrices(one: Similarity, other: Similarity) -> None:
    np.testing.assert_allclose(matrix(one @ other), matrix(one) @ matrix(other), atol=1e-9)
    np.testing.assert_allclose(matrix(one.inverse()), np.linalg.inv(matrix(one)), atol=1e-9)
    np.testing.assert_allclose(matrix(one @ one.inverse()), np.eye(4), atol=1e-9)


@given(one=similarities())
def test_a_matrix_comes_back(one: Similarity) -> None:
    again = similarity_from_matrix("m", matrix(one))
    np.testing.assert_allclose(matrix(again), matrix(one), rtol=1e-9, atol=1e-9)
    assert again.scale == pytest.approx(one.scale, rel=1e-12)


@given(roll=st.floats(-3, 3), pitch=st.floats(-3, 3), yaw=st.floats(-3, 3))
def test_angles_turn_about_fixed_axes(roll: float, pitch: float, yaw: float) -> None:
    c, s = np.cos([roll, pitch, yaw]), np.sin([roll, pitch, yaw])
    about_x = np.array([[1, 0, 0], [0, c[0], -s[0]], [0, s[0], c[0]]])
    about_y = np.array([[c[1], 0, s[1]], [0, 1, 0], [-s[1], 0, c[1]]])
    about_z = np.array([[c[2], -s[2], 0], [s[2], c[2], 0], [0, 0, 1]])
    turn = rotation_from_quaternion(np.array(quaternion_from_rpy(roll, pitch, yaw)))
    np.testing.assert_allclose(turn, about_z @ about_y @ about_x, atol=1e-12)


def test_a_body_frame_looks_along_x() -> None:
    turn = rotation_from_quaternion(np.array(BODY_FROM_OPTICAL.orientation))
    np.testing.assert_allclose(turn, np.array([[0, 0, 1], [-1, 0, 0], [0, -1, 0]]), atol=1e-15)


@pytest.mark.parametrize(
    ("translation", "quaternion", "telling"),
    [
        ((0, 0, math.nan), (0, 0, 0, 1), "cam: translation: expected finite numbers"),
        ((0, 0), (0, 0, 0, 1), "cam: translation: expected shape (3), got shape (2,)"),
        ((0, 0, 0), (0, 0, 1, 1), "cam: rotation: expected a unit quaternion x, y, z, w, got"),
        ((0, 0, 0), (0, 0, 0, 0), "of norm 0"),
        ((0, 0, 0), (0, 0, 0, math.nan), "of norm nan"),
    ],
)
def test_what_is_no_pose_is_refused(translation: Any, quaternion: Any, telling: str) -> None:
    with pytest.raises(InputError, match=re.escape(telling)):
        similarity_from_pose("cam", translation, quaternion)


@pytest.mark.parametrize(
    ("changes", "telling"),
    [
        (
            {(3, 0): 1},
            "m: expected the last row 0 0 0 1, got 1 0 0 1; write the numbers row by row",
        ),
        ({(0, 0): -1}, "got one that mirrors"),
        ({(0, 0): 0}, "got one that shears or flattens"),
        ({(0, 1): 0.01}, "got one that shears or flattens"),
        ({(0, 0): 1.01}, "got one that shears or flattens"),
        ({(0, 0): 1e40, (1, 1): 1e40}, "got one that shears or flattens"),
        ({(0, 0): 1e200, (1, 1): 1e200}, "m: expected numbers up to 1e+50, got 1e+200"),
        ({(0, 3): math.inf}, "m: expected finite numbers, got NaN or infinity in 1 of 4"),
    ],
)
def test_what_is_no_similarity_is_refused(changes: Any, telling: str) -> None:
    values = np.eye(4)
    for place, value in changes.items():
        values[place] = value
    with pytest.raises(InputError, match=re.escape(telling)):
        similarity_from_matrix("m", values)


# --- trees -------------------------------------------------------------------------------------


def at(parent: str, child: str, *place: float) -> FrameTransform:
    return FrameTransform(parent, child, similarity_from_pose("", place or (0, 0, 0), (0, 0, 0, 1)))


def test_a_tree_knows_its_ends() -> None:
    tree = FrameTree([at("rig", "a"), at("world", "rig"), at("rig", "b"), at("moon", "c")])
    assert tree.frames == ["rig", "a", "world", "b", "moon", "c"]
    assert tree.roots == ["world", "moon"]
    assert tree.leaves == ["a", "b", "c"]
    assert (tree.root_of("a"), tree.root_of("world"), tree.root_of("c")) == (
        *("world", "world", "moon"),
    )
    assert "a" in tree
    assert "d" not in tree


@given(links=st.lists(st.tuples(PLACES, TURNS), min_size=3, max_size=6))
def test_chains_are_products_of_matrices(links: Any) -> None:
    poses = [similarity_from_pose("", *link) for link in links]
    tree = FrameTree(
        [FrameTransform(f"f{i}", f"f{i + 1}", link) for i, link in enumerate(poses)][::-1]
        + [FrameTransform("f1", "aside", poses[0])]
    )
    whole = np.eye(4)
    for link in poses:
        whole = whole @ matrix(link)
    end = f"f{len(poses)}"
    np.testing.assert_allclose(matrix(tree.lookup("f0", end)), whole, atol=1e-9)
    np.testing.assert_allclose(matrix(tree.lookup(end, "f0")), np.linalg.inv(whole), atol=1e-9)
    aside = np.linalg.inv(matrix(poses[0])) @ np.linalg.inv(matrix(poses[0])) @ whole
    np.testing.assert_allclose(matrix(tree.lookup("aside", end)), aside, atol=1e-9)


def test_a_transform_may_be_said_twice() -> None:
    assert FrameTree([at("a", "b", 1, 2, 3), at("a", "b", 1, 2, 3)]).leaves == ["b"]


@pytest.mark.parametrize(
    ("transforms", "telling"),
    [
        ([at("a", "c"), at("b", "c")], "frame c: expected one parent, got two: a and b"),
        (
            [at("a", "c"), at("a", "c", 0, 0, 1)],
            "frame c: expected one pose in a, got two that differ; keep only the one that is valid",
        ),
        ([at("a", "a")], "frame a: expected a tree, got a cycle: a → a"),
        (
            [at("b", "leaf"), at("a", "b"), at("b", "a")],
            "frame b: expected a tree, got a cycle: b → a → b",
        ),
    ],
)
def test_what_is_no_tree_is_refused(transforms: Any, telling: str) -> None:
    with pytest.raises(InputError, match=re.escape(telling)):
        FrameTree(transforms)
