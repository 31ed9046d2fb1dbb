# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Ask a running planner for a plan, as capture orchestration does before a scan.

python examples/orchestrate.py SURFACE RIG.YAML    # with `focus_planner node` in another terminal
"""

from __future__ import annotations

import sys
from typing import Any

from focus_planner import load_rig, load_surface
from focus_planner.ros.client import PlannerClient


def show(feedback: Any) -> None:
    """Print how far the planner is."""
    print(f"{feedback.stage}: cost {feedback.cost:.1f}, gap {feedback.gap:.1%}")


def main(surface: str, rig: str) -> int:
    """Publish, plan by the action, and say what is in force; return the exit status."""
    with PlannerClient("/focus_planner") as planner:
        planner.publish_rig(load_rig(rig))
        planner.publish_mesh(load_surface(surface))
        goal = planner.send_goal(show, method="optimal", samples=1000, time_budget=5.0)
        if not goal.accepted:
            print("the planner rejected the goal; ~/status says what it is doing")
            return 1
        _, result = goal.result()
        print(result.message)
        if not result.success:
            return 1
        # A scanner would now fire its cameras once every lens is verified, or accepted where the
        # driver cannot say where the lens is.
        status = planner.status()
        lenses = f"{status.verified} verified, {status.accepted} accepted"
        print(f"in force: {status.plan_id}; lenses: {lenses}")
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
