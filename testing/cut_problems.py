# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.
"""Problems that prices alone do not solve, because cameras overlap in odd cycles."""

from __future__ import annotations

import numpy as np
from scipy.optimize import linprog
from scipy.sparse import lil_array

from focus_planner.core import kernels
from focus_planner.core.problem.gains import Gains
from testing import reference

UNIT = 2**20


def ring(cameras, copies=1):
    """Cameras in a ring, each with two cells; each gains from what it shares in the first only.

    Every two neighbours share a sample, and every camera alone has one in its second cell; all gain
    ``UNIT``. ``copies`` is how many samples each of these stands for.
    """
    rows = []
    for c in range(cameras):
        for copy in range(copies):
            both = (c * copies + copy, ((c - 1) % cameras) * copies + copy)
            rows += [(c, p, 0) for p in both]
            rows.append((c, (cameras + c) * copies + copy, 1))
    return gains_of_rows(rows, np.full(cameras, 2), 2 * cameras * copies)


def gains_of_rows(rows, cell_counts, samples):
    """Gains of ``UNIT`` each, from rows of camera, sample and cell."""
    rows = np.array(sorted(rows))
    camera, sample, cell = rows[:, 0], rows[:, 1].astype(np.int32), rows[:, 2].astype(np.int32)
    counts = np.bincount(camera, minlength=len(cell_counts))
    none = kernels.GainsByCamera(
        np.zeros(len(counts) + 1, dtype=np.int64),
        np.zeros(0, dtype=np.int32),
        np.zeros(0, dtype=np.int64),
        *np.zeros((2, 0), dtype=np.int32),
    )
    blurred = kernels.BlurredViews(
        np.zeros(samples + 1, dtype=np.int64), np.zeros(0, dtype=np.int64)
    )
    return Gains(
        offsets=np.concatenate([[0], np.cumsum(counts)]),
        sample=sample,
        gain=np.full(len(rows), UNIT, dtype=np.int64),
        first=cell,
        last=cell.copy(),
        cell_offsets=np.concatenate([[0], np.cumsum(cell_counts)]).astype(np.int64),
        most=np.full(samples, UNIT, dtype=np.int64),
        in_focus=UNIT * samples,
        out=UNIT * samples,
        views=1,
        shots=1,
        blurred=none,
        blurred_views=blurred,
        seen=none,
    )


def random_plan(gains, random):
    """Pairs and cells that are taken in part, at random; of no pair more than of its cells.

    Cameras stand half at one cell and half at another, in most plans. It is no fractional solution,
    as some samples are taken more than once.
    """
    stands = np.zeros(int(gains.cell_offsets[-1]))
    held = random.choice([0.0, 0.5, 0.8], len(gains.gain), p=[0.1, 0.8, 0.1])
    for c in range(gains.camera_count):
        start, cells = gains.cell_offsets[c], int(np.diff(gains.cell_offsets)[c])
        for cell in random.permutation(cells)[:2]:
            stands[start + cell] = 1 / min(cells, 2)
        for j in range(gains.offsets[c], gains.offsets[c + 1]):
            part = stands[start + gains.first[j] : start + gains.last[j] + 1].sum()
            held[j] = min(held[j], part)
    return kernels.FractionalPlan(held, stands)


def relaxed_gain(gains, cuts):
    """The most that a fractional solution gains that violates no cut, by HiGHS.

    Its variables are how much of each pair is taken, and where cameras stand.
    """
    pairs, samples, cells = len(gains.gain), len(gains.most), int(gains.cell_offsets[-1])
    rows = lil_array((samples + pairs + gains.camera_count + len(cuts.limit), pairs + cells))
    limits = np.concatenate([np.ones(samples), np.zeros(pairs), np.ones(gains.camera_count)])
    for c in range(gains.camera_count):
        start, end = gains.cell_offsets[c], gains.cell_offsets[c + 1]
        rows[samples + pairs + c, pairs + start : pairs + end] = 1
        for j in range(gains.offsets[c], gains.offsets[c + 1]):
            rows[gains.sample[j], j] = rows[samples + j, j] = 1
            first, last = start + gains.first[j], start + gains.last[j]
            rows[samples + j, pairs + first : pairs + last + 1] = -1
    for k in range(len(cuts.limit)):
        row = samples + pairs + gains.camera_count + k
        _, taken, ranges = reference.cut_members(cuts, k)
        for j in taken:
            rows[row, j] += 1
        for c, first, last in ranges:
            for cell in range(gains.cell_offsets[c] + first, gains.cell_offsets[c] + last + 1):
                rows[row, pairs + cell] -= 1
    unit = gains.most.sum()
    worth = np.concatenate([gains.gain / unit, np.zeros(cells)])
    result = linprog(-worth, rows.tocsr(), np.concatenate([limits, cuts.limit]), method="highs")
    assert result.success
    return -result.fun * unit
