# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The same samples before the same cameras with other lenses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from focus_planner.core.problem.cells import group_by_lens
from focus_planner.core.problem.problem import Problem
from focus_planner.core.rig.diffraction import sharp_interval
from focus_planner.core.rig.lens import Lens
from focus_planner.core.rig.optics import focus_interval


def with_lenses(problem: Problem, lenses: tuple[Lens, ...], wavelength: float = 0.0) -> Problem:
    """Return the problem with other lenses of the same focal lengths.

    Parameters
    ----------
    problem : Problem
        Without a depth tolerance.
    lenses : tuple of Lens
        One per camera of the problem.
    wavelength : float
        Metres; above 0, what diffraction of this light blurs is not in focus:
        :mod:`focus_planner.core.rig.diffraction`. The lenses then have circles of confusion.
    """
    near, far = np.empty((2, len(problem.depth)))
    for lens, part in group_by_lens(lenses, problem.camera_index):
        depth = problem.depth[part]
        if wavelength > 0:
            near[part], far[part] = sharp_interval(depth, lens, wavelength)
        else:
            near[part], far[part] = focus_interval(depth, lens)
    return replace(problem, lenses=lenses, focus_near=near, focus_far=far)
