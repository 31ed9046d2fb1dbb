# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Lens distortion: up to which angle it is valid, and which part of the world an image shows.

A distortion polynomial fits the lens where it was calibrated and folds back farther out, which
would image points far off the axis among those actually seen. A camera is therefore taken to see
only rays closer to the axis than its *reach*, up to which the image's distance from its centre
increases with the ray's distance from the axis:

- OpenCV's polynomials, with r = √(x² + y²) at z = 1: the radial part
  r (1 + k₁r² + k₂r⁴ + k₃r⁶) / (1 + k₄r² + k₅r⁴ + k₆r⁶) must grow faster than
  3 ‖p‖ r² + ‖(s₁, s₃)‖ r² + ‖(s₂, s₄)‖ r⁴, an upper bound on what the tangential and thin-prism
  terms can take back in any direction.
- OpenCV's fisheye model, with θ = atan r: θ (1 + k₁θ² + k₂θ⁴ + k₃θ⁶ + k₄θ⁸) must grow. The reach
  is at most 90°: a camera sees nothing behind it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache, lru_cache
from typing import Any

import numpy as np
from numpy.polynomial.polynomial import polyder, polymul, polysub, polyval
from numpy.typing import NDArray

from focus_planner.core import kernels
from focus_planner.core.arrays import FloatArray
from focus_planner.core.rig.camera import CameraIntrinsics

Row = tuple[float, ...]

# Where k₁, ..., k₆ stand among OpenCV's coefficients.
_RADIAL = [0, 1, 4, 5, 6, 7]
# Cells of the polar grid that bounds the frustum, and of the coarse grid that finds its end.
_DIRECTIONS, _RINGS, _FIRST_RINGS = 256, 64, 1024
# In place of infinity, whose product with 0 is NaN.
_HUGE = 1e100
# Relative widening of bounds: more than rounding does to them and to sums of them.
_SLACK = 1e-9
_MARGIN = 1e-6
# Corners that show nothing, or that are imaged farther off the axis, are drawn here.
_WIDEST_TANGENT = math.tan(math.radians(85))
_MAX_ITERATIONS = 50
# Entries of a table that inverts the radial part, and the widest tan θ in it.
_TABLE, _WIDEST_SEEN = 4096, 1e4
# Enough for large rigs whose cameras are recalibrated now and then; an entry takes 3 KiB.
_CACHE_SIZE = 32_768


@dataclass(frozen=True, eq=False)
class _RadialProfile:
    """Distance from the image's centre, in focal lengths, as a function of the angle off the axis.

    Attributes
    ----------
    radial : tuple of 2 arrays
        Numerator and denominator of the radial part: coefficients of polynomials in tan θ, or
        in θ if ``fisheye``.
    deviation : array
        Coefficients of an upper bound on the displacement by all other terms.
    fisheye : bool
    reach : float
        tan θ up to which the distance increases; inf without end.
    """

    radial: tuple[FloatArray, FloatArray]
    deviation: FloatArray
    fisheye: bool
    reach: float

    def distances(self, tangents: FloatArray) -> FloatArray:
        """Return the radial part at each tan θ, all within reach."""
        at = np.arctan(tangents) if self.fisheye else tangents
        numerator, denominator = self.radial
        distances: FloatArray = polyval(at, numerator) / polyval(at, denominator)
        return distances


@lru_cache(maxsize=_CACHE_SIZE)
def frustum_and_projection(intrinsics: CameraIntrinsics) -> tuple[Row, Row]:
    """Return a frustum that contains all that a distorted image shows, and the projection.

    The field of view is divided into cells by the direction around the axis and the angle off it.
    The frustum is the bounding rectangle, at depth 1, of the cells whose image may touch the
    pixels that are read out: the radial part increases, so within a cell it lies between its
    values at the inner and outer ends, and the other terms add at most ``deviation``.

    Returns
    -------
    frustum : tuple of 6 floats
        fx, fy, cx, cy, width, height of a pinhole camera, pixels.
    projection : tuple of floats
        A row of ``projections`` as :func:`focus_planner.core.kernels.keep_imaged` takes them.
    """
    profile = _radial_profile(intrinsics)
    return _frustum(intrinsics, profile), _projection(intrinsics, profile)


def _frustum(intrinsics: CameraIntrinsics, profile: _RadialProfile) -> Row:
    angles = np.linspace(0.0, math.atan(profile.reach), _FIRST_RINGS + 1)
    rings = int(_may_be_imaged(intrinsics, profile, angles).sum())  # nothing is seen beyond
    angles = np.linspace(0.0, angles[rings], _RINGS + 1)
    low, high = _bounds(intrinsics, profile, angles)
    margin = _MARGIN * (high - low)
    cx, cy = (-0.5 - (low - margin)).tolist()
    width, height = (high - low + 2 * margin).tolist()
    return 1.0, 1.0, cx, cy, width, height


