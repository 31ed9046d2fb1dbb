# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Place few pictures of a small object on a turntable, and list them in shooting order.

python examples/turntable.py SURFACE capture.csv    # planned as if it were 30 mm high
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

from focus_planner import (
    CameraIntrinsics,
    CostModel,
    Lens,
    Mesh,
    PlanRequest,
    Scene,
    hyperfocal_distance,
    lens_sheet,
    load_surface,
    plan_focus,
    save_lens_sheet,
    turntable_rig,
)

HEIGHT, DISTANCE = 0.030, 0.30  # of the object; of the camera from the table's axis, metres
# A macro lens of 100 mm at f/8. Half a millimetre on either side of its distance is sharp.
FOCAL_LENGTH = 0.1
LENS = Lens(FOCAL_LENGTH, hyperfocal_distance(FOCAL_LENGTH, 8, 12e-6))
VIEWS = 3  # from which photogrammetry sees each piece of surface
IMAGE = CameraIntrinsics(width=1000, height=1500, fx=9000, fy=9000, cx=499.5, cy=749.5)


def main(surface: str, capture: str) -> None:
    """Place 72 pictures at 48 poses, for photogrammetry, and save what to shoot."""
    mesh = load_surface(surface)
    assert isinstance(mesh, Mesh)
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    middle = [*((low + high) / 2)[:2], low[2]]
    scale = HEIGHT / (high[2] - low[2])
    scene = Scene(Mesh((mesh.vertices - middle) * scale, mesh.triangles))

    # One camera at three heights, the table stops 16 times a turn.
    rig = turntable_rig(
        3, 16, DISTANCE, bottom=0.004, top=0.026, one_camera=True, intrinsics=IMAGE, lens=LENS
    )
    # The paper's cost is for bodies at 0.75 m: the same for an object as much smaller and nearer.
    model = CostModel(
        projected_area_scale=(0.75 / DISTANCE) ** 2, axis_deviation_limit=0.75 * HEIGHT / 1.8
    )
    # Some poses take no picture, others up to four.
    where_they_pay = PlanRequest(samples=3000, views=VIEWS, shots=4)
    for what, request in {
        "autofocus": PlanRequest("closest", samples=3000, views=VIEWS),
        "a picture at each pose": PlanRequest(samples=3000, views=VIEWS),
        "as many where they pay": replace(where_they_pay, images=len(rig)),
        "half as many again": replace(where_they_pay, images=len(rig) * 3 // 2),
    }.items():
        plan = plan_focus(scene, rig, replace(request, bound="none"), model)
        area = next(sharp.area for sharp in plan.sharp_areas if sharp.views == VIEWS)
        share = f"{area / plan.surface_area:.0%} sharp in {VIEWS} views"
        print(f"{what}: {share}, {plan.pictures} pictures")
    save_lens_sheet(lens_sheet(plan, rig, surface=surface), Path(capture))


if __name__ == "__main__":
    main(*sys.argv[1:])
