# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""problem.npz: the discrete problem, for anyone to check or to solve by other means."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from focus_planner.core.problem.problem import Problem
from focus_planner.core.problem.shots import with_one_shot
from focus_planner.io.files import atomic_write


def save_problem(problem: Problem, path: Path) -> None:
    """Write the problem as a compressed archive of NumPy arrays, atomically.

    N samples, C cameras, P visible pairs; metres.

    ==================== ====== ===================================================
    points               (N, 3)
    normals              (N, 3) unit length, outward
    areas                (N,)   surface area that the sample represents, m²
    weights              (N,)   area × importance relative to the greatest, m²
    sample_index         (P,)   ascending; a sample's pairs by ascending camera
    camera_index         (P,)
    depth                (P,)   d, along the optical axis
    base_cost            (P,)   cost of the pair in focus
    focus_near           (P,)   nearest focus distance that holds the pair in focus
    focus_far            (P,)   farthest such distance; (inf, -inf) if there is none
    focus_weight         ()     extra cost out of focus, w₃
    camera_names         (C,)
    focal_length         (C,)   F
    hyperfocal_distance  (C,)   H
    min_focus, max_focus (C,)   limits of the lens; max_focus may be inf
    shots                ()     focus distances per camera
    ==================== ====== ===================================================

    A pair is in focus from d(H+F)/(H+d) to d(H−F)/(H−d), unbounded above where d ≥ H. With a depth
    tolerance t these ends are evaluated at d + t and d − t. The interval is restricted to what the
    lens can be set to. A sample costs the least of its pairs over all shots, or 1 if it has no
    pair; a plan costs 1000 × the weighted mean over samples.

    Raises
    ------
    InputError
        If it cannot be written.
    """
    shots, problem = problem.shots, with_one_shot(problem)
    samples, lenses = problem.samples, problem.lenses
    with atomic_write(path) as file:
        np.savez_compressed(
            file,
            points=samples.points,
            normals=samples.normals,
            areas=samples.areas,
            weights=samples.weights,
            sample_index=problem.sample_index,
            camera_index=problem.camera_index,
            depth=problem.depth,
            base_cost=problem.base_cost,
            focus_near=problem.focus_near,
            focus_far=problem.focus_far,
            focus_weight=np.float64(problem.focus_weight),
            camera_names=np.array(problem.names),
            focal_length=np.array([lens.focal_length for lens in lenses]),
            hyperfocal_distance=np.array([lens.hyperfocal_distance for lens in lenses]),
            min_focus=np.array([lens.focus_limits[0] for lens in lenses]),
            max_focus=np.array([lens.focus_limits[1] for lens in lenses]),
            shots=np.int64(shots),
        )
