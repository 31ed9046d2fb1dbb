"""Lens distortion: how far from its centre an image goes, and what of the world may be in it.

A polynomial fits a lens where it was calibrated and folds back farther out: what is far off the
axis would come to lie among what is seen. So a camera sees what is off the axis by less than its
*reach*, up to which every step away from the axis is one away from the image's centre as well:

- of OpenCV's polynomials, with r = √(x² + y²) at z = 1, the radial part
  r (1 + k₁r² + k₂r⁴ + k₃r⁶) / (1 + k₄r² + k₅r⁴ + k₆r⁶) has to grow faster than
  3 |p| r² + |(s₁, s₃)| r² + |(s₂, s₄)| r⁴, the most by which the tangential and the thin prism's
  terms could take it back in any direction;
- of its fisheye, with θ = atan r, θ (1 + k₁θ² + k₂θ⁴ + k₃θ⁶ + k₄θ⁸) has to grow. The reach is 90°
  at most: what is seen lies before the camera.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.polynomial.polynomial import polyder, polymul, polysub, polyval
from numpy.typing import NDArray
from scipy.optimize import brentq

from focus_planner.core import kernels
from focus_planner.core.types import MAX_CAMERAS, FloatArray, Image

Row = tuple[float, ...]

# k₁, ..., k₆ in the order of OpenCV's coefficients.
_RADIAL = [0, 1, 4, 5, 6, 7]
# Of the cells that bound a view.
_DIRECTIONS, _RINGS, _FIRST_RINGS = 128, 64, 1024
# Instead of infinity, of which products with 0 are nothing.
_ALL = 1e100
# Of bounds: beyond what rounding does to them, and to sums with them.
_SLACK = 1e-9
_MARGIN = 1e-6
# Where a corner of an image is drawn that shows nothing, or what is farther off the axis.
_WIDEST = math.tan(math.radians(85))
_STEPS = 50


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


@lru_cache(maxsize=MAX_CAMERAS)
def bounding_frustum(image: Image) -> Row:
    """Return a pinhole's fx, fy, cx, cy, width, height that has all in view that an image has.

    The view is cut into cells of a direction around the axis and an angle off it; the pinhole's
    image is the rectangle around those whose image may touch the pixels that are read out. Of a
    cell, the radial part lies between its values at the inner and the outer end, as it grows; its
    direction is off the middle by half a cell at most; and other terms are at most ``bend``.

    Parameters
    ----------
    image : Image
        Distorted.
    """
    growth = _growth(image)
    angles = np.linspace(0.0, math.atan(growth.reach), _FIRST_RINGS + 1)
    rings = int(_reached(image, growth, angles).sum())  # farther out there is nothing
    angles = np.linspace(0.0, angles[rings], _RINGS + 1)
    kept = _touching(image, growth, angles)
    low, high = _bounds(_tangents(angles), kept)
    margin = _MARGIN * (high - low)
    cx, cy = (-0.5 - (low - margin)).tolist()
    width, height = (high - low + 2 * margin).tolist()
    return 1.0, 1.0, cx, cy, width, height


@lru_cache(maxsize=MAX_CAMERAS)
def projection(image: Image) -> Row:
    """Return an image's projection as the kernels take it; zeros for a pinhole's."""
    numbers = np.zeros(kernels.PROJECTION + kernels.COEFFICIENTS)
    if image.distortion_model:
        growth = _growth(image)
        x, y, width, height = image.pixels_read
        kind = kernels.FISHEYE if growth.fisheye else kernels.POLYNOMIAL
        numbers[:2] = kind, growth.reach
        numbers[2 : kernels.PROJECTION] = (
            *(image.fx, image.fy, image.cx - x, image.cy - y),
            *(width, height),
        )
        numbers[kernels.PROJECTION :] = _coefficients(image)
    return tuple(numbers.tolist())


@lru_cache(maxsize=MAX_CAMERAS)
def corner_rays(image: Image) -> tuple[tuple[float, float], ...]:
    """Return x, y at depth 1 of what the corners of the pixels read out show.

    From the first pixel's corner with the rows: top left, top right, bottom right, bottom left. A
    corner that shows nothing, or what is more than 85° off the axis, is taken to show what is as
    far off it as can be seen, or that far.
    """
    left, top, width, height = image.pixels_read
    u = np.array([left, left + width, left + width, left]) - 0.5
    v = np.array([top, top, top + height, top + height]) - 0.5
    targets = np.stack([(u - image.cx) / image.fx, (v - image.cy) / image.fy], axis=-1)
    if image.distortion_model:
        growth = _growth(image)
        targets = np.array([_undistorted(image, growth, target) for target in targets])
    return tuple((x, y) for x, y in targets.tolist())


def _coefficients(image: Image) -> FloatArray:
    """Return (12,) the coefficients of a distorted image, the missing ones 0."""
    padded = np.zeros(kernels.COEFFICIENTS)
    given = image.distortion[: kernels.COEFFICIENTS]  # the other two are 0
    padded[: len(given)] = given
    return padded


def _growth(image: Image) -> _Growth:
    k = _coefficients(image)
    fisheye = image.distortion_model == "equidistant"
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


def _tangents(angles: FloatArray) -> FloatArray:
    """Return tan θ, very large at 90°."""
    tangents: FloatArray = np.where(angles < math.pi / 2, np.tan(angles), _ALL)
    return tangents


def _reached(image: Image, growth: _Growth, angles: FloatArray) -> NDArray[np.bool_]:
    """Return whether what is that far off the axis may be as near the centre as some pixel is."""
    tangents = np.tan(angles[:-1])
    nearest = growth.distances(tangents) - polyval(tangents, growth.bend)
    reached: NDArray[np.bool_] = nearest <= math.hypot(*np.abs(_sides(image)).max(axis=1))
    return reached


def _touching(image: Image, growth: _Growth, angles: FloatArray) -> NDArray[np.bool_]:
    """Return (rings, directions) whether a cell's image may touch the pixels read out."""
    tangents = np.tan(angles)
    # At the very end there may be a pole.
    inner = growth.distances(tangents[:-1])
    outer = np.append(inner[1:], _ALL)
    bend = polyval(tangents[1:], growth.bend)[:, None]
    kept = np.tile(_reached(image, growth, angles), (_DIRECTIONS, 1)).T
    for direction, (begin, end) in zip(_directions(), _sides(image), strict=True):
        low, high = _extent(inner, outer, direction)
        kept &= (low - bend <= end) & (high + bend >= begin)
    return kept


