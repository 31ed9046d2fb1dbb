"""problem.npz: the discrete problem, for anyone to check or to solve with other means."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from focus_planner.core.problem.problem import Problem
from focus_planner.core.problem.shots import with_one_shot
from focus_planner.io.files import whole_file


def save_problem(problem: Problem, path: Path) -> None:
    """Write the problem as a compressed archive of NumPy arrays, whole or not at all.

    N samples, C cameras, P visible pairs; metres.

    ==================== ====== ===================================================
    points               (N, 3)
    normals              (N, 3) unit length, outward
    areas                (N,)   surface area that the sample stands for, m²
    weights              (N,)   what it counts: area × importance, the greatest being 1
    sample_index         (P,)   samples ascending, and a sample's cameras
    camera_index         (P,)
    depth                (P,)   d, along the optical axis
    base_cost            (P,)   what the pair costs in focus
    focus_near           (P,)   from here the camera's focus distances hold the pair in focus
    focus_far            (P,)   to here; where none does from inf to -inf
    focus_weight         ()     what it costs more out of focus
    camera_names         (C,)
    focal_length         (C,)   F
    hyperfocal_distance  (C,)   H
    min_focus, max_focus (C,)   what the lens can be set to; max_focus may be inf
    shots                ()     how many focus distances each camera has
    ==================== ====== ===================================================

    A pair is in focus from d(H+F)/(H+d) to d(H−F)/(H−d), without an end where d ≥ H, each for the
    depth that the depth tolerance makes it, cut to what the lens can be set to: where it takes
    certain distances only, to those. A sample costs the least of its pairs over all shots, or 1
    without any; a plan 1000 × the weighted mean.

    Raises
    ------
    InputError
        If it cannot be written.
    """
    shots, problem = problem.shots, with_one_shot(problem)
    samples, lenses = problem.samples, problem.lenses
    with whole_file(path) as file:
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
