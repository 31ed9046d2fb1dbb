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

from focus_planner.core.rig.frames import Similarity, similarity_from_matrix
from focus_planner.core.validation import InputError
from focus_planner.io.files import read_text
from focus_planner.io.quoting import word


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