def _projection(intrinsics: CameraIntrinsics, profile: _RadialProfile) -> Row:
    x, y, width, height = intrinsics.pixels_read
    kind = kernels.FISHEYE if profile.fisheye else kernels.POLYNOMIAL
    pinhole = (
        intrinsics.fx,
        intrinsics.fy,
        intrinsics.cx - x,
        intrinsics.cy - y,
        float(width),
        float(height),
    )
    return (float(kind), profile.reach, *pinhole, *_coefficients(intrinsics).tolist())


@lru_cache(maxsize=_CACHE_SIZE)
def corner_rays(intrinsics: CameraIntrinsics) -> tuple[tuple[float, float], ...]:
    """Return the rays through the corners of the pixels that are read out, as x, y at depth 1.

    In the order top left, top right, bottom right, bottom left. Where no ray is imaged at a
    corner, or only one more than 85° off the axis, the ray there is as far off the axis as the
    camera sees, at most 85°.
    """
    left, top, width, height = intrinsics.pixels_read
    u = np.array([left, left + width, left + width, left]) - 0.5
    v = np.array([top, top, top + height, top + height]) - 0.5
    targets = np.stack(
        [(u - intrinsics.cx) / intrinsics.fx, (v - intrinsics.cy) / intrinsics.fy], axis=-1
    )
    if intrinsics.distortion_model:
        profile = _radial_profile(intrinsics)
        targets = np.array([_undistort(intrinsics, profile, target) for target in targets])
    return tuple((x, y) for x, y in targets.tolist())


def first_rays(intrinsics: CameraIntrinsics, targets: FloatArray) -> FloatArray:
    """Return (n, 2) x, y at depth 1 of the rays that the radial part takes to the targets.

    Those are in focal lengths from the principal point. With the other terms the rays are imaged
    near them; a target beyond the reach gets a ray within.

    Parameters
    ----------
    intrinsics : CameraIntrinsics
        With a distortion model.
    targets : (n, 2) array
    """
    profile = _radial_profile(intrinsics)
    lengths = np.sqrt((targets**2).sum(axis=1))
    end = math.atan(min(profile.reach, _WIDEST_SEEN)) * (1 - _SLACK)
    angles = np.linspace(0.0, end, _FIRST_RINGS + 1)
    # Telephoto lenses see a small part of what their distortion is valid for.
    beyond = np.searchsorted(profile.distances(np.tan(angles)), lengths.max(initial=0.0))
    tangents = np.tan(np.linspace(0.0, angles[min(int(beyond), _FIRST_RINGS)], _TABLE))
    found = np.interp(lengths, profile.distances(tangents), tangents)
    scale = found / np.where(lengths > 0, lengths, 1.0)
    rays: FloatArray = targets * scale[:, None]
    return rays


def _coefficients(intrinsics: CameraIntrinsics) -> FloatArray:
    """Return (12,) the distortion coefficients, padded with zeros."""
    padded = np.zeros(kernels.COEFFICIENTS)
    given = intrinsics.distortion[: kernels.COEFFICIENTS]  # the tilted sensor's two are 0
    padded[: len(given)] = given
    return padded


def _radial_profile(intrinsics: CameraIntrinsics) -> _RadialProfile:
    k = _coefficients(intrinsics)
    fisheye = intrinsics.distortion_model == "equidistant"
    if fisheye:
        numerator, denominator, deviation = _odd(k[:4]), np.ones(1), np.zeros(1)
    else:
        numerator, denominator = _odd(k[_RADIAL[:3]]), _odd(k[_RADIAL[3:]])[1:]
        square = 3 * math.hypot(k[2], k[3]) + math.hypot(k[8], k[10])
        deviation = np.array([0.0, 0.0, square, 0.0, math.hypot(k[9], k[11])])
    growing = polysub(
        polymul(polyder(numerator), denominator), polymul(numerator, polyder(denominator))
    )
    taken_back = polymul(polymul(denominator, denominator), polyder(deviation))
    end = min(_first_zero(polysub(growing, taken_back)), _first_zero(denominator))
    if fisheye:
        end = math.tan(end) if end < math.pi / 2 else math.inf
    return _RadialProfile((numerator, denominator), deviation, fisheye, end)


