# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Values that nothing has: refused in words, or of no harm to what is computed from them."""

from __future__ import annotations

import math
from collections import Counter
from typing import Any

import numpy as np
import pytest

from focus_planner.core.rig.camera import Camera, CameraIntrinsics
from focus_planner.core.rig.distortion import corner_rays
from focus_planner.core.rig.frames import FrameTransform, FrameTree, Similarity
from focus_planner.core.rig.geometry import image_corners
from focus_planner.core.rig.lens import Lens
from focus_planner.core.rig.lens_table import LensTable
from focus_planner.core.rig.optics import (
    depth_of_field,
    distance_from_sensor,
    focus_interval,
    hyperfocal_distance,
    nearest_settable,
)
from focus_planner.core.rig.rig import Grid, Rig
from focus_planner.core.validation import InputError

ABSURD = (1e300, -1e300, 1e-300, -0.0, 0, -1, math.nan, math.inf, -math.inf, 10**400, 10**6000)
DEPTHS = np.array([0.1, 1.0, 7.5])
pytestmark = pytest.mark.filterwarnings("error")


def each_absurd(make: Any, **good: Any) -> Counter[str]:
    """Make something with each of its values absurd; count what became of it."""
    outcomes = Counter[str]()
    for name in good:
        for value in ABSURD:
            outcomes[outcome(make, **good | {name: value})] += 1
    return outcomes


def outcome(make: Any, **values: Any) -> str:
    try:
        make(**values)
    except InputError:
        return "refused"
    return "made"


def used_lens(**values: Any) -> None:
    lens = Lens(**values)
    near, far = depth_of_field(DEPTHS, lens)
    nearest, farthest = focus_interval(DEPTHS, lens)
    assert not np.isnan([*near, *far, *nearest, *farthest]).any()
    assert not np.isnan(nearest_settable(DEPTHS, lens)).any()
    distance_from_sensor(DEPTHS, lens)


def used_image(**values: Any) -> None:
    camera = Camera("a", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), CameraIntrinsics(**values))
    assert np.isfinite(corner_rays(camera.intrinsics)).all()
    assert np.isfinite(image_corners(camera, 1.0)).all()


def test_lenses() -> None:
    good = {"focal_length": 0.05, "hyperfocal_distance": 10.0, "min_focus": 0.3, "max_focus": 5.0}
    assert each_absurd(used_lens, **good, hiatus=0.0)["refused"] > 30
    assert each_absurd(used_lens, **good, focus_steps=9)["refused"] > 30
    assert each_absurd(lambda **v: used_lens(focus_distances=v.values()), a=1.0, b=2.0)["refused"]


def test_lens_tables() -> None:
    def used(step: Any, **values: Any) -> None:
        numbers = list(values.values())
        table = LensTable("steps", distances=numbers[:2], values=numbers[2:], step=step)
        used_lens(table=table)

    assert each_absurd(used, step=1.0, a=0.3, b=2.0, c=10.0, d=90.0)["refused"] > 30


@pytest.mark.parametrize("distortion", [(), (-0.1, 0.02, 0.001, -0.001, 0.0)])
def test_images(distortion: tuple[float, ...]) -> None:
    good = {"width": 580, "height": 870, "fx": 1190.7, "fy": 1190.7, "cx": 284.8, "cy": 434.4}
    made = each_absurd(
        lambda **values: used_image(
            **values, distortion=distortion, distortion_model="plumb_bob" if distortion else ""
        ),
        **good,
    )
    assert made["refused"] > 40


def test_hyperfocal_distances() -> None:
    good = {"focal_length": 0.05, "f_number": 8.0, "circle_of_confusion": 3e-5}
    assert each_absurd(hyperfocal_distance, **good) == {"refused": 3 * len(ABSURD)}


def test_grids() -> None:
    assert each_absurd(Grid, rows=2, columns=3) == {"refused": 2 * len(ABSURD)}


def test_a_name_that_occurs_twice_is_found_among_many() -> None:
    cameras = [Camera(f"c{i}", (0, 0, 0), (0, 0, 0, 1)) for i in range(2000)]
    with pytest.raises(InputError, match="unique camera names, got 'c1999' 2 times"):
        Rig((*cameras, cameras[-1]))


def chain(count: int) -> list[FrameTransform]:
    return [FrameTransform(f"f{i}", f"f{i + 1}", Similarity()) for i in range(count)]


def test_frames_are_not_any_depth_below_another() -> None:
    assert FrameTree(chain(99)).root_of("f99") == "f0"
    with pytest.raises(InputError, match="frame f101: expected at most 100 frames above it, got"):
        FrameTree(chain(5000))
    around = [*chain(5000), FrameTransform("f5000", "f0", Similarity())]
    with pytest.raises(InputError, match="frame f1: expected at most 100 frames above it"):
        FrameTree(around)
