# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.
"""``problem.npz`` read back, as anyone who solves it by other means would."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from focus_planner.core.problem.problem import Problem
from focus_planner.core.rig.lens import Lens
from focus_planner.core.surface.surface import Samples


def load_problem(path: Path) -> Problem:
    """Return the problem of a file that :func:`focus_planner.io.problems.save_problem` wrote.

    Of one shot per camera. Lenses with a list of distances are not in such files.
    """
    with np.load(path) as file:
        held = dict(file)
    assert held["shots"] == 1
    limits = held["min_focus"], held["max_focus"]
    of_lenses = zip(held["focal_length"], held["hyperfocal_distance"], *limits, strict=True)
    counts = np.bincount(held["sample_index"], minlength=len(held["points"]))
    return Problem(
        samples=Samples(held["points"], held["normals"], held["areas"], held["weights"]),
        names=tuple(held["camera_names"].tolist()),
        lenses=tuple(Lens(*map(float, values)) for values in of_lenses),
        sample_offsets=np.concatenate([[0], np.cumsum(counts)]),
        sample_index=held["sample_index"],
        camera_index=held["camera_index"],
        depth=held["depth"],
        base_cost=held["base_cost"],
        focus_near=held["focus_near"],
        focus_far=held["focus_far"],
        focus_weight=float(held["focus_weight"]),
    )
