# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

import numpy as np
import pytest

from focus_planner import CameraIntrinsics
from focus_planner.core.imaging import pixels
from focus_planner.core.imaging.pixels import pixel_grid, tiles_of

SMALL = CameraIntrinsics(40, 30, 50.0, 50.0, 19.5, 14.5)


@pytest.fixture(autouse=True)
def _empty(monkeypatch):
    monkeypatch.setattr(pixels, "_kept", pixels.OrderedDict())


def test_tiles_are_kept_for_the_next_camera():
    assert tiles_of(SMALL, pixel_grid(SMALL)) is tiles_of(SMALL, pixel_grid(SMALL))


def test_what_is_kept_is_bounded_by_its_bytes(monkeypatch):
    grids = [pixel_grid(SMALL, scale) for scale in (1.0, 0.9, 0.8)]
    sizes = [tiles_of(SMALL, grid).rays.nbytes for grid in grids]
    monkeypatch.setattr(pixels, "_MOST_KEPT", sizes[1] + sizes[2])
    last = tiles_of(SMALL, grids[2])
    assert list(pixels._kept) == [(SMALL, grid) for grid in grids[1:]]
    assert tiles_of(SMALL, grids[2]) is last
    monkeypatch.setattr(pixels, "_MOST_KEPT", sizes[0] - 1)
    assert tiles_of(SMALL, grids[0]).rays.nbytes == sizes[0]  # too large, but made
    assert (SMALL, grids[0]) not in pixels._kept


@pytest.mark.parametrize("model", ["", "plumb_bob"])
def test_rays_found_in_bands_are_the_same(monkeypatch, model):
    k = (-0.2, 0.05, 1e-3, 1e-3) if model else ()
    camera = CameraIntrinsics(40, 30, 50.0, 50.0, 19.5, 14.5, distortion_model=model, distortion=k)
    whole = tiles_of(camera, pixel_grid(camera)).rays
    pixels._kept.clear()
    monkeypatch.setattr(pixels, "_BAND", 130)
    bands = tiles_of(camera, pixel_grid(camera)).rays
    np.testing.assert_allclose(bands, whole, rtol=0, atol=1e-7)
