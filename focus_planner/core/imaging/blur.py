# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""How blurred a thin lens images what is off its plane of focus.

A lens of aperture diameter A, at the centre of projection, is focused at depth s. The rays that a
point at depth d sends through the aperture form a cone with the point as its tip; from a pinhole at
the centre of the aperture, the section of that cone with the plane of focus, which the sensor is
the image of, is a disc of diameter ``A |d − s| / d``. At depth s a pixel of a camera of focal
length f pixels is s / f wide, so the disc has a diameter of ::

    b = f A |1/s − 1/d|    pixels.

This is the formula of textbooks, ``A F |d − s| / (d (s − F))`` on the sensor (F the focal length,
metres), as the pixel pitch is v / f with the sensor v = s F / (s − F) behind the lens. A stop of
f-number N has A = F / N, so with the hyperfocal distance H = F² / (N c) of the paper it is H c / F;
b is the circle of confusion c exactly at D_N and D_F.
"""

from __future__ import annotations

import numpy as np

from focus_planner.core.arrays import FloatArray
from focus_planner.core.imaging.depth import DepthImage
from focus_planner.core.imaging.pixels import pixel_grid
from focus_planner.core.rig.camera import Camera
from focus_planner.core.rig.optics import aperture_diameter


def blur_diameters(
    depths: DepthImage | FloatArray, camera: Camera, focus_distance: float, scale: float = 1.0
) -> FloatArray:
    """Return the diameter of the disc as which each pixel's point is imaged.

    Parameters
    ----------
    depths : array
        d, metres along the optical axis; inf for the diameter at infinity.
    camera : Camera
        With an assumed circle of confusion where its lens has none:
        :func:`focus_planner.core.rig.optics.circle_of_confusion`.
    focus_distance : float
        s, metres; above 0.
    scale : float
        Of the picture's sides, as for the depths.

    Returns
    -------
    array
        Columns of the picture: binned, if the camera bins. At least 0.
    """
    strength = camera.intrinsics.fx / pixel_grid(camera.intrinsics, scale).pitch[0]
    inverse = 1 / np.asarray(depths, dtype=np.float64)
    blur: FloatArray = strength * aperture_diameter(camera) * np.abs(1 / focus_distance - inverse)
    return blur
