"""Lens distortion: how far from its centre an image goes, and what of the world may be in it.

A polynomial fits a lens where it was calibrated and folds back farther out: what is far off the
axis would come to lie among what is seen. So a camera sees what is off the axis by less than its
*reach*, up to which every step away from the axis is one away from the image's centre as well:

- of OpenCV's polynomials, with r = √(x² + y²) at z = 1, the radial part
  r (1 + k₁r² + k₂r⁴ + k₃r⁶) / (1 + k₄r² + k₅r⁴ + k₆r⁶) has to grow faster than
  3 ‖p‖ r² + ‖(s₁, s₃)‖ r² + ‖(s₂, s₄)‖ r⁴, the most by which the tangential and the thin prism's
  terms could take it back in any direction;
- of its fisheye, with θ = atan r, θ (1 + k₁θ² + k₂θ⁴ + k₃θ⁶ + k₄θ⁸) has to grow. The reach is 90°
  at most: what is seen lies before the camera.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache, lru_cache
from typing import Any

import numpy as np
from numpy.polynomial.polynomial import polyder, polymul, polysub, polyval
from numpy.typing import NDArray
from scipy.optimize import brentq

from focus_planner.core import kernels
from focus_planner.core.arrays import FloatArray
from focus_planner.core.rig.camera import CameraIntrinsics

Row = tuple[float, ...]

# k₁, ..., k₆ in the order of OpenCV's coefficients.
_RADIAL = [0, 1, 4, 5, 6, 7]
# Of the cells that bound a view.
_DIRECTIONS, _RINGS, _FIRST_RINGS = 256, 64, 1024
# Instead of infinity, of which products with 0 are nothing.
_ALL = 1e100
# Of bounds: beyond what rounding does to them, and to sums with them.
_SLACK = 1e-9
_MARGIN = 1e-6
# Where a corner of an image is drawn that shows nothing, or what is farther off the axis.
_WIDEST = math.tan(math.radians(85))
_STEPS = 50
# Images of large rigs, whose views take 3 KiB each; a camera that is calibrated again has another.
_MOST_KEPT = 32_768


@dataclass(frozen=True, eq=False)
class _Growth:
    """How the distance from the image's centre grows with that from the axis.

    Of tan θ, or of θ if ``fisheye``, as polynomials' coefficients and in focal lengths: the
    ``radial`` part, as numerator and denominator, and ``bend``, the most that other terms take
    back. The ``reach`` is tan θ, inf if there is no end.
    """

    radial: tuple[FloatArray, FloatArray]
    bend: FloatArray
    fisheye: bool
    reach: float

    def distances(self, tangents: FloatArray) -> FloatArray:
        """Return the radial parts at some tan θ within reach."""
        at = np.arctan(tangents) if self.fisheye else tangents
        numerator, denominator = self.radial
        distances: FloatArray = polyval(at, numerator) / polyval(at, denominator)
        return distances


@lru_cache(maxsize=_MOST_KEPT)
def view(intrinsics: CameraIntrinsics) -> tuple[Row, Row]:
    """Return a frustum that holds all that a distorted image shows, and its projection.

    The view is cut into cells of a direction around the axis and an angle off it, and the frustum
    is the rectangle at depth 1 around those whose image may touch the pixels that are read out:
    of a cell, the radial part lies between its values at the inner and the outer end, as it
    grows, and other terms add ``bend`` at most.

    Returns
    -------
    frustum : tuple of 6 floats
        fx, fy, cx, cy, width, height of a pinhole's image.
    projection : tuple of floats
        As :func:`focus_planner.core.kernels.keep_imaged` takes it.
    """
    growth = _growth(intrinsics)
    return _frustum(intrinsics, growth), _projection(intrinsics, growth)


def _frustum(intrinsics: CameraIntrinsics, growth: _Growth) -> Row:
    angles = np.linspace(0.0, math.atan(growth.reach), _FIRST_RINGS + 1)
    rings = int(_reached(intrinsics, growth, angles).sum())  # farther out there is nothing
    angles = np.linspace(0.0, angles[rings], _RINGS + 1)
    low, high = _bounds(intrinsics, growth, angles)
    margin = _MARGIN * (high - low)
    cx, cy = (-0.5 - (low - margin)).tolist()
    width, height = (high - low + 2 * margin).tolist()
    return 1.0, 1.0, cx, cy, width, height


def _projection(intrinsics: CameraIntrinsics, growth: _Growth) -> Row:
    x, y, width, height = intrinsics.pixels_read
    kind = kernels.FISHEYE if growth.fisheye else kernels.POLYNOMIAL
    pinhole = (
        intrinsics.fx,
        intrinsics.fy,
        intrinsics.cx - x,
        intrinsics.cy - y,
        float(width),
        float(height),
    )
    return (float(kind), growth.reach, *pinhole, *_coefficients(intrinsics).tolist())


@lru_cache(maxsize=_MOST_KEPT)
def corner_rays(intrinsics: CameraIntrinsics) -> tuple[tuple[float, float], ...]:
    """Return x, y at depth 1 of what the corners of the pixels read out show.

    From the first pixel's corner with the rows: top left, top right, bottom right, bottom left. A
    corner that shows nothing, or what is more than 85° off the axis, is taken to show what is as
    far off it as can be seen, or that far.
    """
    left, top, width, height = intrinsics.pixels_read
    u = np.array([left, left + width, left + width, left]) - 0.5
    v = np.array([top, top, top + height, top + height]) - 0.5
    targets = np.stack(
        [(u - intrinsics.cx) / intrinsics.fx, (v - intrinsics.cy) / intrinsics.fy], axis=-1
    )
    if intrinsics.distortion_model:
        growth = _growth(intrinsics)
        targets = np.array([_undistorted(intrinsics, growth, target) for target in targets])
    return tuple((x, y) for x, y in targets.tolist())


def _coefficients(intrinsics: CameraIntrinsics) -> FloatArray:
    """Return (12,) the coefficients of a distorted image, the missing ones 0."""
    padded = np.zeros(kernels.COEFFICIENTS)
    given = intrinsics.distortion[: kernels.COEFFICIENTS]  # the other two are 0
    padded[: len(given)] = given
    return padded


def _growth(intrinsics: CameraIntrinsics) -> _Growth:
    k = _coefficients(intrinsics)
    fisheye = intrinsics.distortion_model == "equidistant"
    if fisheye:
        numerator, denominator, bend = _odd(k[:4]), np.ones(1), np.zeros(1)
    else:
        numerator, denominator = _odd(k[_RADIAL[:3]]), _odd(k[_RADIAL[3:]])[1:]
        square = 3 * math.hypot(k[2], k[3]) + math.hypot(k[8], k[10])
        bend = np.array([0.0, 0.0, square, 0.0, math.hypot(k[9], k[11])])
    growing = polysub(
        polymul(polyder(numerator), denominator), polymul(numerator, polyder(denominator))
    )
    taken_back = polymul(polymul(denominator, denominator), polyder(bend))
    end = min(_first_zero(polysub(growing, taken_back)), _first_zero(denominator))
    if fisheye:
        end = math.tan(end) if end < math.pi / 2 else math.inf
    return _Growth((numerator, denominator), bend, fisheye, end)


def _odd(k: FloatArray) -> FloatArray:
    """Return the coefficients of t + k₁t³ + k₂t⁵ + ..."""
    coefficients = np.zeros(2 * len(k) + 2)
    coefficients[1], coefficients[3::2] = 1.0, k
    return coefficients


def _first_zero(polynomial: NDArray[np.floating[Any]]) -> float:
    """Return the least positive zero of a polynomial that is 1 at 0; inf if there is none.

    Found as the greatest zero of the reversed polynomial, whose first coefficient is that 1.
    """
    zeros = np.roots(polynomial)
    real = zeros[zeros.imag == 0].real
    return float(1 / real.max()) if (real > 0).any() else math.inf


def _reached(
    intrinsics: CameraIntrinsics, growth: _Growth, angles: FloatArray
) -> NDArray[np.bool_]:
    """Return whether what is that far off the axis may be as near the centre as some pixel is."""
    tangents = np.tan(angles[:-1])
    nearest = growth.distances(tangents) - polyval(tangents, growth.bend)
    reached: NDArray[np.bool_] = nearest <= math.hypot(*np.abs(_sides(intrinsics)).max(axis=1))
    return reached


def _bounds(
    intrinsics: CameraIntrinsics, growth: _Growth, angles: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return (2,) least and (2,) greatest x, y at depth 1 of cells that may be imaged."""
    tangents = np.tan(angles)
    distances = growth.distances(tangents[:-1])
    bounds = kernels.bound_view(
        np.append(distances, _ALL),  # at the very end there may be a pole
        polyval(tangents, growth.bend),
        np.where(angles < math.pi / 2, tangents, _ALL),
        _directions(),
        _sides(intrinsics),
    )
    return bounds[:, 0], bounds[:, 1]


