# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Diffraction: how wide a perfect lens images a point, and what that leaves of depth of field.

A circular aperture images a point in focus as an Airy disc, whose first dark ring has a diameter of
2.44 λ N (1 + m): λ is the wavelength, N the f-number, m the magnification F / (s − F) at a focus
distance of s (Hecht, Optics, Sec. 10.2.5; N (1 + m) is the f-number at the image). A point out of
focus is imaged as a disc of the diameter ``A F |d − s| / (d (s − F))``
(:mod:`focus_planner.core.imaging.blur`). Both together are taken as the root of the sum of their
squares (P. K. Hansma, View Camera Focusing in Practice, Photo Techniques, March 1996): what is no
wider than the circle of confusion c is sharp. Beyond the f-number whose Airy disc alone is wider
than c, nothing is.
"""

from __future__ import annotations

import numpy as np

from focus_planner.core.arrays import FloatArray
from focus_planner.core.rig.lens import Lens
from focus_planner.core.rig.optics import settable_interval
from focus_planner.core.validation import InputError

#: Metres: of the light to which eyes are most sensitive, in the middle of what cameras see.
GREEN = 550e-9
_AIRY = 2.44


def airy_diameter(focus_distance: FloatArray, lens: Lens, wavelength: float = GREEN) -> FloatArray:
    """Return the diameter of the Airy disc on the sensor at each focus distance, metres.

    Parameters
    ----------
    focus_distance : (n,) array
        s, metres; above the focal length, may be inf.
    lens : Lens
        With a circle of confusion, which tells its f-number.
    wavelength : float
        λ, metres.

    Raises
    ------
    InputError
        If the lens has no circle of confusion.
    """
    # N (1 + m) = N s / (s − F).
    s = np.asarray(focus_distance, dtype=np.float64)
    diameter: FloatArray = _AIRY * wavelength * f_number(lens) / (1 - lens.focal_length / s)
    return diameter


def sharp_interval(
    depth: FloatArray, lens: Lens, wavelength: float = GREEN
) -> tuple[FloatArray, FloatArray]:
    """Return the focus distances at which defocus and diffraction together leave a point sharp.

    With x = 1/s, q = A F = H c and k = 2.44 λ N, the squares of both blurs are at most c² where

        q² (x − 1/d)² + k² ≤ c² (1 − F x)²,

    which is between the two roots of a quadratic in x, or nowhere. For λ = 0 they are the ends of
    :func:`~focus_planner.core.rig.optics.focus_interval`.

    Parameters
    ----------
    depth : (n,) array
        d, metres.
    lens : Lens
        With a circle of confusion.
    wavelength : float
        λ, metres; 0 leaves diffraction out.

    Returns
    -------
    nearest, farthest : (n,) arrays
        Metres, as far as the lens can be set to them; (inf, -inf) where there are none.

    Raises
    ------
    InputError
        If the lens has no circle of confusion.
    """
    f, c = lens.focal_length, _circle(lens)
    q, k = lens.hyperfocal_distance * c, _AIRY * wavelength * f_number(lens)
    inverse = 1 / np.asarray(depth, dtype=np.float64)
    # a x² − 2 h x + e ≤ 0; a > 0 because H > F.
    a, h = q * q - c * c * f * f, q * q * inverse - c * c * f
    e = q * q * inverse**2 + k * k - c * c
    rest = h * h - a * e
    root = np.sqrt(np.maximum(rest, 0.0))
    sharp = (rest >= 0) & (f * inverse < 1)
    least, most = (h - root) / a, (h + root) / a
    farthest = np.where(least > 0, 1 / np.where(least > 0, least, 1.0), np.inf)
    return settable_interval(
        np.where(sharp, 1 / most, np.inf), np.where(sharp, farthest, -np.inf), lens
    )


def f_number(lens: Lens) -> float:
    """Return N = F² / (H c).

    Raises
    ------
    InputError
        If the lens has no circle of confusion.
    """
    return lens.focal_length**2 / (lens.hyperfocal_distance * _circle(lens))


def _circle(lens: Lens) -> float:
    if lens.circle_of_confusion is None:
        raise InputError(
            "lens.circle_of_confusion",
            "that of a lens whose diffraction is asked for",
            "none",
            "give it, or the f-number and it in place of the hyperfocal distance",
        )
    return lens.circle_of_confusion
