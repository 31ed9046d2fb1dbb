# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The subjects of recorded runs."""

from __future__ import annotations

from pathlib import Path

from focus_planner.core.rig.rig import Rig
from focus_planner.core.surface.surface import Surface
from focus_planner.core.validation import InputError
from focus_planner.recording.replay import feed
from focus_planner.recording.run_reading import read_run
from focus_planner.runtime.log import SilentLog
from focus_planner.runtime.planner import Planner


def subjects_in_run(path: Path) -> tuple[dict[str, Surface], Rig]:
    """Return the surfaces of a run by their names in it, and its rig.

    Parameters
    ----------
    path : Path
        The run's folder, or its MCAP file.

    Raises
    ------
    InputError
        If it is no run, or has no surface, or no rig.
    """
    run = read_run(path)
    planner = Planner(SilentLog())
    feed(planner, run)
    rig = planner.rig.in_force
    for what, slot in (("surface", planner.surface), ("rig", planner.rig)):
        if slot.in_force is None:
            raise InputError(str(path), f"a run with a {what}", f"{slot.objection()}")
    assert rig is not None
    subjects = planner.subjects(run.beginning.subjects)
    return {each.name: each.scene.surface for each in subjects}, rig.value
