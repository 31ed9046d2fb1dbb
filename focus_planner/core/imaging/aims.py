"""The rays whose mean a pixel is: where they pass the aperture, and where on the pixel they end."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from focus_planner.core.arrays import FloatArray

_GOLDEN_ANGLE = np.pi * (3 - np.sqrt(5))
# Multipliers of the R2 sequence: powers of the inverse of the real root of x³ = x + 1.
_PLASTIC = 1.32471795724474602596
# What a ray is to have of the variances of a disc of diameter 1, and of a pixel of side 1.
_VARIANCES = np.array([1 / 16, 1 / 16, 1 / 12, 1 / 12])


# Rays per pixel: for the sharpest, and for those of the widest blur.
_FEWEST, _MOST, _GROWTH = 8, 512, 1.5


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
    Biosciences 44, 1979); the latter over the pixel, by M. Roberts's R2 sequence. All four
    coordinates are then made to have mean 0, exactly the variances of a disc and of a square, and
    no correlation: so the variance of a blurred edge is exactly that of the disc and of the pixel.

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
    beside = (0.5 + i[:, None] / np.array([_PLASTIC, _PLASTIC**2])) % 1 - 0.5
    spread = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), beside])
    spread -= spread.mean(axis=0)
    lower = np.linalg.cholesky(spread.T @ spread / count)
    exact: FloatArray = np.linalg.solve(lower, spread.T).T * np.sqrt(_VARIANCES)
    return exact
