"""Fingerprints of what a plan came from, stage by stage, to tell where two runs begin to differ.

Sampling and solving repeat bit for bit wherever they run. Casting rays, and estimating a cloud's
normals, is done in single precision by code that adapts to the processor: a ray that grazes an
edge may hit on one machine and miss on another.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from hashlib import sha256
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from focus_planner.core.planning.plan import SolvedPlan
from focus_planner.core.problem.problem import Problem


@dataclass(frozen=True)
class Fingerprint:
    """What one stage came to.

    Attributes
    ----------
    stage : str
        "samples", "visibility" or "costs", of what was planned on; the same after "fresh " of what
        the plan was judged on.
    counts : tuple of int
        Of samples, one entry; of visible pairs, one entry per camera.
    digests : tuple of int
        64 bits of a hash of their bits, entry by entry.
    """

    stage: str
    counts: tuple[int, ...]
    digests: tuple[int, ...]


def fingerprints(plan: SolvedPlan) -> tuple[Fingerprint, ...]:
    """Return the fingerprints of a plan's stages, in the order in which they were done."""
    return (
        *_of_problem("fresh ", plan.fresh_problem),
        *_of_problem("", plan.problem),
    )


def _of_problem(prefix: str, problem: Problem) -> Iterator[Fingerprint]:
    samples = problem.samples
    digest = _digest(samples.points, samples.normals, samples.weights, samples.areas)
    yield Fingerprint(f"{prefix}samples", (len(samples),), (digest,))
    # Shots of a camera see the same: the first of each stands for all.
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
