# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What is imported before a plan begins: what takes longer than planning had better not be."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

from focus_planner.io.bodies import bodies
from focus_planner.io.rigs import save_rig
from testing.plans import RIG

# Of Open3D, what it imports and what some plans take.
_HEAVY = ("dash", "flask", "matplotlib", "plotly", "IPython", "open3d", "pandas", "trimesh")
_SCIPY = (
    "scipy.interpolate",
    "scipy.linalg.lapack",
    "scipy.ndimage",
    "scipy.optimize",
    "scipy.spatial",
    "scipy.sparse",
)
_PRINT = "; import json; print(json.dumps(sorted(sys.modules)))"

pytestmark = pytest.mark.processes


def imported(program):
    command = [sys.executable, "-c", f"import sys; {program}{_PRINT}"]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    return set(json.loads(done.stdout.splitlines()[-1]))


def test_a_plan_for_a_mesh_imports_nothing_that_takes_longer(tmp_path):
    save_rig(RIG, tmp_path / "rig.yaml")
    arguments = ["plan", str(bodies()[0]), "--rig", str(tmp_path / "rig.yaml"), "--samples", "200"]
    arguments += ["--output", str(tmp_path / "plan.json"), "--quiet"]
    modules = imported(f"from focus_planner.cli.main import main; main({arguments!r})")
    assert "numba" in modules
    assert not modules & {*_HEAVY, *_SCIPY}


def test_a_node_imports_no_solver(tmp_path):
    modules = imported("import focus_planner.ros.planner_node")
    assert "rclpy" in modules
    assert not modules & {*_HEAVY, *_SCIPY, "scipy", "numba"}


def test_a_process_that_plans_for_a_node_imports_no_drawing():
    modules = imported("import focus_planner.runtime.planning_process")
    assert "numba" in modules
    assert not modules & {*_HEAVY, *_SCIPY}


def test_a_plan_for_a_cloud_does_not_import_what_open3d_draws_with():
    program = (
        "import numpy as np; from focus_planner.core.surface.open3d import estimated_normals;"
        " estimated_normals(np.eye(3), 3)"
    )
    modules = imported(program)
    assert "open3d" in modules
    assert not modules & set(_HEAVY) - {"open3d"}


def test_open3d_draws_for_who_wants_it_to():
    program = (
        "from focus_planner.core.surface.open3d import open3d;"
        " assert callable(open3d().visualization.draw_plotly)"
    )
    assert "plotly" in imported(program)
