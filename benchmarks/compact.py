# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A whole problem as a small mixed-integer program: the form in which HiGHS does best.

Facility location with one variable z per cell, "the camera stands at this cell or an earlier one",
so that "it stands between the cells that hold the sample" is a difference of two: rows of three
entries, however many cells hold the sample.
"""

from __future__ import annotations

import highspy
import numpy as np
from scipy.sparse import coo_array

from focus_planner.core.problem.cells import UNITS
from focus_planner.core.problem.gains import Gains

_SCALE = 1000 / UNITS  # HiGHS is given cost as users see it


def compact_program(gains: Gains) -> highspy.HighsLp:
    """Return: maximise Σ gain·y, y ≤ z(last) − z(first − 1), Σ y of a sample ≤ 1, z ascending to 1.

    The columns are y, one per pair, then z, one per cell.
    """
    pairs, cells = len(gains.gain), int(gains.cell_offsets[-1])
    y, z = np.arange(pairs), pairs
    start = np.repeat(gains.cell_offsets[:-1], np.diff(gains.offsets))
    is_last = np.zeros(cells, dtype=bool)
    is_last[gains.cell_offsets[1:][np.diff(gains.cell_offsets) > 0] - 1] = True
    samples, row_of_pair = np.unique(gains.sample, return_inverse=True)
    after_first, steps = np.flatnonzero(gains.first > 0), np.flatnonzero(~is_last)
    step_rows = pairs + len(samples) + np.arange(len(steps))
    rows, columns, values = [], [], []
    for row, column, value in (
        (y, y, 1.0),
        (y, z + start + gains.last, -1.0),
        (after_first, (z + start + gains.first - 1)[after_first], 1.0),
        (pairs + row_of_pair, y, 1.0),
        (step_rows, z + steps, 1.0),
        (step_rows, z + steps + 1, -1.0),
    ):
        rows.append(row)
        columns.append(column)
        values.append(np.full(len(row), value))
    shape = (pairs + len(samples) + len(steps), pairs + cells)
    entries = np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))
    matrix = coo_array(entries, shape=shape).tocsc()
    model = highspy.HighsLp()
    model.num_row_, model.num_col_ = shape
    model.col_cost_ = np.concatenate([-_SCALE * gains.gain, np.zeros(cells)])
    model.col_lower_ = np.concatenate([np.zeros(pairs), is_last.astype(np.float64)])
    model.col_upper_ = np.ones(shape[1])
    model.row_lower_ = np.full(shape[0], -highspy.kHighsInf)
    model.row_upper_ = np.repeat([0.0, 1.0, 0.0], [pairs, len(samples), len(steps)])
    model.a_matrix_.format_ = highspy.MatrixFormat.kColwise
    model.a_matrix_.start_ = matrix.indptr
    model.a_matrix_.index_ = matrix.indices
    model.a_matrix_.value_ = matrix.data
    continuous, whole = highspy.HighsVarType.kContinuous, highspy.HighsVarType.kInteger
    model.integrality_ = [continuous] * pairs + [whole] * cells
    return model
