# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A scene to plan for, and what tests ask of its plans."""

from __future__ import annotations

import dataclasses

import numpy as np

from focus_planner.core.surface.scene import Scene
from testing import reference
from testing.problems import around, looking_at, torus

SCENE = Scene(torus(0.4, 0.15))
RIG = around(6, 1.0)

_NOT_THE_PLAN = {
    *("solve_seconds", "total_seconds"),
    *("problem", "fresh_problem", "prices", "stop_log"),
}


def away(name="away", **changes):
    """A camera that sees nothing of the scene."""
    return looking_at(name, (1.0, 0, 0), (2.0, 0, 0), **changes)


def distances(plan):
    """(C,) the cameras' focus distances, metres."""
    return np.array([camera.focus_distance for camera in plan.cameras])


def without_seconds(plan):
    """All values of a plan that are the same whenever it is made."""
    values = {field.name: getattr(plan, field.name) for field in dataclasses.fields(plan)}
    return {name: value for name, value in values.items() if name not in _NOT_THE_PLAN}


def assigned_and_sharp(samples, visible, focus, model, rig=RIG):
    """Per camera the samples that it images best, and those of them in focus, from Eq. 1 alone."""
    assigned, sharp = [0] * len(rig), [0] * len(rig)
    for p, (point, normal) in enumerate(zip(samples.points, samples.normals, strict=True)):
        costs = {
            c: reference.pointwise_cost(point, normal, camera, focus[c], model)
            for c, camera in enumerate(rig.cameras)
            if (p, c) in visible
        }
        if costs:
            best = min(costs, key=costs.get)
            camera = rig.cameras[best]
            depth = (point - camera.position) @ reference.camera_axes(camera)[2]
            assigned[best] += 1
            sharp[best] += reference.in_focus(depth, focus[best], camera.lens)
    return assigned, sharp