def _sides(intrinsics: CameraIntrinsics) -> FloatArray:
    """Return (2, 2) where columns, and rows, that are read out begin and end, in focal lengths."""
    x, y, width, height = intrinsics.pixels_read
    u, v = np.array([x, x + width]) - 0.5, np.array([y, y + height]) - 0.5
    sides = np.stack([(u - intrinsics.cx) / intrinsics.fx, (v - intrinsics.cy) / intrinsics.fy])
    slack = _SLACK * (1 + np.abs(sides).max(axis=1))
    widened: FloatArray = sides + np.outer(slack, [-1.0, 1.0])
    return widened


@cache
def _directions() -> FloatArray:
    """Return (directions, 2, 2) the least and the greatest cosine, and sine, in each cell.

    Where a cosine turns there is a cell's middle, so the ends and the middle tell.
    """
    middles = 2 * np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
    at = middles + np.pi / _DIRECTIONS * np.array([[-1], [0], [1]])
    values = np.stack([np.cos(at), np.sin(at)])
    extremes = [values.min(axis=1) - _SLACK, values.max(axis=1) + _SLACK]
    return np.ascontiguousarray(np.moveaxis(np.array(extremes), 2, 0).swapaxes(1, 2))


def _undistorted(intrinsics: CameraIntrinsics, growth: _Growth, target: FloatArray) -> FloatArray:
    """Return x, y at depth 1 of what is imaged there, in focal lengths from the centre."""
    k = _coefficients(intrinsics)
    kind = kernels.FISHEYE if growth.fisheye else kernels.POLYNOMIAL
    end = min(growth.reach * (1 - _SLACK), _WIDEST)
    point, before = np.zeros(2), target
    for _ in range(_STEPS):
        tangent = np.array(math.hypot(*point))
        share = growth.distances(tangent) / tangent if tangent > 0 else 1.0
        rest = target - (np.array(kernels.distort(*point, kind, k)) - share * point)
        before, point = point, _outward(growth, rest, end)
        if np.abs(point - before).max() < _SLACK:
            break
    return point


def _outward(growth: _Growth, target: FloatArray, end: float) -> FloatArray:
    """Return x, y at depth 1, ``end`` from the axis at most, whose radial part is there."""
    distance = math.hypot(*target)
    if distance == 0:
        return target

    def beyond(tangent: float) -> float:
        return float(growth.distances(np.array(tangent))) - distance

    tangent = end if beyond(end) <= 0 else float(brentq(beyond, 0.0, end, xtol=1e-14))
    return target * (tangent / distance)
