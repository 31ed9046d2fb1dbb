# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A problem in terms of the gain of focus: the form that bounds and exact solvers work on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from focus_planner.core import kernels
from focus_planner.core.arrays import IntArray, Offsets
from focus_planner.core.brief import brief_repr
from focus_planner.core.problem.problem import Problem


@dataclass(frozen=True, eq=False)
class Gains:
    """How much each camera reduces a sample's cost by holding it in focus, in whole units.

    Gains are relative to what the last of the sample's views costs with every camera out of focus.
    A plan costs ``out`` less the sum, over the samples, of the largest gain among the cameras that
    hold it in focus. Pairs without a gain, where another camera is better even out of focus, are
    left out.

    With q views per sample a plan costs ``out`` less the sum of the q largest gains, each of
    another camera of the rig. Up to q − 1 views of a sample gain something even out of focus, since
    they cost less than its last one.

    Attributes
    ----------
    offsets : (C + 1,) array of int64
        Camera c's G pairs are ``offsets[c]`` to ``offsets[c + 1]``, samples ascending.
    sample : (G,) array of int32
    gain : (G,) array of int64
        Above 0.
    first, last : (G,) arrays of int32
        The first and last cell that holds the sample in focus, counted from the camera's first.
    cell_offsets : (C + 1,) array of int64
        Camera c's cells are ``cell_offsets[c]`` to ``cell_offsets[c + 1]``.
    most : (N,) array of int64
        Each sample's largest gain, in or out of focus; 0 if it has none.
    in_focus : int
        The gain with every sample in focus in its best cameras.
    out : int
        The cost without any gain: with one view, that with every camera out of focus.
    views : int
        How many views each sample needs, q.
    shots : int
        So many cameras, one after the other, are one view: a sample gains the same whether one or
        all of them hold it. 1 if one view is needed, since then it gains from one camera anyway.
    blurred : GainsByCamera
        Of those pairs that gain even out of focus, by how much; no pairs with one view. The gain
        of focus over that is what is left of ``gain``.
    blurred_views : BlurredViews
        The same sample by sample, with the cameras that cannot focus on it, a view each.
    seen : GainsByCamera
        The same by the first camera of each view, where pictures are limited: a view gains nothing
        without a picture. No pairs otherwise.
    images : int
        How many pictures there may be; -1 for all.
    """

    offsets: Offsets
    sample: IntArray
    gain: Offsets
    first: IntArray
    last: IntArray
    cell_offsets: Offsets
    most: Offsets
    in_focus: int
    out: int
    views: int
    shots: int
    blurred: kernels.GainsByCamera
    blurred_views: kernels.BlurredViews
    seen: kernels.GainsByCamera
    images: int = -1

    __repr__ = brief_repr

    @property
    def by_camera(self) -> kernels.GainsByCamera:
        """The pairs, as kernels take them."""
        return kernels.GainsByCamera(self.offsets, self.sample, self.gain, self.first, self.last)

    @property
    def priced(self) -> kernels.PricedPairs:
        """All that prices bound, as kernels take it."""
        return kernels.PricedPairs(
            self.by_camera,
            self.blurred,
            self.blurred_views,
            self.cell_offsets,
            self.views,
            self.shots,
        )

    @property
    def camera_count(self) -> int:
        """The number of cameras, C."""
        return len(self.offsets) - 1


def gains_of(problem: Problem, images: int | None = None) -> Gains:
    """Return the problem's gains, in O(pairs).

    Parameters
    ----------
    problem : Problem
    images : int, optional
        How many pictures there may be. Gains are then relative to samples that no camera sees.
    """
    limited = images is not None
    cells, views = problem.cells, problem.views
    shots = problem.shots if views > 1 or limited else 1
    out, most, total = np.empty((3, problem.sample_count), dtype=np.int64)
    kernels.most_gains(
        problem.pairs_by_sample, cells.focus, cells.unseen, views, shots, limited, out, most, total
    )
    gained, blurred, seen = _list(problem, out), _no_pairs(problem), _no_pairs(problem)
    blurred_views = kernels.BlurredViews(
        np.zeros(problem.sample_count + 1, dtype=np.int64), np.empty(0, dtype=np.int64)
    )
    below = out - cells.focus
    # With one view no camera out of focus costs less than the best of them.
    if views > 1 or limited:
        blurred = _list(problem, below)
    if limited:
        seen = _seen(problem, below, shots)
    elif views > 1:
        blurred_views = _blurred_views(problem, below, shots)
    return Gains(
        *gained,
        cell_offsets=cells.offsets,
        most=most,
        in_focus=int(total.sum()),
        out=views * int(out.sum()),
        views=views,
        shots=shots,
        blurred=blurred,
        blurred_views=blurred_views,
        seen=seen,
        images=-1 if images is None else images,
    )


def _no_pairs(problem: Problem) -> kernels.GainsByCamera:
    sample, first, last = np.empty((3, 0), dtype=np.int32)
    offsets = np.zeros(problem.camera_count + 1, dtype=np.int64)
    return kernels.GainsByCamera(offsets, sample, np.empty(0, dtype=np.int64), first, last)


def _seen(problem: Problem, out: Offsets, shots: int) -> kernels.GainsByCamera:
    """Return by how much each view's pairs cost less than ``out`` (N,), by its first camera."""
    cells, cameras = problem.cells, problem.camera_count
    camera = np.repeat(np.arange(cameras), np.diff(problem.camera_offsets))
    gain = out[cells.seen] - cells.seen_base
    kept = (gain > 0) & (camera % shots == 0)
    counts = np.bincount(camera[kept], minlength=cameras)
    ranges = np.zeros((2, int(counts.sum())), dtype=np.int32)
    return kernels.GainsByCamera(
        np.concatenate([[0], np.cumsum(counts)]), cells.seen[kept], gain[kept], *ranges
    )


def _list(problem: Problem, out: Offsets) -> kernels.GainsByCamera:
    """Return by how much pairs that can be in focus then cost less than ``out`` (N,)."""
    counts = np.empty(problem.camera_count, dtype=np.int64)
    kernels.count_gains(problem.pairs_by_camera, out, counts)
    offsets = np.concatenate([[0], np.cumsum(counts)])
    sample, first, last = np.empty((3, offsets[-1]), dtype=np.int32)
    gains = kernels.GainsByCamera(
        offsets, sample, np.empty(offsets[-1], dtype=np.int64), first, last
    )
    kernels.list_gains(problem.pairs_by_camera, out, gains)
    return gains


def _blurred_views(problem: Problem, out: Offsets, shots: int) -> kernels.BlurredViews:
    """Return by how much views cost less than ``out`` (N,), sample by sample."""
    gain = out[problem.sample_index] - problem.cells.base
    kept = (gain > 0) & (problem.camera_index % shots == 0)
    counts = np.bincount(problem.sample_index[kept], minlength=problem.sample_count)
    return kernels.BlurredViews(np.concatenate([[0], np.cumsum(counts)]), gain[kept])