def _sides(image: Image) -> FloatArray:
    """Return (2, 2) where columns, and rows, that are read out begin and end, in focal lengths."""
    x, y, width, height = image.pixels_read
    u, v = np.array([x, x + width]) - 0.5, np.array([y, y + height]) - 0.5
    sides = np.stack([(u - image.cx) / image.fx, (v - image.cy) / image.fy])
    slack = _SLACK * (1 + np.abs(sides).max(axis=1))
    widened: FloatArray = sides + np.outer(slack, [-1.0, 1.0])
    return widened


def _bounds(tangents: FloatArray, kept: NDArray[np.bool_]) -> tuple[FloatArray, FloatArray]:
    """Return (2,) least and (2,) greatest x, y at depth 1 of the cells kept."""
    extents = [_extent(tangents[:-1], tangents[1:], each) for each in _directions()]
    low = np.array([low[kept].min() for low, _ in extents])
    high = np.array([high[kept].max() for _, high in extents])
    return low, high


def _directions() -> tuple[FloatArray, FloatArray]:
    """Return (directions,) the cosines and the sines of the cells' middles."""
    angles = 2 * np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
    return np.cos(angles), np.sin(angles)


def _extent(
    inner: FloatArray, outer: FloatArray, direction: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return (rings, directions) the least and the greatest coordinate within each cell."""
    half = np.pi / _DIRECTIONS * (1 + _SLACK)  # no cosine changes by more than its angle
    low, high = direction - half, direction + half
    least = np.minimum(np.outer(inner, low), np.outer(outer, low))
    return least, np.maximum(np.outer(inner, high), np.outer(outer, high))


def _undistorted(image: Image, growth: _Growth, target: FloatArray) -> FloatArray:
    """Return x, y at depth 1 of what is imaged there, in focal lengths from the centre."""
    k = _coefficients(image)
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
