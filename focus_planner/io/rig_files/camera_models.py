# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Camera models of other programs, and the closest that ``sensor_msgs/CameraInfo`` has.

What CameraInfo has no place for (a radial term of the eighth power, skew, tangential terms of a
fisheye) is approximated, if at all, and how many pixels that is off is measured over the image.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from focus_planner.core.arrays import FloatArray
from focus_planner.core.rig.camera import CameraIntrinsics
from focus_planner.core.text import how_many
from focus_planner.core.validation import InputError

#: The first pixel's centre where images are counted from its corner; in CameraInfo it is 0.
PIXEL_CENTRE = 0.5
#: Of the larger side of an image: how far off an approximation may be.
_TOLERABLE = 5e-3
_DIRECTIONS, _RINGS, _FITTED = 128, 512, 256
_MARGIN = 1.05  # of the image
_WIDEST = math.radians(89.0)
_LARGEST = 1e12  # of a coefficient that means something

_Projection = Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]


@dataclass(frozen=True)
class BrownCamera:
    """A camera with the terms that photogrammetry has, in OpenCV's order and pixels.

    With r² = x² + y² of a ray (x, y, 1), or of it shortened to its angle for a fisheye, it is
    imaged at the pixel (fx x' + skew y' + cx, fy y' + cy), where x' and y' are
    x (1 + k₁r² + k₂r⁴ + k₃r⁶ + k₄r⁸) + t (2 p₁xy + p₂(r² + 2x²)), and likewise for y, with
    t = 1 + p₃r² + p₄r⁴.

    Attributes
    ----------
    width, height : int
        Pixels.
    fx, fy, cx, cy, skew : float
        Pixels, the first pixel's centre being 0.
    radial : tuple of 4 floats
        k₁, ..., k₄.
    tangential : tuple of 4 floats
        p₁, p₂ as OpenCV has them, which others swap; p₃, p₄.
    is_fisheye : bool
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    skew: float = 0.0
    radial: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    tangential: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    is_fisheye: bool = False

    def project(self, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the pixels at which rays (x, y, 1) are imaged."""
        if self.is_fisheye:
            away = np.hypot(x, y)
            shorter = np.divide(np.arctan(away), away, out=np.ones_like(away), where=away > 0)
            x, y = x * shorter, y * shorter
        k1, k2, k3, k4 = self.radial
        p1, p2, p3, p4 = self.tangential
        s = x**2 + y**2
        radial = 1 + s * (k1 + s * (k2 + s * (k3 + s * k4)))
        more = 1 + s * (p3 + s * p4)
        u = x * radial + more * (2 * p1 * x * y + p2 * (s + 2 * x**2))
        v = y * radial + more * (p1 * (s + 2 * y**2) + 2 * p2 * x * y)
        return self.fx * u + self.skew * v + self.cx, self.fy * v + self.cy


class Closest(NamedTuple):
    """A camera as CameraInfo has it.

    Attributes
    ----------
    intrinsics : CameraIntrinsics
    error : float
        How far it images anything from where the camera itself does, at most; pixels. 0 if it is
        the same.
    without : tuple of str
        The terms that it approximates.
    """

    intrinsics: CameraIntrinsics
    error: float = 0.0
    without: tuple[str, ...] = ()


def notes_on_approximations(images: Sequence[Closest]) -> Iterator[str]:
    """Yield a note for every set of terms that some cameras of a rig approximate."""
    errors: dict[tuple[str, ...], list[float]] = {}
    for image in images:
        if image.without:
            errors.setdefault(image.without, []).append(image.error)
    for without, pixels in errors.items():
        yield (
            f"{how_many(len(pixels), len(images))}: {' and '.join(without)}, which CameraInfo has"
            f" no place for, approximated to within {max(pixels):.2g} pixels"
        )


def closest_intrinsics(where: str, camera: BrownCamera) -> Closest:
    """Return the camera of CameraInfo's that images most nearly as another does.

    Raises
    ------
    InputError
        If that is more than half a percent of the image off.
    """
    closest = _closest(camera)
    most = _TOLERABLE * max(camera.width, camera.height)
    if not closest.error <= most:
        raise InputError(
            where,
            "a camera that sensor_msgs/CameraInfo can represent to within"
            f" {most:.2g} pixels, 0.5 % of its image",
            f"{' and '.join(closest.without)}, without which it is {closest.error:.2g} pixels off",
            "calibrate without, or export undistorted images",
        )
    return closest


@lru_cache(maxsize=4096)
def _closest(camera: BrownCamera) -> Closest:
    without = _without(camera)
    intrinsics = _exact(camera)
    if not without:
        return Closest(intrinsics)
    with np.errstate(all="ignore"):  # what is not finite is refused
        if camera.radial[3] and not camera.is_fisheye:
            intrinsics = _fitted(camera) or intrinsics
        return Closest(intrinsics, _largest_difference(camera, intrinsics), without)


def _without(camera: BrownCamera) -> tuple[str, ...]:
    p1, p2, p3, p4 = camera.tangential
    terms = {
        "a radial term of the eighth power": camera.radial[3] and not camera.is_fisheye,
        "skew": camera.skew,
        "tangential terms of a fisheye": camera.is_fisheye and (p1 or p2),
        "tangential terms of higher powers": (p1 or p2) and (p3 or p4),
    }
    return tuple(name for name, value in terms.items() if value)


