# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A lens: its optics, and the focus distances that it can be set to."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from focus_planner.core.arrays import FloatArray
from focus_planner.core.brief import brief_repr
from focus_planner.core.rig.lens_table import MAX_FOCUS_STEPS, LensTable
from focus_planner.core.rig.plausible import (
    HIATUS,
    NEAREST_FOCUS,
    check_circle,
    check_focal_length,
    check_hyperfocal,
)
from focus_planner.core.validation import InputError, check_number, check_whole, shown

# Metres: products and quotients of others overflow.
_LARGEST_LENGTH = 1e12
#: Metres. Real lenses have centimetres.
MAX_HIATUS = HIATUS.most


@dataclass(frozen=True)
class Lens:
    """A thin lens, or one of several elements that images like it.

    Parameters
    ----------
    focal_length : float
        F, metres.
    hyperfocal_distance : float
        H = F² / (f-number · circle of confusion), metres, as in the paper's D_N and D_F
        (Sec. 4.2). Textbooks that add F to it describe the same lens.
    min_focus, max_focus : float
        The nearest and farthest focus distance, metres; 0 and inf for no limit.
    focus_distances : sequence of float, optional
        The only distances that the lens can be set to, metres, within the limits. Sorted, without
        duplicates, here.
    focus_steps : int, optional
        In place of ``focus_distances``: the number of positions between the limits, equally
        spaced in dioptres, both limits included. Without ``max_focus`` the last position is at
        infinity; it counts but is never planned, because plans consist of finite distances.
    table : LensTable, optional
        Conversion to the values that the lens's driver takes. The lens is limited to the table's
        distances. A table of whole values or steps determines the possible distances by itself,
        in place of the other two.
    hiatus : float
        How far the rear principal plane is behind the front one, metres; 0 for a thin lens,
        negative if they are crossed. It lengthens the way to the sensor and changes nothing else:
        see :func:`~focus_planner.core.rig.optics.distance_from_sensor`.
    circle_of_confusion : float, optional
        Largest diameter on the sensor of a blurred point that still counts as sharp, metres. With
        the hyperfocal distance it tells the aperture, and so how blurred pictures are; plans do
        not depend on it. When absent, pictures assume one:
        :mod:`focus_planner.core.rig.circles`.

    Raises
    ------
    InputError
        If a value is out of range, the limits leave no distance, or more than one of
        ``focus_distances``, ``focus_steps`` and a table of whole values or steps is given.
    """

    focal_length: float = 0.050
    hyperfocal_distance: float = 10.0
    min_focus: float = 0.0
    max_focus: float = math.inf
    focus_distances: tuple[float, ...] | None = None
    focus_steps: int | None = None
    table: LensTable | None = None
    hiatus: float = 0.0
    circle_of_confusion: float | None = None

    __repr__ = brief_repr

    def __post_init__(self) -> None:
        f = check_focal_length("lens.focal_length", self.focal_length)
        check_hyperfocal("lens.hyperfocal_distance", self.hyperfocal_distance, f)
        check_number("lens.min_focus", self.min_focus, at_least=0)
        if self.min_focus:
            NEAREST_FOCUS.check("lens.min_focus", self.min_focus)
        if check_number("lens.max_focus", self.max_focus, infinite=True) <= f:
            raise InputError(
                "lens.max_focus", f"a number above focal_length ({f:g} m)", f"{self.max_focus:g}"
            )
        if self.max_focus < math.inf:
            _check_magnitude("lens.max_focus", self.max_focus)
        if self.min_focus > self.max_focus:
            raise InputError(
                "lens.min_focus",
                f"at most max_focus ({self.max_focus:g} m)",
                f"{self.min_focus:g} m",
            )
        _check_hiatus(self)
        if self.circle_of_confusion is not None:
            check_circle("lens.circle_of_confusion", self.circle_of_confusion)
        if self.table is not None:
            _check_table(self, self.table)
        if self.focus_distances is not None:
            object.__setattr__(self, "focus_distances", _checked_distances(self))
        if self.focus_steps is not None:
            _check_steps(self)

    @property
    def focus_limits(self) -> tuple[float, float]:
        """The nearest and farthest distance within both the limits and the table, metres."""
        if self.table is None:
            return self.min_focus, self.max_focus
        return max(self.min_focus, self.table.nearest), min(self.max_focus, self.table.farthest)

    @cached_property
    def settable_distances(self) -> FloatArray | None:
        """(n,) all distances the lens can be set to, metres, ascending; None if any will do."""
        if self.focus_steps is not None:
            settable = _equal_dioptre_steps(*self.focus_limits, self.focus_steps)
        elif self.focus_distances is not None:
            settable = np.array(self.focus_distances)
        elif self.table is not None and self.table.settable_distances is not None:
            settable = _distances_within(self.table.settable_distances, self)
        else:
            return None
        settable.flags.writeable = False
        return settable


