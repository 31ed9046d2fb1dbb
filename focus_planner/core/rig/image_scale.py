# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""How a change of direction moves the image of a point: the scale of pictures, distortion included.

The derivatives of OpenCV's distortion models, whose formulas are in
:func:`focus_planner.core.kernels.distort`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from focus_planner.core import kernels
from focus_planner.core.arrays import FloatArray, IntArray
from focus_planner.core.rig.distortion import frustum_and_projection
from focus_planner.core.rig.rig import Rig

# tan θ below which a fisheye's scale is that of its axis, but for 1e-8 of it.
_ON_AXIS = 1e-4


def image_jacobians(rig: Rig, camera: IntArray, rays: FloatArray) -> FloatArray:
    """Return by how many pixels images move per unit of their rays' x and y at depth 1.

    Pixels are those that are read out: binned, if the camera bins.

    Parameters
    ----------
    rig : Rig
    camera : (P,) array of int
        Index into the rig's cameras.
    rays : (P, 2) array
        x, y at depth 1, in the camera's optical frame; within what it sees.

    Returns
    -------
    (P, 2, 2) array
        Rows: column and row of the picture; columns: x and y of the ray.
    """
    images = [each.intrinsics for each in rig.cameras]
    focal = np.array([(i.fx / i.binning[0], i.fy / i.binning[1]) for i in images])
    jacobians = np.broadcast_to(np.eye(2), (len(rays), 2, 2))
    if any(image.distortion_model for image in images):
        jacobians = _distortion_jacobians(rig, camera, rays)
    scaled: FloatArray = focal[camera][:, :, None] * jacobians
    return scaled


def _distortion_jacobians(rig: Rig, camera: IntArray, rays: FloatArray) -> FloatArray:
    """Return (P, 2, 2) the derivatives of the images in focal lengths; of pinholes the identity."""
    kinds = np.full(len(rig), -1)  # none
    coefficients = np.zeros((len(rig), kernels.COEFFICIENTS))
    for c, each in enumerate(rig.cameras):
        if each.intrinsics.distortion_model:
            _, projection = frustum_and_projection(each.intrinsics)
            kinds[c], coefficients[c] = projection[0], projection[kernels.PROJECTION :]
    jacobians = np.tile(np.eye(2), (len(rays), 1, 1))
    for kind, derive in ((kernels.POLYNOMIAL, _of_polynomial), (kernels.FISHEYE, _of_fisheye)):
        part: NDArray[np.int64] = np.flatnonzero(kinds[camera] == kind)
        if len(part):
            x, y = rays[part].T
            jacobians[part] = derive(x, y, coefficients[camera[part]].T)
    return jacobians


def _of_polynomial(x: FloatArray, y: FloatArray, k: FloatArray) -> FloatArray:
    s = x * x + y * y
    above, below = (1 + s * (a + s * (b + s * c)) for a, b, c in (k[[0, 1, 4]], k[5:8]))
    above_slope, below_slope = (a + s * (2 * b + 3 * s * c) for a, b, c in (k[[0, 1, 4]], k[5:8]))
    radial = above / below
    slope = (above_slope - radial * below_slope) / below  # by r²
    prism_x, prism_y = k[8] + 2 * s * k[9], k[10] + 2 * s * k[11]
    mixed = 2 * x * y * slope + 2 * (k[2] * x + k[3] * y)
    return _matrices(
        radial + 2 * x * x * slope + 2 * k[2] * y + 6 * k[3] * x + 2 * x * prism_x,
        mixed + 2 * y * prism_x,
        mixed + 2 * x * prism_y,
        radial + 2 * y * y * slope + 6 * k[2] * y + 2 * k[3] * x + 2 * y * prism_y,
    )


def _of_fisheye(x: FloatArray, y: FloatArray, k: FloatArray) -> FloatArray:
    """Return the derivatives of g(t)·(x, y), where t = tan θ and g·t is the image's distance."""
    tangent = np.hypot(x, y)
    angle = np.arctan(tangent)
    on_axis = tangent < _ON_AXIS
    t = np.where(on_axis, 1.0, tangent)
    a = angle * angle
    distance = angle * (1 + a * (k[0] + a * (k[1] + a * (k[2] + a * k[3]))))
    by_angle = 1 + a * (3 * k[0] + a * (5 * k[1] + a * (7 * k[2] + a * 9 * k[3])))
    g = np.where(on_axis, 1.0, distance / t)
    slope = np.where(on_axis, 0.0, (by_angle / (1 + t * t) - g) / (t * t))  # g′(t) / t
    mixed = x * y * slope
    return _matrices(g + x * x * slope, mixed, mixed, g + y * y * slope)


def _matrices(xx: FloatArray, xy: FloatArray, yx: FloatArray, yy: FloatArray) -> FloatArray:
    """Return (P, 2, 2) matrices of their elements, row by row."""
    return np.stack([xx, xy, yx, yy], axis=1).reshape(-1, 2, 2)
