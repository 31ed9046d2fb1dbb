# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from focus_planner.core.rig.camera import Camera, CameraIntrinsics
from focus_planner.core.validation import InputError
from focus_planner.io.rig_files.camera_models import (
    BrownCamera,
    closest_intrinsics,
    notes_on_approximations,
    projected,
)
from testing.projection import imaged

PLAIN = BrownCamera(1200, 900, 1400.0, 1390.0, 603.0, 441.0)
BENT = replace(PLAIN, radial=(-0.2, 0.06, -0.01, 0.0), tangential=(0.002, -0.001, 0.0, 0.0))
RAYS = np.random.default_rng(5).uniform(-1, 1, (500, 2)) * [0.42, 0.31]
FAR = {
    "eighth power": replace(BENT, radial=(-0.2, 0.06, -0.01, 0.004)),
    "skew": replace(BENT, skew=0.7),
    "both": replace(BENT, radial=(-0.2, 0.06, -0.01, 0.004), skew=-0.7),
    "higher": replace(BENT, tangential=(0.002, -0.001, 0.3, 0.1)),
    "fisheye": replace(BENT, tangential=(2e-4, 3e-4, 0.0, 0.0), is_fisheye=True),
}


def by_opencv(intrinsics: CameraIntrinsics) -> np.ndarray:
    camera = Camera("a", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), intrinsics)
    return imaged(camera, np.column_stack([RAYS, np.ones(len(RAYS))]))


@pytest.mark.parametrize(
    "camera",
    [PLAIN, BENT, replace(PLAIN, radial=(-0.02, 0.01, -0.003, 0.001), is_fisheye=True)],
    ids=["pinhole", "distorted", "fisheye"],
)
def test_what_has_a_place_is_the_same(camera: BrownCamera) -> None:
    closest = closest_intrinsics("here", camera)
    assert (closest.error, closest.without) == (0.0, ())
    assert list(notes_on_approximations([closest])) == []
    expected = np.column_stack(camera.project(*RAYS.T))
    np.testing.assert_allclose(by_opencv(closest.intrinsics), expected, atol=1e-9)
    found = np.column_stack(projected(closest.intrinsics, *RAYS.T))
    np.testing.assert_allclose(found, expected, atol=1e-9)


@pytest.mark.parametrize("camera", FAR.values(), ids=FAR.keys())
def test_no_ray_is_farther_off_than_is_told(camera: BrownCamera) -> None:
    closest = closest_intrinsics("here", camera)
    expected = np.column_stack(camera.project(*RAYS.T))
    off = np.linalg.norm(by_opencv(closest.intrinsics) - expected, axis=1)
    inside = ((expected > -0.5) & (expected < [1199.5, 899.5])).all(axis=1)
    assert 0 < off[inside].max() <= closest.error < 1.2
    (note,) = notes_on_approximations([closest])
    assert note.endswith(f"approximated to within {closest.error:.2g} pixels")


def test_a_fit_is_much_closer_than_no_term_at_all() -> None:
    fitted = closest_intrinsics("here", FAR["eighth power"])
    assert fitted.intrinsics.distortion_model == "rational_polynomial"
    assert fitted.error < 0.01


def test_cameras_that_are_off_differently_share_a_note() -> None:
    skewed = [closest_intrinsics("here", replace(PLAIN, skew=skew)) for skew in (0, 1.5, 9, 4)]
    both = closest_intrinsics("here", replace(FAR["eighth power"], skew=1.0))
    skew, eighth = notes_on_approximations([*skewed, both])
    assert skew == (
        "3 of 5 cameras: skew, which CameraInfo has no place for, approximated to within"
        f" {skewed[2].error:.2g} pixels"
    )
    assert eighth.startswith("1 of 5 cameras: a radial term of the eighth power and skew, which")


@pytest.mark.parametrize("skew", [60.0, 1e30, -1e300])
def test_what_is_too_far_off_is_refused(skew: float) -> None:
    with pytest.raises(InputError, match=r"here: expected a camera .* within 6 pixels, 0\.5 %"):
        closest_intrinsics("here", replace(PLAIN, skew=skew))
