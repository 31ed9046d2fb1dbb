import subprocess
import sys

import pytest

pytestmark = pytest.mark.processes

# Each takes a part of the three seconds in which a killed node is to have its last plan back.
HEAVY = ("matplotlib", "numba", "open3d", "scipy")


def test_the_last_plan_waits_for_nothing_that_plans():
    command = (
        "import sys, focus_planner.ros.planner_node as _;"
        f" print([m for m in {HEAVY} if m in sys.modules])"
    )
    done = subprocess.run(
        [sys.executable, "-c", command], capture_output=True, text=True, check=True
    )
    assert done.stdout == "[]\n"
