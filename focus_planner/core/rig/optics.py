# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Depth of field of a thin lens (paper, Sec. 4.2), its inverse, and distances from the sensor.

Distances are along the optical axis from the centre of projection, metres, unless a name says
otherwise.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from focus_planner.core.arrays import FloatArray
from focus_planner.core.rig.camera import Camera, CameraIntrinsics
from focus_planner.core.rig.circles import assumed_circle
from focus_planner.core.rig.lens import Lens
from focus_planner.core.rig.plausible import (
    check_circle,
    check_f_number,
    check_focal_length,
    farthest_hyperfocal,
)
from focus_planner.core.validation import InputError

_CIRCLE = "lens.circle_of_confusion"
# Rounding may leave an f-number so many neighbouring numbers away.
_ULPS = 4
_DIGITS = 17


def circle_of_confusion(camera: Camera) -> float:
    """Return the circle of confusion of a camera's lens, else the one to assume, metres.

    See :mod:`focus_planner.core.rig.circles`.
    """
    given = camera.lens.circle_of_confusion
    if given is not None:
        return given
    return assumed_circle(camera.intrinsics, camera.lens.focal_length).metres


def aperture_diameter(camera: Camera) -> float:
    """Return the aperture's diameter A = F / N = H·c / F, metres.

    See :func:`circle_of_confusion` for c.
    """
    lens = camera.lens
    return lens.hyperfocal_distance * circle_of_confusion(camera) / lens.focal_length


def hyperfocal_distance(focal_length: float, f_number: float, circle_of_confusion: float) -> float:
    """Return H = F² / (N·c), metres.

    With this H the paper's D_N and D_F are exact for a thin lens. Textbooks that define H as
    F² / (N·c) + F write the limits in terms of H − F.

    Parameters
    ----------
    focal_length, circle_of_confusion : float
        Metres.
    f_number : float

    Raises
    ------
    InputError
        If no lens has such a value, or none all of them; names these.
    """
    f = check_focal_length("lens.focal_length", focal_length)
    number = check_f_number("lens.f_number", f_number)
    circle = check_circle("lens.circle_of_confusion", circle_of_confusion)
    distance = f**2 / (number * circle)
    if not f < distance <= farthest_hyperfocal(f):
        size = "large" if distance <= f else "small"
        raise InputError(
            "lens.focal_length, lens.f_number, lens.circle_of_confusion",
            "those of one lens, in metres: a hyperfocal distance focal_length² / (f_number ·"
            f" circle_of_confusion) from {f:g} to {farthest_hyperfocal(f):.3g}",
            f"{f:g}, {number:g} and {circle:g}, which make it {distance:.3g}",
            f"the circle of confusion is probably too {size} for the focal length",
        )
    return distance


def lens_of_aperture(
    lens: Lens,
    f_number: float,
    circle: float | None,
    intrinsics: CameraIntrinsics,
    *,
    focal_length_told: bool = True,
) -> Lens:
    """Return a lens with this f-number.

    Parameters
    ----------
    lens : Lens
        Tells all but its aperture.
    f_number : float
    circle : float or None
        Its circle of confusion, metres; None for the one to assume, see
        :mod:`focus_planner.core.rig.circles`.
    intrinsics : CameraIntrinsics
        Of its camera.
    focal_length_told : bool
        Whether somebody gave the focal length; else it is the default.

    Raises
    ------
    InputError
        As :func:`hyperfocal_distance`.
    """
    f = lens.focal_length
    assumed = assumed_circle(intrinsics, f, focal_length_told=focal_length_told)
    blur = assumed.metres if circle is None else circle
    try:
        distance = hyperfocal_distance(f, f_number, blur)
    except InputError as error:
        if circle is not None or not error.argument.endswith(_CIRCLE):
            raise
        raise InputError(
            error.argument.removesuffix(_CIRCLE).removesuffix(", "),
            error.expected,
            error.got,
            f"give {_CIRCLE}, for which {blur:.3g} m is assumed, {assumed.how}",
        ) from None
    return replace(lens, hyperfocal_distance=distance, circle_of_confusion=blur)


def f_number_of(lens: Lens) -> float | None:
    """Return the f-number whose :func:`hyperfocal_distance` is the lens's own, bit for bit.

    Of several the one with the fewest digits; None if there is none, or no circle of confusion.
    """
    f, h, circle = lens.focal_length, lens.hyperfocal_distance, lens.circle_of_confusion
    if circle is None:
        return None
    about = f**2 / (h * circle)
    near = [about]
    for _ in range(_ULPS):
        near = [math.nextafter(near[0], 0.0), *near, math.nextafter(near[-1], math.inf)]
    candidates = (*(round(about, digits) for digits in range(_DIGITS)), *near)
    return next((n for n in candidates if n > 0 and f**2 / (n * circle) == h), None)


