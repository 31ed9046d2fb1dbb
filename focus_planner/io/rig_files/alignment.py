# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Transforms between the frame of a rig's file and the rig's, as text files of numbers."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from focus_planner.core.rig.frames import Similarity, similarity_from_matrix
from focus_planner.core.validation import InputError, check_number
from focus_planner.io.files import read_text
from focus_planner.io.quoting import word

_MAX_SPAN = 100.0  # metres between cameras that need no --scale


def load_alignment(path: Path) -> Similarity:
    """Read ``rig_from_model``, a 4 × 4 matrix: 16 numbers, row by row.

    Raises
    ------
    InputError
        If there are not 16 numbers, or they do not form a similarity transform.
    """
    expected = "16 numbers, a 4 × 4 matrix row by row"
    words = re.split(r"[\s,;]+", read_text(path, expected).strip())
    if len(words) != 16:
        raise InputError(str(path), expected, f"{len(words)}")
    numbers = finite_numbers(str(path), words)
    return similarity_from_matrix(str(path), [numbers[i : i + 4] for i in range(0, 16, 4)])


def to_metres(where: str, poses: Sequence[Similarity], scale: float | None) -> Similarity:
    """Return the transform that makes metres of the unit of poses.

    Parameters
    ----------
    where : str
        What has the unit, for errors.
    poses : sequence of Similarity
    scale : float, optional
        Metres per unit, if it is known; else 1.

    Raises
    ------
    InputError
        If the scale is not above 0, or cameras would be too far apart for a scale that nobody gave.
    """
    if scale is not None:
        return Similarity(scale=check_number("--scale", scale, above=0))
    span = float(np.ptp([pose.translation for pose in poses], axis=0).max())
    if span > _MAX_SPAN:
        raise InputError(
            where,
            f"metres, cameras at most {_MAX_SPAN:g} m apart",
            f"{span:g} m",
            "give --scale 0.001 if they are millimetres, --scale 1 if they are metres",
        )
    return Similarity()


def finite_numbers(where: str, words: Sequence[str]) -> list[float]:
    """Return the numbers that words are.

    Raises
    ------
    InputError
        If one is none, or not finite.
    """
    values = [_number(where, text) for text in words]
    if not all(map(math.isfinite, values)):
        raise InputError(where, "finite numbers", " ".join(f"{value:g}" for value in values))
    return values


def _number(where: str, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise InputError(where, "numbers", word(text)) from None
