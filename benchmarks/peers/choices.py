# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.
"""A problem as a choice of one cell per camera, in the form that every peer works on.

A plan gains, of every sample, the largest gain among the cameras whose cell holds it
(:mod:`focus_planner.core.problem.gains`). Pairs are listed by camera, to move one, and by sample
with the largest gain first, to find what the others hold.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from focus_planner.core.arrays import IntArray, Offsets
from focus_planner.core.problem.gains import Gains, gains_of
from focus_planner.core.problem.problem import Problem


class Choices(NamedTuple):
    """Arrays, gains in whole units; cells are counted from their camera's first.

    Camera c's pairs are ``offsets[c]`` to ``offsets[c + 1]`` of ``sample``, ``gain``, ``first``
    and ``last``; sample p's ``sample_offsets[p]`` to ``sample_offsets[p + 1]`` of ``by_sample``,
    which are indices of those. ``cells`` (C,) are the numbers of cells.
    """

    offsets: Offsets
    camera: IntArray
    sample: IntArray
    gain: Offsets
    first: IntArray
    last: IntArray
    cells: IntArray
    sample_offsets: Offsets
    by_sample: Offsets


def choices_of(problem: Problem) -> tuple[Choices, Gains]:
    """Return the choices of a problem, and the gains that they are made of."""
    gains = gains_of(problem)
    camera = np.repeat(np.arange(gains.camera_count, dtype=np.int32), np.diff(gains.offsets))
    counts = np.bincount(gains.sample, minlength=problem.sample_count)
    choices = Choices(
        gains.offsets,
        camera,
        gains.sample,
        gains.gain,
        gains.first,
        gains.last,
        np.diff(gains.cell_offsets).astype(np.int32),
        np.concatenate([[0], np.cumsum(counts)]),
        np.lexsort((-gains.gain, gains.sample)),
    )
    return choices, gains


def taken_pairs(choices: Choices, cell: IntArray) -> NDArray[np.bool_]:
    """Return (G,) which pairs gain at these cells: of each sample the first that holds it."""
    at = cell[choices.camera]
    holds = (choices.first <= at) & (at <= choices.last)
    ordered = choices.by_sample[holds[choices.by_sample]]
    _, firsts = np.unique(choices.sample[ordered], return_index=True)
    taken = np.zeros(len(holds), dtype=np.bool_)
    taken[ordered[firsts]] = True
    return taken


def stood_at(choices: Choices, cell: IntArray) -> NDArray[np.bool_]:
    """Return (M,) of every cell whether its camera stands at it or an earlier one."""
    number = np.concatenate([np.arange(count) for count in choices.cells])
    return number >= np.repeat(cell, choices.cells)


@njit(nogil=True, cache=True)
def held(choices, p, cell, without):
    """Return the largest gain of sample p at these cells, leaving out one camera."""
    for i in choices.by_sample[choices.sample_offsets[p] : choices.sample_offsets[p + 1]]:
        c = choices.camera[i]
        if c != without and choices.first[i] <= cell[c] <= choices.last[i]:
            return choices.gain[i]
    return np.int64(0)


@njit(nogil=True, cache=True)
def total(choices, cell):
    """Return the gain of a plan, units."""
    gained = np.int64(0)
    for p in range(len(choices.sample_offsets) - 1):
        gained += held(choices, p, cell, -1)
    return gained


@njit(nogil=True, cache=True)
def best_cell(choices, c, cell, room):
    """Return a camera's best cell with the others as they are, what it adds, and what its own does.

    Sorted ends and one sum; ``room`` has a place for every cell of a camera and one more.
    """
    count = choices.cells[c]
    room[: count + 1] = 0
    own = np.int64(0)
    for i in range(choices.offsets[c], choices.offsets[c + 1]):
        more = choices.gain[i] - held(choices, choices.sample[i], cell, c)
        if more > 0:
            room[choices.first[i]] += more
            room[choices.last[i] + 1] -= more
            if choices.first[i] <= cell[c] <= choices.last[i]:
                own += more
    best, most, running = np.int32(0), np.int64(-1), np.int64(0)
    for j in range(count):
        running += room[j]
        if running > most:
            best, most = np.int32(j), running
    return best, most, own


@njit(nogil=True, cache=True)
def greedy(choices, cell, room):
    """Set the cell that adds most, camera after camera, lazily: what cells add only falls."""
    cell[:] = -1
    worth = np.full(len(cell), np.iinfo(np.int64).max)
    worth[choices.cells == 0] = -1
    while True:
        c = np.argmax(worth)
        if worth[c] < 0:
            return
        best, worth[c], _ = best_cell(choices, c, cell, room)
        if worth[c] >= worth.max():
            cell[c], worth[c] = best, -1


@njit(nogil=True, cache=True)
def descend(choices, cell, room):
    """Give camera after camera its best cell until none moves."""
    unmoved, c = 0, 0
    while unmoved < len(cell):
        unmoved += 1
        if choices.cells[c] > 0:
            best, most, own = best_cell(choices, c, cell, room)
            if most > own:
                cell[c], unmoved = best, 0
        c = (c + 1) % len(cell)


@njit(nogil=True, cache=True)
def change(choices, c, cell, new):
    """Return how much more is gained if camera c moves to another cell."""
    old, more = cell[c], np.int64(0)
    for i in range(choices.offsets[c], choices.offsets[c + 1]):
        before = choices.first[i] <= old <= choices.last[i]
        after = choices.first[i] <= new <= choices.last[i]
        if before != after:
            part = choices.gain[i] - held(choices, choices.sample[i], cell, c)
            if part > 0:
                more += part if after else -part
    return more


@njit(nogil=True, cache=True)
def anneal(choices, cell, best, gained, most, temperature, steps, random):
    """Take random steps at a temperature, units; return the gain, and the most so far.

    A step moves one camera, every other time to a cell near by. ``best`` is the best plan so far.
    """
    for _ in range(steps):
        c = random.integers(0, len(cell))
        count = choices.cells[c]
        if count < 2:
            continue
        if random.random() < 0.5:
            new = np.int32(cell[c] + random.integers(-3, 4))
            if new < 0 or new >= count:
                continue
        else:
            new = np.int32(random.integers(0, count))
        more = change(choices, c, cell, new)
        if more >= 0 or random.random() < np.exp(more / temperature):
            cell[c] = new
            gained += more
            if gained > most:
                most = gained
                best[:] = cell
    return gained, most
