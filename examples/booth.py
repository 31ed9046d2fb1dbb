# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Plan once for everybody who comes to a booth, and tape the lenses.

python examples/booth.py RIG.YAML VISITOR PERSON PERSON [PERSON ...]

The plan is for the persons together. The visitor is one more, of whom it knows nothing.
"""

from __future__ import annotations

import sys
from pathlib import Path

from focus_planner import PlanRequest, Rig, Scene, Subject, load_rig, load_surface, plan_focus
from focus_planner.core.planning.formulation import formulate_problem
from focus_planner.core.planning.quality import estimate_quality

REQUEST = PlanRequest(samples=2048)


def in_focus(visitor: Scene, rig: Rig, method: str) -> float:
    """Return the share in focus with a plan for the visitor alone."""
    plan = plan_focus(visitor, rig, PlanRequest(method, samples=REQUEST.samples, bound="none"))
    return plan.in_focus_area / plan.surface_area


def main(rig_file: str, visitor_file: str, *persons: str) -> None:
    """Print what the taped plan is worth for each, and for the visitor."""
    rig, visitor = load_rig(rig_file), Scene(load_surface(visitor_file))
    subjects = [Subject(Scene(load_surface(file)), Path(file).stem) for file in persons]
    taped = plan_focus(subjects, rig, REQUEST)
    for subject in taped.subjects:
        share = subject.in_focus_area / subject.surface_area
        worst = ", the worst" if subject is taped.worst else ""
        print(f"{subject.surface}: {share:.0%} in focus{worst}")

    fresh = formulate_problem(visitor, rig, REQUEST, fresh=True)
    quality = estimate_quality(fresh, taped.focus_distances)
    print(f"the visitor, taped: {quality.in_focus_area.value / visitor.area:.0%} in focus")
    print(f"the visitor, autofocus: {in_focus(visitor, rig, 'closest'):.0%} in focus")
    print(f"the visitor, own plan: {in_focus(visitor, rig, 'k_view'):.0%} in focus")


if __name__ == "__main__":
    main(*sys.argv[1:])
