# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The rays whose mean a pixel is: where they pass the aperture, and where on the pixel they end."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
from numpy.typing import NDArray

from focus_planner.core.arrays import FloatArray

_GOLDEN_ANGLE = np.pi * (3 - np.sqrt(5))
# The real root of x³ = x + 1, whose powers lattices in the plane are best made of.
_PLASTIC = 1.32471795724474602596
# What a ray is to have of the variances of a pixel of side 1, and of a disc of diameter 1.
_VARIANCES = np.array([1 / 12, 1 / 12, 1 / 16, 1 / 16])
# Rays per pixel: for the sharpest, and for those of the widest blur.
_FEWEST, _MOST, _GROWTH = 8, 48, 1.3


@cache
def sets_of_aims() -> tuple[FloatArray, NDArray[np.int64]]:
    """Return sets of ever more rays, one after the other, and where each starts and the last ends.

    Returns
    -------
    aims : (S, 4) array
        See :func:`aims`.
    starts : (K + 1,) array of int
    """
    counts = [_FEWEST]
    while counts[-1] < _MOST:
        counts.append(min(int(counts[-1] * _GROWTH), _MOST))
    return np.concatenate([aims(count) for count in counts]), np.cumsum([0, *counts])


def aims(count: int) -> FloatArray:
    """Return where a pixel's rays pass an aperture of diameter 1, and where they end on the pixel.

    The former are evenly spread over a disc, along Fermat's spiral (H. Vogel, Mathematical
    Biosciences 44, 1979); the latter over the pixel, each in a column and a row of its own, as a
    lattice. All four coordinates are then made to have mean 0, exactly the variances of a disc and
    of a square, and no correlation: so the variance of a blurred edge is exactly that of the disc
    and of the pixel.

    Parameters
    ----------
    count : int
        At least 8.

    Returns
    -------
    (count, 4) array
        x, y; columns, rows.
    """
    i = np.arange(count)
    radius, angle = np.sqrt((i + 0.5) / count) / 2, i * _GOLDEN_ANGLE
    first = _coprime(count, count / _PLASTIC)
    second = _coprime(count, count / _PLASTIC**2, (first, count - first))
    beside = [i * first % count, i * second % count]
    disc = [radius * np.cos(angle), radius * np.sin(angle)]
    spread = np.column_stack([*((np.array(beside) + 0.5) / count), *disc])
    spread -= spread.mean(axis=0)
    # Each coordinate is freed of those before it: the lattice is hardly changed.
    lower = np.linalg.cholesky(spread.T @ spread / count)
    exact = np.linalg.solve(lower, spread.T).T * np.sqrt(_VARIANCES)
    rays: FloatArray = np.ascontiguousarray(exact[:, [2, 3, 0, 1]])
    return rays


def _coprime(count: int, near: float, but: tuple[int, ...] = ()) -> int:
    """Return the number nearest to ``near``, but not these, without a divisor of ``count``."""
    able = (n for n in range(1, count) if math.gcd(n, count) == 1 and n not in but)
    return min(able, key=lambda n: abs(n - near))
