# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What would another aperture have given? Plan a recorded run again with it.

python examples/another_aperture.py RUN F_NUMBER    # a folder that --record wrote
"""

from __future__ import annotations

import sys
from pathlib import Path

from focus_planner.recording.comparison import camera_changes, median_moved
from focus_planner.recording.replay import plan_run
from focus_planner.recording.run_reading import read_run
from focus_planner.recording.what_if import parse_changes, with_changes


def main(path: str, f_number: str) -> None:
    """Print the recorded plan and the one at the other aperture."""
    run = read_run(Path(path))
    changed = with_changes(run, parse_changes([f"f_number={f_number}"]))
    # What was recorded ended where its clock said so; this one goes by its own time budget.
    before, after = run.ending.plan, plan_run(changed.run, stop_as_recorded=False).plan
    print(f"recorded:  {before.fresh_cost:.1f}, {before.in_focus_area:.2f} m² in focus")
    print(f"at f/{f_number}:  {after.fresh_cost:.1f}, {after.in_focus_area:.2f} m² in focus")
    moved = median_moved(camera_changes(before, after))
    print(f"cameras are focused {1000 * moved:.0f} mm elsewhere, in the median")
    for note in changed.notes:
        print(f"({note})")


if __name__ == "__main__":
    main(*sys.argv[1:])