def _check_magnitude(argument: str, metres: float) -> None:
    """Raise if products with other distances would overflow."""
    if metres > _LARGEST_LENGTH:
        raise InputError(argument, f"at most {_LARGEST_LENGTH:g} m", f"{metres:g}")


def _check_hiatus(lens: Lens) -> None:
    """Raise unless the sensor is behind whatever the lens can be focused at."""
    hiatus = check_number("lens.hiatus", lens.hiatus)
    # Between a subject and its image a thin lens leaves at least four focal lengths.
    least = -4 * lens.focal_length
    if not least < hiatus <= MAX_HIATUS:
        raise InputError(
            "lens.hiatus",
            f"above -4 focal lengths ({least:g} m) and at most {MAX_HIATUS:g} m",
            f"{hiatus:g} m",
            HIATUS.other_unit(hiatus) or "it is probably not in metres",
        )


def _equal_dioptre_steps(nearest: float, farthest: float, count: int) -> FloatArray:
    """Return the finite ones of ``count`` distances equally spaced in dioptres."""
    dioptres = np.linspace(1 / nearest, 1 / farthest, count)
    finite = 1 / dioptres[dioptres > 0]
    # The limits are positions themselves, and 1 / (1 / x) need not be x.
    finite[0] = nearest
    if dioptres[-1] > 0:
        finite[-1] = farthest
    return np.unique(np.clip(finite, nearest, farthest))


def _distances_within(distances: FloatArray, lens: Lens) -> FloatArray:
    """Return the distances that are within the lens's limits."""
    nearest, farthest = lens.focus_limits
    inside = (distances >= nearest) & (distances <= farthest) & (distances > lens.focal_length)
    within: FloatArray = distances[inside]
    return within


def _check_table(lens: Lens, table: LensTable) -> None:
    """Raise if the table contradicts the lens's other properties."""
    if not isinstance(table, LensTable):
        raise InputError("lens.table", "a LensTable", shown(table))
    settable = table.settable_distances
    listed = lens.focus_distances is not None or lens.focus_steps is not None
    if settable is not None and listed:
        raise InputError(
            "lens.table",
            "either a table of whole values or steps, focus_distances or focus_steps",
            "two of them",
            "such a table already determines what the lens can be set to",
        )
    nearest, farthest = lens.focus_limits
    if nearest > farthest or farthest <= lens.focal_length:
        got = f"{table.nearest:g} to {table.farthest:g} m"
    elif settable is not None and not len(_distances_within(settable, lens)):
        got = f"none of its {len(settable)} values there"
    else:
        return
    raise InputError(
        "lens.table",
        f"distances from min_focus ({lens.min_focus:g} m) to max_focus ({lens.max_focus:g} m),"
        f" above focal_length ({lens.focal_length:g} m)",
        got,
    )


def _checked_distances(lens: Lens) -> tuple[float, ...]:
    """Return ``focus_distances``, ascending and unique; raise if the lens cannot have them."""
    name, given = "lens.focus_distances", lens.focus_distances
    if isinstance(given, (str, bytes)) or not isinstance(given, Iterable):
        raise InputError(name, "a list of distances in metres", shown(given))
    listed = sorted(
        {
            check_number(f"{name}[{i}]", distance, above=lens.focal_length)
            for i, distance in enumerate(given)
        }
    )
    if not 0 < len(listed) <= MAX_FOCUS_STEPS:
        raise InputError(
            name,
            f"1 to {MAX_FOCUS_STEPS} distances",
            str(len(listed)),
            "leave it out for a lens that takes any distance between its limits",
        )
    NEAREST_FOCUS.check(f"{name} (the nearest)", listed[0])
    _check_magnitude(name, listed[-1])
    nearest, farthest = lens.focus_limits
    if not nearest <= listed[0] <= listed[-1] <= farthest:
        raise InputError(
            name,
            f"distances from min_focus ({nearest:g} m) to max_focus ({farthest:g} m)"
            + (", as limited by the lens's table" if lens.table else ""),
            f"{listed[0]:g} to {listed[-1]:g} m",
        )
    return tuple(listed)


def _check_steps(lens: Lens) -> None:
    name, steps = "lens.focus_steps", lens.focus_steps
    if lens.focus_distances is not None:
        raise InputError(name, "either focus_distances or focus_steps", "both")
    if check_whole(name, steps, 2) > MAX_FOCUS_STEPS:
        raise InputError(name, f"at most {MAX_FOCUS_STEPS}", shown(steps))
    if lens.focus_limits[0] <= lens.focal_length:
        raise InputError(
            "lens.min_focus",
            f"a number above focal_length ({lens.focal_length:g} m), with focus_steps",
            f"{lens.focus_limits[0]:g}",
            "the first step is the nearest distance that the lens can be set to",
        )
