# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Pictures of what cameras will see, focused as a plan has it."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from focus_planner.core.imaging.exposure import PictureCamera
from focus_planner.core.imaging.pixels import pixel_grid
from focus_planner.core.imaging.resolution import fine_pixels
from focus_planner.core.planning.plan import FocusPlan
from focus_planner.core.planning.subject import PlannedSubject
from focus_planner.core.rig.camera import Camera
from focus_planner.core.rig.circles import assumed_circle, circles_in_words
from focus_planner.core.rig.rig import Rig
from focus_planner.core.surface.appearance import Colours
from focus_planner.core.validation import InputError

try:
    from PIL import Image
except ImportError as error:
    raise InputError(
        "preview",
        "Pillow to write pictures with",
        str(error),
        "install it: pip install 'focus_planner[picture]'",
    ) from error

# Rays of small pictures, relative to as many as leave no grain: so small, hardly any shows.
_DENSITY = 0.3
# WebP: quality out of 100, and how hard to try, out of 6.
_QUALITY, _EFFORT = 80, 2


@dataclass(frozen=True, eq=False)
class Preview:
    """What a camera sees in one shot.

    Attributes
    ----------
    image : (H, W, 3) array of uint8
        As sRGB.
    camera, method : str
    shot, shots : int
        Which one, from 1, and of how many.
    focus_distance : float
        Metres.
    in_focus : float
        The share of the subject's pixels that are in focus, as far within the depth of field as the
        plan's depth tolerance asks, and imaged as finely as it asks; NaN if it is not in the
        picture.
    """

    image: Colours
    camera: str
    method: str
    shot: int
    shots: int
    focus_distance: float
    in_focus: float


def previews(
    view: PictureCamera, camera: Camera, plan: FocusPlan, index: int, scale: float = 1.0
) -> Iterator[Preview]:
    """Yield what a camera sees in each of its shots.

    Parameters
    ----------
    view : PictureCamera
    camera : Camera
    plan : FocusPlan
    index : int
        Which of the plan's cameras it is.
    scale : float
        Of the picture's sides.
    """
    depths = view.depths(camera, scale)
    there = np.isfinite(depths)
    seen, fine = depths[there], fine_pixels(depths, camera, plan.max_mm_per_pixel, scale)[there]
    shots = plan.cameras[index].shots
    for number, shot in enumerate(shots, 1):
        sharp = shot.holds(seen, plan.depth_tolerance) & fine
        yield Preview(
            view.picture(camera, shot.focus_distance, scale),
            camera.name,
            plan.method,
            number,
            len(shots),
            shot.focus_distance,
            float(sharp.mean()) if len(seen) else np.nan,
        )


def thumbnails(
    subject: PlannedSubject,
    plan: FocusPlan,
    longest_side: int = 320,
    on_progress: Callable[[float], object] = lambda _: None,
) -> Iterator[bytes]:
    """Yield a small picture of what each camera sees, as WebP, in the rig's order.

    With several shots it is that of the shot with the most samples.

    Parameters
    ----------
    subject : PlannedSubject
    plan : FocusPlan
        For this subject, by any method.
    longest_side : int
        Pixels; a camera with fewer has a picture of its own size.
    on_progress : callable, optional
        Called with the share that is done, from 0 to 1.
    """
    view = PictureCamera(subject.scene)
    for number, (camera, focus) in enumerate(zip(subject.rig.cameras, plan.cameras, strict=True)):
        on_progress(number / len(subject.rig))
        scale = fitting_scale(camera, longest_side)
        picture = view.picture(camera, focus.focus_distance, scale, _DENSITY)
        content = io.BytesIO()
        Image.fromarray(picture).save(content, "WEBP", quality=_QUALITY, method=_EFFORT)
        yield content.getvalue()
    on_progress(1.0)


def fitting_scale(camera: Camera, longest_side: int) -> float:
    """Return the scale of a picture whose longer side has this many pixels, at most 1."""
    grid = pixel_grid(camera.intrinsics)
    return min(longest_side / max(grid.width, grid.height), 1.0)


def note_on_circles(rig: Rig) -> str:
    """Return what was assumed of the blur of lenses without a circle of confusion; "" for none."""
    circles = [
        assumed_circle(camera.intrinsics, camera.lens.focal_length)
        for camera in rig.cameras
        if camera.lens.circle_of_confusion is None
    ]
    if not circles:
        return ""
    return f"{circles_in_words(circles, len(rig))}; the blur in pictures is proportional to it"
