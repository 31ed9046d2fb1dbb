# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Plan the focus of a rig for a surface from a file, and save the plan.

python examples/plan_a_file.py SURFACE RIG.YAML PLAN.JSON
"""

from __future__ import annotations

import sys
from pathlib import Path

from focus_planner import PlanRequest, Scene, load_rig, load_surface, plan_focus, save_plan


def main(surface: str, rig: str, output: str) -> None:
    """Plan and save; print what every camera is to do."""
    scene = Scene(load_surface(surface))
    plan = plan_focus(scene, load_rig(rig), PlanRequest(samples=4096, seed=1))
    save_plan(plan, Path(output))
    print(plan.summary())
    for camera in plan.cameras:
        # Drivers take the first; on a focus ring the second is marked.
        distances = f"{camera.focus_distance:.3f} m, {camera.from_sensor:.3f} m from the sensor"
        sharp = f"sharp from {camera.near_limit:.3f} to {camera.far_limit:.3f} m"
        print(f"{camera.name}: {distances}, {sharp}, {camera.status.name}")


if __name__ == "__main__":
    main(*sys.argv[1:])
