# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Colours as files and messages store them, as bytes of sRGB."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from focus_planner.core.arrays import FloatArray
from focus_planner.core.surface.appearance import Colours

#: Names of red, green and blue among the numbers of a vertex, a face or a point.
NAMES = (
    ("red", "green", "blue"),
    ("r", "g", "b"),
    ("diffuse_red", "diffuse_green", "diffuse_blue"),
)


def columns_of_colour(names: Mapping[str, Any]) -> tuple[str, str, str] | None:
    """Return which of the names are red, green and blue; None if these are not all there."""
    return next((each for each in NAMES if names.keys() >= set(each)), None)


def colours_among(numbers: Mapping[str, NDArray[Any]]) -> Colours | None:
    """Return the (n, 3) colours among columns of numbers, by their names; None if there are none.

    Whole numbers of 8 and 16 bits tell their scale; of others it is guessed: see
    :func:`guessed_colours`.
    """
    names = columns_of_colour(numbers)
    if names is None:
        return None
    return colours_of(np.stack([numbers[name] for name in names], axis=1))


def colours_of(values: NDArray[Any]) -> Colours:
    """Return (n, 3) colours; see :func:`colours_among`."""
    if values.dtype == np.uint8:
        return values
    if values.dtype.kind == "u" and values.dtype.itemsize == 2 and values.max(initial=0) > 255:
        return np.asarray(values >> 8).astype(np.uint8)
    return guessed_colours(values)


def guessed_colours(values: NDArray[Any]) -> Colours:
    """Return (n, 3) colours of which nobody says whether they go to 1, to 255 or to 65,535.

    It is the least of these that none exceeds. What is no number is black.
    """
    numbers = np.nan_to_num(np.asarray(values, dtype=np.float64), nan=0.0, posinf=0.0, neginf=0.0)
    most = numbers.max(initial=0.0)
    scale = 255.0 if most <= 1 else 1.0 if most <= 255 else 1 / 257
    return _rounded(scale * numbers)


def colours_from_linear(values: NDArray[Any]) -> Colours:
    """Return colours, of any shape, of which 0 to 1 are in proportion to light."""
    light: FloatArray = np.clip(np.nan_to_num(np.asarray(values, dtype=np.float64)), 0.0, 1.0)
    curve = 1.055 * light ** (1 / 2.4) - 0.055
    return _rounded(255 * np.where(light <= 0.0031308, 12.92 * light, curve))


def linear_from_colours(colours: Colours) -> FloatArray:
    """Return colours in proportion to light, 0 to 1: the inverse of :func:`colours_from_linear`."""
    values = np.arange(256) / 255
    table = np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)
    linear: FloatArray = table[colours]
    return linear


def unpacked_colours(packed: NDArray[np.uint32]) -> Colours:
    """Return (n, 3) colours of (n,) numbers 0xAARRGGBB, as PCL and ROS pack them."""
    return np.stack([packed >> shift & 255 for shift in (16, 8, 0)], axis=1).astype(np.uint8)


def packed_colours(colours: Colours) -> NDArray[np.uint32]:
    """Return (n,) numbers 0x00RRGGBB: the inverse of :func:`unpacked_colours`."""
    red, green, blue = colours.astype(np.uint32).T
    return np.asarray(red << 16 | green << 8 | blue)


def _rounded(values: FloatArray) -> Colours:
    return np.asarray(np.clip(np.rint(values), 0, 255)).astype(np.uint8)
