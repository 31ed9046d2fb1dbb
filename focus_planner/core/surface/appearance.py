# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What a surface looks like: colours of its vertices or points, or a texture."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from focus_planner.core.arrays import FloatArray
from focus_planner.core.brief import brief_repr
from focus_planner.core.validation import InputError, check_array, check_finite

#: Red, green and blue, 0 to 255, as sRGB.
Colours = NDArray[np.uint8]

# Numbers to encode at a time.
_BAND = 1_000_000


@dataclass(frozen=True, eq=False)
class Texture:
    """An image that is wrapped around a mesh.

    Parameters
    ----------
    image : (H, W, 3) array of uint8
        Red, green and blue, as sRGB; the first row is the top.
    coordinates : (T, 3, 2) array
        Of each triangle's corners: u from the image's left, v from its bottom edge, each 1 at the
        other edge. Beyond 0 to 1 the image repeats.

    Raises
    ------
    InputError
        If the image is empty or a coordinate is not finite.
    """

    image: Colours
    coordinates: NDArray[np.float32]

    __repr__ = brief_repr

    def __post_init__(self) -> None:
        image = check_array("texture image", self.image, (None, None, 3), np.uint8)
        if not image.size:
            raise InputError("texture image", "at least one pixel", "none")
        name = "texture coordinates"
        coordinates = check_array(name, self.coordinates, (None, 3, 2), np.float32)
        check_finite(name, coordinates.reshape(-1, 2), "corner")
        object.__setattr__(self, "image", image)
        object.__setattr__(self, "coordinates", coordinates)

    def take(self, which: NDArray[np.bool_]) -> Texture:
        """Return the texture of some of the triangles."""
        return Texture(self.image, self.coordinates[which])

    def at_corners(self) -> Colours:
        """Return (T, 3, 3) the colour of the pixel at each triangle's corners."""
        height, width = self.image.shape[:2]
        u, v = self.coordinates[..., 0], self.coordinates[..., 1]
        # The far edge of the image itself is in its last pixel, not in the first of the next.
        columns = np.floor(np.where(u == 1, u - 0.5 / width, u) * width).astype(np.int64) % width
        rows = np.floor(np.where(v == 0, 1 - 0.5 / height, 1 - v) * height).astype(np.int64)
        corners: Colours = self.image[rows % height, columns]
        return corners


def decode(colours: Colours) -> NDArray[np.float32]:
    """Return colours in linear light, 0 to 1, of bytes as sRGB (IEC 61966-2-1)."""
    encoded = np.asarray(colours, dtype=np.float64) / 255
    linear = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    return linear.astype(np.float32)


def encode(linear: FloatArray | NDArray[np.float32]) -> Colours:
    """Return colours as sRGB of linear light from 0 to 1."""
    colours = np.empty(linear.shape, np.uint8)
    rows = max(_BAND // max(linear[:1].size, 1), 1)
    for top in range(0, len(linear), rows):
        band = linear[top : top + rows]
        steps = (np.clip(band, 0, 1) * (len(_encoded()) - 1) + 0.5).astype(np.int32)
        colours[top : top + rows] = _encoded()[steps]
    return colours


@cache
def _encoded() -> Colours:
    """Return sRGB of linear light in steps of which none is a byte's."""
    linear = np.linspace(0, 1, 32_768)
    encoded = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return np.round(255 * encoded).astype(np.uint8)


def check_colours(argument: str, colours: Any, count: int) -> Colours:
    """Return (count, 3) colours as an array of bytes that cannot be written to.

    Raises
    ------
    InputError
        If they have another shape, or are not whole numbers from 0 to 255.
    """
    checked: Colours = check_array(argument, colours, (count, 3), np.uint8)
    return checked
