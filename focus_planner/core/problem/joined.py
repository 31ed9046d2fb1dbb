# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Several subjects in front of one rig as one discrete problem.

Their samples stand one after the other. They never hide each other: each is alone with the rig.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from focus_planner.core.arrays import FloatArray
from focus_planner.core.problem.problem import Problem, weigh_cells
from focus_planner.core.surface.surface import Samples


def join_problems(parts: Sequence[Problem], weights: Sequence[float]) -> Problem:
    """Return the problem of all subjects, whose cost is the weighted mean of their costs.

    Areas are scaled alike: what is estimated of all is that of a subject on average.

    Parameters
    ----------
    parts : sequence of Problem
        One per subject, all for the same rig, cost model, shots and views.
    weights : sequence of float
        How much each subject counts, relative to the others.
    """
    shares = np.asarray(weights, dtype=np.float64) / np.sum(weights)
    return concatenate(
        [
            replace(
                part,
                samples=replace(
                    part.samples,
                    areas=part.samples.areas * share,
                    weights=part.samples.weights * (share / part.samples.weights.sum()),
                ),
            )
            for part, share in zip(parts, shares, strict=True)
        ]
    )


def concatenate(parts: Sequence[Problem]) -> Problem:
    """Return the problem of all subjects, with the weights and areas that their samples have."""
    firsts = np.cumsum([0, *(part.sample_count for part in parts)])
    per_sample = np.concatenate([np.diff(part.sample_offsets) for part in parts])
    return replace(
        parts[0],
        samples=Samples(
            points=np.concatenate([part.samples.points for part in parts]),
            normals=np.concatenate([part.samples.normals for part in parts]),
            areas=np.concatenate([part.samples.areas for part in parts]),
            weights=np.concatenate([part.samples.weights for part in parts]),
        ),
        sample_offsets=np.concatenate([[0], np.cumsum(per_sample)]),
        sample_index=np.concatenate(
            [
                part.sample_index + np.int32(first)
                for part, first in zip(parts, firsts[:-1], strict=True)
            ]
        ),
        camera_index=np.concatenate([part.camera_index for part in parts]),
        depth=np.concatenate([part.depth for part in parts]),
        base_cost=np.concatenate([part.base_cost for part in parts]),
        focus_near=np.concatenate([part.focus_near for part in parts]),
        focus_far=np.concatenate([part.focus_far for part in parts]),
        subject_offsets=tuple(firsts.tolist()),
    )


def separated(problem: Problem) -> list[Problem]:
    """Return the problem of each subject: what :func:`concatenate` takes."""
    return [_part(problem, which) for which in problem.subjects]


def _part(problem: Problem, which: slice) -> Problem:
    low, high = problem.sample_offsets[[which.start, which.stop]]
    return replace(
        problem,
        samples=problem.samples.take(which),
        sample_offsets=problem.sample_offsets[which.start : which.stop + 1] - low,
        sample_index=problem.sample_index[low:high] - np.int32(which.start),
        camera_index=problem.camera_index[low:high],
        depth=problem.depth[low:high],
        base_cost=problem.base_cost[low:high],
        focus_near=problem.focus_near[low:high],
        focus_far=problem.focus_far[low:high],
        subject_offsets=(),
    )


def reweighted(problem: Problem, weights: FloatArray) -> Problem:
    """Return a problem with other weights of its samples, and the cells that it has.

    Parameters
    ----------
    problem : Problem
    weights : (N,) array
    """
    changed = replace(problem, samples=replace(problem.samples, weights=weights))
    changed.__dict__["cells"] = weigh_cells(changed, problem.cells)
    return changed


def costs_of_subjects(problem: Problem, costs: FloatArray) -> FloatArray:
    """Return (S,) each subject's cost, 1000 × the weighted mean, given its samples' costs.

    Parameters
    ----------
    problem : Problem
    costs : (N,) array
        As :meth:`Problem.evaluate` returns them.
    """
    weights = problem.samples.weights
    return np.array(
        [
            1000.0 * float((weights[part] * costs[part]).sum() / weights[part].sum())
            for part in problem.subjects
        ]
    )
