# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""``import focus_planner``: what it offers, and what it costs."""

from __future__ import annotations

import subprocess
import sys

import pytest

import focus_planner


def test_dir_lists_the_public_names() -> None:
    assert dir(focus_planner) == sorted(focus_planner.__all__)


@pytest.mark.parametrize("name", focus_planner.__all__)
def test_every_public_name_is_there(name: str) -> None:
    assert getattr(focus_planner, name).__name__ == name


def test_another_name_is_not() -> None:
    with pytest.raises(AttributeError, match="'focus_planner' has no attribute 'plan_focuss'"):
        _ = focus_planner.plan_focuss


@pytest.mark.processes
def test_files_are_read_and_written_without_loading_what_plans() -> None:
    program = (
        "import sys\n"
        "from focus_planner import Lens, load_rig, load_surface, save_plan\n"
        "print(*sys.modules.keys() & {'numba', 'open3d', 'rclpy'})"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == ""
