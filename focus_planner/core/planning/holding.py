# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Lenses that stay where an earlier plan has them, so that none hunts for what gains little."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from focus_planner.core.arrays import FloatArray
from focus_planner.core.notes import Note
from focus_planner.core.planning.plan import WarmStart
from focus_planner.core.planning.warm_start import earlier_distances
from focus_planner.core.problem.problem import Problem
from focus_planner.core.problem.shots import sort_shots
from focus_planner.core.rig.lens import Lens
from focus_planner.core.rig.optics import depth_of_field


@dataclass(frozen=True, eq=False)
class Held:
    """Which lenses are to stay where they are.

    Attributes
    ----------
    before : WarmStart or None
        Has the distances that they are at.
    min_change : float
        What a lens moves for is more than this fraction of its depth of field.
    """

    before: WarmStart | None = None
    min_change: float = 0.0

    @property
    def note(self) -> Note:
        """What the users of a plan should know in which some stay."""
        return Note(
            "held",
            f"lenses whose focus would change by at most {100 * self.min_change:g} % of their depth"
            " of field stay where the plan before has them (parameter min_change); all that this"
            " plan tells is told of where they are",
        )


def held_distances(problem: Problem, focus: FloatArray, held: Held) -> FloatArray:
    """Return the distances, with the earlier ones of lenses whose change is too small.

    A change is measured in dioptres, in which the depth of field has a width even where it reaches
    infinity, as a fraction of that at the earlier distance. A shot that either plan does not take,
    or a distance that the lens cannot be set to any more, is not held; nor is any shot if the
    plans have different numbers of them.

    Parameters
    ----------
    problem : Problem
    focus : (C,) array
        Of its cameras, ascending from shot to shot; metres, not finite for shots not taken.
    held : Held
    """
    if held.before is None or held.min_change <= 0:
        return focus
    before = earlier_distances(held.before, problem)
    stay = np.zeros(problem.camera_count, dtype=np.bool_)
    for lens, places in _places(problem.lenses).items():
        stay[places] = _stay(lens, before[places], focus[places], held.min_change)
    return sort_shots(problem, np.where(stay, before, focus))


def _places(lenses: tuple[Lens, ...]) -> dict[Lens, list[int]]:
    """Return where each lens is: most rigs have one for all cameras."""
    places: dict[Lens, list[int]] = {}
    for place, lens in enumerate(lenses):
        places.setdefault(lens, []).append(place)
    return places


def _stay(
    lens: Lens, before: FloatArray, focus: FloatArray, min_change: float
) -> NDArray[np.bool_]:
    """Return which of a lens's changes are too small, and from where it can still be set to."""
    can: NDArray[np.bool_] = np.isfinite(focus) & _settable(lens, before)
    was, now = np.where(can, before, 1.0), np.where(can, focus, 1.0)
    near, far = depth_of_field(was, lens)
    return can & (np.abs(1 / was - 1 / now) <= min_change * (1 / near - 1 / far))


def _settable(lens: Lens, distances: FloatArray) -> NDArray[np.bool_]:
    if lens.settable_distances is not None:
        return np.isin(distances, lens.settable_distances)
    nearest, farthest = lens.focus_limits
    within: NDArray[np.bool_] = (distances >= nearest) & (distances <= farthest)
    return np.isfinite(distances) & within
