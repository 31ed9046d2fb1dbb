# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Pictures of what every camera of the paper's rig sees, at full resolution."""

from __future__ import annotations

import time

import numpy as np
from rich.console import Console

from focus_planner import PlanRequest, Scene, cylinder_rig, plan_focus
from focus_planner.core.imaging.exposure import PictureCamera
from focus_planner.core.planning.subject import PlannedSubject
from focus_planner.io.bodies import body
from focus_planner.io.surfaces import load_surface
from focus_planner.preview.pictures import thumbnails

# Seconds, for all cameras, on two cores.
_ALLOWED = 60.0


def run(console: Console) -> bool:
    """Measure pictures and thumbnails; return whether they are as fast as they have to be."""
    scene, rig, request = Scene(load_surface(body("arms_out"))), cylinder_rig(), PlanRequest()
    plan = plan_focus(scene, rig, request)
    subject = PlannedSubject(scene, rig, request, plan)
    view = PictureCamera(scene)
    view.picture(rig.cameras[0], 1.0)  # compiles
    wall, cpu, covered = time.perf_counter(), time.process_time(), []
    for camera, focus in zip(rig.cameras, plan.cameras, strict=True):
        view.picture(camera, focus.focus_distance)
    wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
    covered = [np.isfinite(view.depths(camera)).mean() for camera in rig.cameras]
    console.print(
        f"{len(rig)} pictures of 580 × 870, {np.mean(covered):.0%} of their pixels the body's:"
        f" {wall:.1f} s, {cpu:.1f} s of processor time (at most {_ALLOWED:g} s)"
    )
    began = time.perf_counter()
    sizes = [len(each) for each in thumbnails(subject, plan)]
    console.print(
        f"{len(sizes)} thumbnails of 320 pixels: {time.perf_counter() - began:.1f} s,"
        f" {sum(sizes) / 1e6:.2f} MB"
    )
    return wall <= _ALLOWED
