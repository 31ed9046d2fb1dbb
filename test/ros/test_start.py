# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

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
