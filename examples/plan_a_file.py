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
