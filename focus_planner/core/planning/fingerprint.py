# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Fingerprints of a plan's stages, which show where two runs begin to differ.

Sampling and solving repeat bit for bit on every machine. Ray casting and the estimation of a
cloud's normals run in single precision, in code that adapts to the processor: a ray that grazes
an edge may hit on one machine and miss on another.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from hashlib import sha256
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from focus_planner.core.brief import brief_repr
from focus_planner.core.planning.plan import SolvedPlan

if TYPE_CHECKING:
    # Its import takes seconds, and a node, which has planning done elsewhere, does without.
    from focus_planner.core.problem.problem import Problem


@dataclass(frozen=True)
class Fingerprint:
    """The result of one stage.

    Attributes
    ----------
    stage : str
        "samples", "visibility" or "costs" of the problem that was solved; prefixed with "fresh "
        for the problem on the fresh samples.
    counts : tuple of int
        The number of samples, or the numbers of visible pairs, one per camera.
    digests : tuple of int
        For each count, 64 bits of a hash of what was counted.
    """

    stage: str
    counts: tuple[int, ...]
    digests: tuple[int, ...]

    __repr__ = brief_repr


def fingerprints(plan: SolvedPlan) -> tuple[Fingerprint, ...]:
    """Return the fingerprints of a plan's stages, in the order of the stages."""
    return (
        *_of_problem("fresh ", plan.fresh_problem),
        *_of_problem("", plan.problem),
    )


def _of_problem(prefix: str, problem: Problem) -> Iterator[Fingerprint]:
    samples = problem.samples
    digest = _digest(samples.points, samples.normals, samples.weights, samples.areas)
    yield Fingerprint(f"{prefix}samples", (len(samples),), (digest,))
    # All shots of a camera see the same, so the first stands for all.
    pairs = np.flatnonzero(problem.camera_index % problem.shots == 0)
    pairs = pairs[np.argsort(problem.camera_index[pairs], kind="stable")]
    cameras = np.arange(0, problem.camera_count + problem.shots, problem.shots)
    runs = list(pairwise(np.searchsorted(problem.camera_index[pairs], cameras).tolist()))
    counts = tuple(high - low for low, high in runs)
    seen = problem.sample_index[pairs]
    costs = np.stack(
        [problem.depth, problem.base_cost, problem.focus_near, problem.focus_far], axis=1
    )[pairs]
    for stage, values in (("visibility", seen), ("costs", costs)):
        digests = tuple(_digest(values[low:high]) for low, high in runs)
        yield Fingerprint(f"{prefix}{stage}", counts, digests)


def _digest(*arrays: NDArray[Any]) -> int:
    hashed = sha256()
    for array in arrays:
        little_endian = array.astype(array.dtype.newbyteorder("<"), copy=False)
        hashed.update(np.ascontiguousarray(little_endian).data)
    return int.from_bytes(hashed.digest()[:8], "little")
