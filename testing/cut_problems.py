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

from focus_planner.core import kernels
from focus_planner.core.problem.gains import Gains

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
    """Pairs and cells that are taken in part, at random: no fractional solution in general."""
    held = random.choice([0.0, 0.3, 0.5, 0.7, 1.0], len(gains.gain), p=[0.2, 0.2, 0.3, 0.2, 0.1])
    stands = np.zeros(int(gains.cell_offsets[-1]))
    for c in range(gains.camera_count):
        part = slice(gains.cell_offsets[c], gains.cell_offsets[c + 1])
        share = random.random(part.stop - part.start) * (
            random.random(part.stop - part.start) < 0.5
        )
        stands[part] = share / max(share.sum(), 1.0)
    return kernels.FractionalPlan(held, stands)
