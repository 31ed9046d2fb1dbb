# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Which pixels of a picture show the subject in focus."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from focus_planner.core.arrays import FloatArray
from focus_planner.core.imaging.blur import blur_diameters
from focus_planner.core.imaging.depth import DepthCamera, DepthImage
from focus_planner.core.imaging.resolution import fine_pixels
from focus_planner.core.planning.plan import Shot
from focus_planner.core.planning.subject import PlannedSubject
from focus_planner.core.problem.problem import Problem
from focus_planner.core.problem.shots import with_pictures
from focus_planner.core.rig.camera import Camera
from focus_planner.core.surface.resolution import metres_per_pixel
from focus_planner.masks.programs import PictureName

Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class MaskedPicture:
    """What a picture shows, pixel by pixel.

    Attributes
    ----------
    name : PictureName
    mask : (H, W) array of bool
        The subject, in focus.
    depths : (H, W) array of float32
        Metres along the optical axis; inf where the subject is not.
    blur : (H, W) array of float32, or None
        Diameter of what a point of the subject becomes, columns of the picture; NaN where the
        subject is not. None if nobody asked.
    """

    name: PictureName
    mask: Mask
    depths: DepthImage
    blur: NDArray[np.float32] | None

    @property
    def subject_pixels(self) -> int:
        """How many pixels show the subject."""
        return int(np.isfinite(self.depths).sum())

    @property
    def sharp_pixels(self) -> int:
        """How many of them are in focus."""
        return int(self.mask.sum())


def masked_pictures(
    subject: PlannedSubject,
    names: Sequence[PictureName],
    *,
    max_blur: float | None = None,
    with_blur: bool = False,
    on_progress: Callable[[int], object] = lambda _: None,
) -> Iterator[MaskedPicture]:
    """Yield what each picture of a plan shows.

    A pixel is in focus if the surface at its centre is: as far within the depth of field of the
    shot as the plan's depth tolerance asks, and imaged as finely as the plan asks, which is what
    the plan counted.

    Parameters
    ----------
    subject : PlannedSubject
    names : sequence of PictureName
        The pictures; those of a camera one after the other.
    max_blur : float, optional
        Largest diameter of blur that still counts as sharp, columns of the picture, for those who
        are stricter than the depth of field.
    with_blur : bool
        Whether to tell the blur.
    on_progress : callable, optional
        Called with the number of pictures that are done, before each.
    """
    made = DepthCamera(subject.scene)
    depths, fine, of_camera = np.empty((0, 0), np.float32), np.empty((0, 0), np.bool_), -1
    for done, name in enumerate(names):
        on_progress(done)
        camera, shot = subject.rig.cameras[name.camera], _shot(subject, name)
        if of_camera != name.camera:
            depths, of_camera = made.depths(camera), name.camera
            fine = fine_pixels(depths, camera, subject.plan.max_mm_per_pixel)
        mask = shot.holds(depths, subject.plan.depth_tolerance) & fine
        blur = None
        if with_blur or max_blur is not None:
            blur = _blur(depths, camera, shot)
        if blur is not None and max_blur is not None:
            mask &= blur <= max_blur
        yield MaskedPicture(name, mask, depths, blur if with_blur else None)


def _shot(subject: PlannedSubject, name: PictureName) -> Shot:
    return subject.plan.cameras[name.camera].shots[name.shot]


def _blur(depths: DepthImage, camera: Camera, shot: Shot) -> NDArray[np.float32]:
    diameters = blur_diameters(depths, camera, shot.focus_distance)
    return np.where(np.isfinite(depths), diameters, np.nan).astype(np.float32)


def sharp_elsewhere(
    subject: PlannedSubject, samples: int, max_blur: float | None = None
) -> float | None:
    """Return which share of the blurred pixels shows what is in focus in another picture.

    It is estimated on samples of the surface, each of which counts in every picture that shows it
    by the pixels that it takes there.

    Parameters
    ----------
    subject : PlannedSubject
    samples : int
    max_blur : float, optional
        As :func:`masked_pictures` takes it.

    Returns
    -------
    float or None
        0 to 1; None if no pixel is blurred.
    """
    # Of all that cameras see: what they image too coarsely takes pixels as well.
    request = replace(subject.request, max_mm_per_pixel=math.inf)
    problem = replace(subject, request=request).fresh_problem(samples)
    shots = subject.plan.slots
    cameras = [camera for camera in subject.rig.cameras for _ in range(subject.plan.shots)]
    problem = with_pictures(problem, np.array([shot is not None for shot in shots]))
    taken = problem.camera_index
    sharp = np.zeros(len(taken), dtype=bool)
    for i, (camera, shot) in enumerate(zip(cameras, shots, strict=True)):
        if shot is None:
            continue
        pairs = taken == i
        sharp[pairs] = shot.holds(problem.depth[pairs], subject.plan.depth_tolerance)
        if max_blur is not None:
            diameters = blur_diameters(problem.depth[pairs], camera, shot.focus_distance)
            sharp[pairs] &= diameters <= max_blur
    if math.isfinite(subject.plan.max_mm_per_pixel):
        sharp &= _fine_pairs(problem, subject)
    somewhere = np.zeros(problem.sample_count, dtype=bool)
    somewhere[problem.sample_index[sharp]] = True
    pixels = np.where(sharp, 0.0, _pixels_of_pairs(problem, cameras))
    blurred = float(pixels.sum())
    return float(pixels[somewhere[problem.sample_index]].sum()) / blurred if blurred else None


def _fine_pairs(problem: Problem, subject: PlannedSubject) -> Mask:
    """Return (P,) whether each pair is imaged as finely as the plan asks."""
    samples, index = problem.samples, problem.sample_index
    camera = problem.view[problem.camera_index]
    points, normals = samples.points[index], samples.normals[index]
    fine: Mask = 1000 * metres_per_pixel(points, normals, subject.rig, camera) <= (
        subject.plan.max_mm_per_pixel
    )
    return fine


def _pixels_of_pairs(problem: Problem, cameras: Sequence[Camera]) -> FloatArray:
    """Return (P,) how many pixels each pair's sample takes, but for distortion."""
    images = [camera.intrinsics for camera in cameras]
    per_area = np.array([i.fx * i.fy / (i.binning[0] * i.binning[1]) for i in images])
    taken, samples = problem.camera_index, problem.samples
    positions = np.array([camera.position for camera in cameras])
    views = samples.points[problem.sample_index] - positions[taken]
    facing = np.abs((samples.normals[problem.sample_index] * views).sum(axis=1))
    areas = samples.areas[problem.sample_index]
    pixels: FloatArray = per_area[taken] * areas * facing / problem.depth**3
    return pixels
