# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Plan a rig for photogrammetry, which needs each piece of surface sharp in three views or more.

python examples/photogrammetry.py RIG.YAML SURFACE plan.json
"""

from __future__ import annotations

import sys
from pathlib import Path

from focus_planner import PlanRequest, Scene, load_rig, load_surface, plan_focus, save_plan


def main(rig_file: str, surface_file: str, plan_file: str) -> None:
    """Save a plan for three views, and print what it is worth beside autofocus and one for one."""
    scene, rig = Scene(load_surface(surface_file)), load_rig(rig_file)
    for what, request in {
        "autofocus": PlanRequest("closest", bound="none"),
        "planned for one view": PlanRequest(bound="none"),
        "planned for three": PlanRequest(views=3),
    }.items():
        plan = plan_focus(scene, rig, request)
        shares = ", ".join(
            f"{sharp.area / plan.surface_area:.0%} in {sharp.views}" for sharp in plan.sharp_areas
        )
        print(f"{what}: sharp in so many views or more: {shares}")
    assert plan.gap is not None
    print(f"within {plan.gap:.1%} of the best plan for three")
    save_plan(plan, Path(plan_file))


if __name__ == "__main__":
    main(*sys.argv[1:])