def _odd(k: FloatArray) -> FloatArray:
    """Return the coefficients of t + k₁t³ + k₂t⁵ + ..."""
    coefficients = np.zeros(2 * len(k) + 2)
    coefficients[1], coefficients[3::2] = 1.0, k
    return coefficients


def _first_zero(polynomial: NDArray[np.floating[Any]]) -> float:
    """Return the least positive root of a polynomial that is 1 at 0; inf if there is none.

    It is the reciprocal of the greatest root of the reversed polynomial, which is monic.
    """
    zeros = np.roots(polynomial)
    real = zeros[zeros.imag == 0].real
    return float(1 / real.max()) if (real > 0).any() else math.inf


def _may_be_imaged(
    intrinsics: CameraIntrinsics, profile: _RadialProfile, angles: FloatArray
) -> NDArray[np.bool_]:
    """Return, for each ring between two angles, whether some pixel may show it."""
    tangents = np.tan(angles[:-1])
    nearest = profile.distances(tangents) - polyval(tangents, profile.deviation)
    farthest_pixel = math.hypot(*np.abs(_pixel_bounds(intrinsics)).max(axis=1))
    imaged: NDArray[np.bool_] = nearest <= farthest_pixel
    return imaged


def _bounds(
    intrinsics: CameraIntrinsics, profile: _RadialProfile, angles: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return (2,) the least and (2,) the greatest x, y at depth 1 of all cells that may be seen."""
    tangents = np.tan(angles)
    distances = profile.distances(tangents[:-1])
    bounds = kernels.bound_view(
        np.append(distances, _HUGE),  # there may be a pole at the reach itself
        polyval(tangents, profile.deviation),
        np.where(angles < math.pi / 2, tangents, _HUGE),
        _direction_bounds(),
        _pixel_bounds(intrinsics),
    )
    return bounds[:, 0], bounds[:, 1]


def _pixel_bounds(intrinsics: CameraIntrinsics) -> FloatArray:
    """Return (2, 2) the first and last x, and y, of the pixels read out, in focal lengths."""
    x, y, width, height = intrinsics.pixels_read
    u, v = np.array([x, x + width]) - 0.5, np.array([y, y + height]) - 0.5
    sides = np.stack([(u - intrinsics.cx) / intrinsics.fx, (v - intrinsics.cy) / intrinsics.fy])
    slack = _SLACK * (1 + np.abs(sides).max(axis=1))
    widened: FloatArray = sides + np.outer(slack, [-1.0, 1.0])
    return widened


@cache
def _direction_bounds() -> FloatArray:
    """Return (directions, 2, 2) the least and the greatest cosine, and sine, in each sector.

    All turning points are at the middles of sectors, so the ends and the middle give the extremes.
    """
    middles = 2 * np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
    at = middles + np.pi / _DIRECTIONS * np.array([[-1], [0], [1]])
    values = np.stack([np.cos(at), np.sin(at)])
    extremes = [values.min(axis=1) - _SLACK, values.max(axis=1) + _SLACK]
    return np.ascontiguousarray(np.moveaxis(np.array(extremes), 2, 0).swapaxes(1, 2))


def _undistort(
    intrinsics: CameraIntrinsics, profile: _RadialProfile, target: FloatArray
) -> FloatArray:
    """Return x, y at depth 1 of the ray imaged at ``target``, in focal lengths from the centre."""
    k = _coefficients(intrinsics)
    kind = kernels.FISHEYE if profile.fisheye else kernels.POLYNOMIAL
    end = min(profile.reach * (1 - _SLACK), _WIDEST_TANGENT)
    point, before = np.zeros(2), target
    for _ in range(_MAX_ITERATIONS):
        tangent = np.array(math.hypot(*point))
        share = profile.distances(tangent) / tangent if tangent > 0 else 1.0
        rest = target - (np.array(kernels.distort(*point, kind, k)) - share * point)
        before, point = point, _invert_radial(profile, rest, end)
        if np.abs(point - before).max() < _SLACK:
            break
    return point


def _invert_radial(profile: _RadialProfile, target: FloatArray, end: float) -> FloatArray:
    """Return x, y at depth 1 that the radial part takes to ``target``, at most ``end`` away."""
    from scipy.optimize import brentq  # noqa: PLC0415 - takes as long as a plan

    distance = math.hypot(*target)
    if distance == 0:
        return target

    def excess(tangent: float) -> float:
        return float(profile.distances(np.array(tangent))) - distance

    tangent = end if excess(end) <= 0 else float(brentq(excess, 0.0, end, xtol=1e-14))
    return target * (tangent / distance)
