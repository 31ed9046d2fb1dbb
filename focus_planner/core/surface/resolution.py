# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""How finely cameras image a surface: what a pixel covers on it.

A pixel covers, to first order, a parallelogram on the tangent plane of the point that it shows; all
points that are imaged within one pixel of the point's image form an ellipse there. Its longer
half-axis is the length per pixel: in no direction along the surface do pixels lie farther apart.
For a pinhole that is d / f on a plane parallel to the picture at depth d, and on its axis
d / (f cos θ) on one tilted by θ: what photogrammetry calls the ground sample distance of an oblique
view.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from focus_planner.core.arrays import FloatArray, IntArray
from focus_planner.core.rig.geometry import camera_positions, camera_rotations
from focus_planner.core.rig.image_scale import image_jacobians
from focus_planner.core.rig.rig import Rig
from focus_planner.core.surface.surface import Samples
from focus_planner.core.surface.visibility import Visibility

# Pairs at once, to bound memory: some 500 bytes each.
_BLOCK = 400_000


def metres_per_pixel(
    points: FloatArray, normals: FloatArray, rig: Rig, camera: IntArray
) -> FloatArray:
    """Return what a pixel covers along the surface where it covers most.

    Parameters
    ----------
    points, normals : (P, 3) arrays
        In the rig's frame, metres; normals of unit length, outward or inward.
    rig : Rig
    camera : (P,) array of int
        The camera that sees each point, as index into the rig's cameras.

    Returns
    -------
    (P,) array
        Metres per pixel that is read out; inf where the surface is seen edge-on.
    """
    rotations = camera_rotations(rig)[camera]
    seen = np.einsum("pi,pij->pj", points - camera_positions(rig)[camera], rotations)
    normal = np.einsum("pi,pij->pj", normals, rotations)
    depth = seen[:, 2]
    rays = np.column_stack([seen[:, :2] / depth[:, None], np.ones(len(depth))])
    jacobians = image_jacobians(rig, camera, rays[:, :2])
    with np.errstate(divide="ignore", invalid="ignore"):
        # The ray (x, y, 1) meets the tangent plane at z (x, y, 1), with z ∝ 1 / (normal · ray):
        # what the plane's point moves by as x does, and as y does.
        recede = normal[:, :2] / (normal * rays).sum(axis=1)[:, None]
        by_ray = depth[:, None, None] * (np.eye(3)[:, :2] - rays[:, :, None] * recede[:, None, :])
        by_pixel = by_ray @ _inverses(jacobians)
        lengths = longest_axes(by_pixel)
    return np.where(np.isnan(lengths), np.inf, lengths)


def pairs_metres_per_pixel(visibility: Visibility, samples: Samples, rig: Rig) -> FloatArray:
    """Return (P,) how finely each pair's camera images its sample, metres per pixel.

    Parameters
    ----------
    visibility : Visibility
    samples : Samples
        Those in ``visibility.taken``.
    rig : Rig
    """
    camera = pair_cameras(visibility)
    lengths = np.empty(len(camera))
    for low in range(0, len(camera), _BLOCK):
        part = slice(low, low + _BLOCK)
        sample = visibility.sample_index[part]
        points, normals = samples.points[sample], visibility.normals[sample]
        lengths[part] = metres_per_pixel(points, normals, rig, camera[part])
    return lengths


def pair_cameras(visibility: Visibility) -> IntArray:
    """Return (P,) the camera of each pair."""
    counts = np.diff(visibility.camera_offsets)
    return np.repeat(np.arange(len(counts), dtype=np.int32), counts)


def only_pairs(visibility: Visibility, kept: NDArray[np.bool_]) -> Visibility:
    """Return the visibility without the pairs that are not kept, (P,) truths."""
    cameras = len(visibility.camera_offsets) - 1
    counts = np.bincount(pair_cameras(visibility)[kept], minlength=cameras)
    return Visibility(
        np.concatenate([np.zeros(1, dtype=np.int64), np.cumsum(counts)]),
        visibility.sample_index[kept],
        visibility.normals,
        visibility.taken,
    )


def longest_axes(columns: FloatArray) -> FloatArray:
    """Return (P,) the longer half-axes of ellipses: the greatest singular values of (P, 3, 2)."""
    first, second = columns[:, :, 0], columns[:, :, 1]
    one, other = (first * first).sum(axis=1), (second * second).sum(axis=1)
    mixed = (first * second).sum(axis=1)
    longest: FloatArray = np.sqrt((one + other + np.hypot(one - other, 2 * mixed)) / 2)
    return longest


def _inverses(matrices: FloatArray) -> FloatArray:
    """Return the inverses of (P, 2, 2) matrices; of singular ones, what is not finite."""
    (a, b), (c, d) = np.moveaxis(matrices, 0, -1)
    adjugates = np.stack([d, -b, -c, a], axis=1).reshape(-1, 2, 2)
    inverses: FloatArray = adjugates / (a * d - b * c)[:, None, None]
    return inverses
