# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Made-up plans for lens sheets."""

from __future__ import annotations

import math
from dataclasses import replace

from focus_planner import CameraFocus, CameraStatus, FocusPlan, Shot, cylinder_rig
from focus_planner.core.notes import Note

RIG = cylinder_rig(2, 3, bottom=0.5, top=1.0)
NOTES = (
    Note("up_axis", "the surface lies on its side; y is probably up: give --up y"),
    Note("default_lens", "all cameras have the paper's lens <50 mm> & no table"),
)


def shot(distance, assigned=8, in_focus=6, **changes):
    near, far = distance - 0.01, distance + 0.02
    return replace(
        Shot(distance, near, far, assigned, in_focus, from_sensor=distance + 0.0574), **changes
    )


def camera(name, *shots, unit=None, status=None):
    """Of one that takes no picture the shot is where its lens rests."""
    main, assigned = shots[0], sum(each.assigned_samples for each in shots)
    if status is None:
        status = CameraStatus.PLANNED if assigned else CameraStatus.UNASSIGNED
    return CameraFocus(
        name=name,
        status=status,
        focus_distance=main.focus_distance,
        near_limit=main.near_limit,
        far_limit=main.far_limit,
        assigned_samples=assigned,
        in_focus_samples=sum(each.in_focus_samples for each in shots),
        shots=() if status is CameraStatus.DROPPED else shots,
        device_value=main.device_value,
        device_unit=unit,
        from_sensor=main.from_sensor,
    )


def plan(*cameras):
    """A plan for these cameras, by default one of every kind for ``RIG``."""
    return FocusPlan(
        method="k_view",
        cost=294.7,
        lower_bound=290.0,
        converged=True,
        samples=400,
        seed=0,
        depth_tolerance=0.0,
        fresh_cost=303.04,
        fresh_standard_error=3.51,
        fresh_samples=4096,
        surface_area=2.0,
        covered_area=1.9,
        in_focus_area=1.75,
        in_focus_standard_error=0.01,
        solve_seconds=0.1,
        total_seconds=0.9,
        notes=NOTES,
        cameras=cameras or _of_every_kind(),
    )


def _of_every_kind():
    names = [each.name for each in RIG.cameras]
    return (
        camera(names[0], shot(0.39)),
        camera(names[1], shot(1 / 3, 0, 0)),
        camera(names[2], shot(0.5, 0, 0), status=CameraStatus.SEES_NOTHING),
        camera(names[3], shot(12.0, 400, 400, far_limit=math.inf)),
        camera(names[4], shot(0.04, 1, 0, from_sensor=None)),
        camera(names[5], shot(0.1 + 0.2, 7, 7)),
    )


def limited():
    """A plan of four pictures for ``RIG``, two cameras of which take none."""
    cameras = list(in_steps().cameras)
    for k in (0, 3):
        resting = replace(cameras[k].shots[0], assigned_samples=0, in_focus_samples=0)
        cameras[k] = camera(
            cameras[k].name,
            resting,
            unit=cameras[k].device_unit,
            status=CameraStatus.DROPPED if k else CameraStatus.SEES_NOTHING,
        )
    cameras[0] = replace(cameras[0], shots=())
    cameras[1:3] = [replace(each, shots=each.shots[:1]) for each in cameras[1:3]]
    cameras[4] = replace(cameras[4], shots=cameras[4].shots[:1])
    return replace(plan(*cameras), images=6)


def in_steps():
    """A plan of two shots for ``RIG``, some of whose lenses have a table."""
    cameras = []
    for k, each in enumerate(RIG.cameras):
        near, far = shot(0.4 + k / 100), shot(0.6, 0, 0)
        unit = "steps" if k % 2 else None
        if unit:
            near, far = replace(near, device_value=1234.0 + k), replace(far, device_value=7.25)
        cameras.append(camera(each.name, near, far, unit=unit))
    return plan(*cameras)