def _exact(camera: BrownCamera) -> CameraIntrinsics:
    """Return the camera without the terms that have no place."""
    k1, k2, k3, k4 = camera.radial
    p1, p2, *_ = camera.tangential
    if camera.is_fisheye:
        return _intrinsics(camera, "equidistant", (k1, k2, k3, k4))
    return _intrinsics(camera, "plumb_bob", (k1, k2, p1, p2, k3))


def _intrinsics(
    camera: BrownCamera, model: str, coefficients: tuple[float, ...]
) -> CameraIntrinsics:
    return CameraIntrinsics(
        camera.width,
        camera.height,
        camera.fx,
        camera.fy,
        camera.cx,
        camera.cy,
        distortion_model=model,
        distortion=coefficients,
    )


def _fitted(camera: BrownCamera) -> CameraIntrinsics | None:
    """Return the camera with a quotient of polynomials in place of one of the eighth power.

    None if there is none.

    P(s) = 1 + k₁s + ... + k₄s⁴ is to be N(s) / D(s) with N and D of the third power: the
    coefficients that least squares give for P D = N, linear in them.
    """
    largest = _largest_square(camera)
    s = np.linspace(0.0, 1.0, _FITTED)  # of the largest
    radial = np.array(camera.radial) * largest ** np.arange(1, 5)
    powers = s[:, None] ** np.arange(1, 5)
    p = 1 + powers @ radial
    if not np.isfinite(p).all():
        return None
    columns = np.hstack([powers[:, :3], -p[:, None] * powers[:, :3]])
    weights = np.sqrt(s)[:, None]  # how far the image is from its centre
    solved, *_ = np.linalg.lstsq(weights * columns, weights[:, 0] * (p - 1), rcond=None)
    solved = solved / largest ** np.array([1, 2, 3, 1, 2, 3])
    if not (np.abs(solved) < _LARGEST).all():
        return None
    k1, k2, k3, k4, k5, k6 = solved.tolist()
    p1, p2, *_ = camera.tangential
    return _intrinsics(camera, "rational_polynomial", (k1, k2, p1, p2, k3, k4, k5, k6))


def _grid() -> tuple[FloatArray, FloatArray]:
    """Return rays (x, y, 1) in rings around the axis, a direction per column."""
    angles = np.linspace(0.0, 2 * np.pi, _DIRECTIONS, endpoint=False)
    away = np.tan(np.linspace(0.0, _WIDEST, _RINGS))[:, None]
    return away * np.cos(angles), away * np.sin(angles)


def _shown(size: BrownCamera | CameraIntrinsics, u: FloatArray, v: FloatArray) -> NDArray[np.bool_]:
    """Return which rays of the grid an image shows: up to where distortion folds back.

    Those a little outside count too, as the grid does not reach into every corner.
    """
    reach = np.hypot((u - size.cx) / size.fx, (v - size.cy) / size.fy)
    grows = np.cumprod(np.diff(reach, axis=0, prepend=-1.0) > 0, axis=0).astype(bool)
    shown: NDArray[np.bool_] = (
        grows
        & (abs(2 * u + 1 - size.width) <= _MARGIN * size.width)
        & (abs(2 * v + 1 - size.height) <= _MARGIN * size.height)
    )
    return shown


def _largest_square(camera: BrownCamera) -> float:
    """Return the largest x² + y² of a ray that the image shows."""
    x, y = _grid()
    shown = _shown(camera, *camera.project(x, y))
    return float((x**2 + y**2)[shown].max(initial=1e-6))


def _largest_difference(camera: BrownCamera, intrinsics: CameraIntrinsics) -> float:
    """Return how far apart, pixels, two cameras image a ray that either shows."""
    x, y = _grid()
    one, other = camera.project(x, y), projected(intrinsics, x, y)
    shown = _shown(camera, *one) | _shown(intrinsics, *other)
    apart = np.hypot(one[0] - other[0], one[1] - other[1])
    return float(apart[shown].max(initial=0.0)) if shown.any() else math.inf


def projected(
    intrinsics: CameraIntrinsics, x: FloatArray, y: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the pixels at which CameraInfo's camera images rays (x, y, 1), by OpenCV's formulas.

    Thin prisms are left out, which no import has.
    """
    k = intrinsics.distortion
    if intrinsics.distortion_model == "equidistant":
        away = np.hypot(x, y)
        theta = np.arctan(away)
        s = theta**2
        bent = theta * (1 + s * (k[0] + s * (k[1] + s * (k[2] + s * k[3]))))
        factor = np.divide(bent, away, out=np.ones_like(away), where=away > 0)
        u, v = x * factor, y * factor
    else:
        k1, k2, p1, p2, k3, k4, k5, k6 = (*k, *[0.0] * (8 - len(k)))
        s = x**2 + y**2
        radial = 1 + s * (k1 + s * (k2 + s * k3))
        radial = radial / (1 + s * (k4 + s * (k5 + s * k6)))
        u = x * radial + 2 * p1 * x * y + p2 * (s + 2 * x**2)
        v = y * radial + p1 * (s + 2 * y**2) + 2 * p2 * x * y
    return intrinsics.fx * u + intrinsics.cx, intrinsics.fy * v + intrinsics.cy