def depth_of_field(focus_distance: FloatArray, lens: Lens) -> tuple[FloatArray, FloatArray]:
    """Return the near and far limits of the depth of field at each focus distance.

    D_N = H·s / (H + s − F) and D_F = H·s / (H − s + F), infinite for s ≥ H + F.

    Parameters
    ----------
    focus_distance : (n,) array
        s, metres.
    lens : Lens

    Returns
    -------
    near, far : (n,) arrays
        Metres.
    """
    s = np.asarray(focus_distance, dtype=np.float64)
    h, f = lens.hyperfocal_distance, lens.focal_length
    room = h + f - s
    near = h * s / (h + s - f)
    far = np.where(room > 0, h * s / np.where(room > 0, room, 1.0), np.inf)
    return near, far


def distance_from_sensor(focus_distance: FloatArray, lens: Lens) -> FloatArray:
    """Return how far from the sensor plane the plane of focus is: what a focus ring is marked with.

    The plane of focus is s before the front principal plane, where the centre of projection is,
    and the sensor v behind the rear one, with 1/s + 1/v = 1/F (Gauss's lens equation; Hecht,
    Optics, Sec. 6.1). So the distance is s + v + hiatus, with v = F·s / (s − F).

    Parameters
    ----------
    focus_distance : (n,) array
        s, metres; may be inf.
    lens : Lens
        Its focal length is that of a focus at infinity: a lens that focuses by changing it is
        marked a little differently.

    Returns
    -------
    (n,) array
        Metres; inf for s = inf, and NaN for s ≤ F, of which a lens forms no image on a sensor.
    """
    s = np.asarray(focus_distance, dtype=np.float64)
    f = lens.focal_length
    room = s - f
    # F·s / (s − F) = F + F² / (s − F), which also holds at infinity.
    image = f + f * f / np.where(room > 0, room, np.nan)
    return np.where(np.isinf(s), np.inf, s + image + lens.hiatus)


def focus_interval(
    depth: FloatArray, lens: Lens, tolerance: float = 0.0
) -> tuple[FloatArray, FloatArray]:
    """Return the focus distances that hold a point at ``depth`` in focus: the inverse of D_N, D_F.

    [d(H+F) / (H+d), d(H−F) / (H−d)], unbounded above for d ≥ H, restricted to what the lens can
    be set to: for a lens with discrete distances, both ends are among them. An empty interval is
    (inf, -inf).

    Parameters
    ----------
    depth : (n,) array
        d, metres.
    lens : Lens
    tolerance : float
        t, metres: every depth from d − t to d + t must be in focus. Both ends increase with depth,
        so the interval starts where that of d + t does and ends where that of d − t does.

    Returns
    -------
    nearest, farthest : (n,) arrays
        Focus distances, metres.
    """
    d = np.asarray(depth, dtype=np.float64)
    h, f = lens.hyperfocal_distance, lens.focal_length
    back, front = d + tolerance, d - tolerance
    room = h - front
    nearest = back * (h + f) / (h + back)
    farthest = np.where(room > 0, front * (h - f) / np.where(room > 0, room, 1.0), np.inf)
    held = front > f
    return settable_interval(
        np.where(held, nearest, np.inf), np.where(held, farthest, -np.inf), lens
    )


def settable_interval(
    nearest: FloatArray, farthest: FloatArray, lens: Lens
) -> tuple[FloatArray, FloatArray]:
    """Return what the lens can be set to of each interval of focus distances.

    For a lens with discrete distances, both ends are among them.

    Parameters
    ----------
    nearest, farthest : (n,) arrays
        Metres.
    lens : Lens

    Returns
    -------
    nearest, farthest : (n,) arrays
        Metres; (inf, -inf) where nothing is left.
    """
    least, most = lens.focus_limits
    nearest = np.maximum(nearest, least)
    farthest = np.minimum(farthest, most)
    settable = lens.settable_distances
    if settable is not None:
        first = np.searchsorted(settable, nearest, side="left")
        last = np.searchsorted(settable, farthest, side="right") - 1
        nearest = np.where(first < len(settable), settable[first % len(settable)], np.inf)
        farthest = np.where(last >= 0, settable[last], -np.inf)
    empty = ~(nearest <= farthest)
    return np.where(empty, np.inf, nearest), np.where(empty, -np.inf, farthest)


def nearest_settable(distance: FloatArray, lens: Lens) -> FloatArray:
    """Return, for each distance, the nearest one that the lens can be set to.

    Parameters
    ----------
    distance : (n,) array
        Metres; may be NaN.
    lens : Lens

    Returns
    -------
    (n,) array
        Metres; the smaller of two that are equally near, NaN for NaN.
    """
    settable = lens.settable_distances
    if settable is None:
        return np.clip(distance, *lens.focus_limits)
    after = np.searchsorted(settable, distance, side="left").clip(1, max(len(settable) - 1, 1))
    before = settable[after - 1]
    after = settable[np.minimum(after, len(settable) - 1)]
    nearest = np.where(distance - before <= after - distance, before, after)
    return np.where(np.isnan(distance), np.nan, nearest)
