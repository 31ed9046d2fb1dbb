# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""How the surfaces of a data set come before a rig: their unit, the axis that is up, their place.

All files of a data set share unit and axis, so these are found for all together.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from focus_planner.core.arrays import FloatArray
from focus_planner.core.notes import Note
from focus_planner.core.planning.suspicions import sight
from focus_planner.core.rig.rig import Rig
from focus_planner.core.surface.scene import Scene
from focus_planner.core.surface.surface import Mesh, Surface
from focus_planner.core.surface.up_axis import with_z_up
from focus_planner.core.validation import InputError
from focus_planner.evaluation.finding.boxes import points_of

Place = Literal["as_is", "centred"]

#: Metres, by name.
UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001}
_UNIT_NAMES = {"m": "metres", "cm": "centimetres", "mm": "millimetres"}
# In the order in which they are believed where a rig sees as much. Upside down it mostly does.
_UPS = ("z", "y", "x")
# Another axis than z must bring so many times what is seen now.
_BETTER = 1.2
_MICROMETRES = 6  # digits; what is shifted by less is in its place


@dataclass(frozen=True)
class Placing:
    """What brings a surface into the rig's frame.

    Attributes
    ----------
    up : str
        The axis that is up in its file.
    scale : float
        Metres per unit of the file.
    centre : tuple of float or None
        Where its middle comes to be in x and y, with its lowest point at z = 0; None to leave it.
    """

    up: str = "z"
    scale: float = 1.0
    centre: tuple[float, float] | None = None

    def apply(self, surface: Surface) -> Surface:
        """Return the surface in the rig's frame."""
        surface = with_z_up(surface, self.up)
        points = points_of(surface)
        if self.scale != 1.0:
            points = points * self.scale
        shift = self._shift(points)
        if shift.any():
            points = points + shift
        if points is points_of(surface):
            return surface
        if isinstance(surface, Mesh):
            return replace(surface, vertices=points)
        return replace(surface, points=points)

    def moves(self, box: FloatArray) -> bool:
        """Return whether a surface, of which (2, 3) the box is given, is changed at all."""
        return self.up != "z" or self.scale != 1.0 or bool(self._shift(box).any())

    def _shift(self, points: FloatArray) -> FloatArray:
        if self.centre is None:
            return np.zeros(3)
        low, high = points.min(axis=0), points.max(axis=0)
        shift = np.array([*self.centre, 0.0]) - np.array([*(low + high)[:2] / 2, low[2]])
        rounded: FloatArray = np.round(shift, _MICROMETRES)
        return rounded


def rig_centre(rig: Rig) -> tuple[float, float]:
    """Return the middle of the cameras in x and y, to a micrometre."""
    x, y, _ = np.round(_positions(rig).mean(axis=0), _MICROMETRES) + 0.0
    return float(x), float(y)


def find_unit(boxes: Mapping[str, FloatArray], rig: Rig) -> str:
    """Return the largest unit in which all surfaces fit between the cameras.

    Parameters
    ----------
    boxes : mapping of str to (2, 3) array
        The least and the greatest coordinates of the surfaces, by name.
    rig : Rig
        Of a single camera nothing follows: metres.

    Returns
    -------
    {"m", "cm", "mm"}

    Raises
    ------
    InputError
        If one fits in none, or they differ.
    """
    room = float(np.linalg.norm(np.ptp(_positions(rig), axis=0)))
    if not room:
        return "m"
    extents = {name: float(np.ptp(box, axis=0).max()) for name, box in boxes.items()}
    units = {name: _fitting(name, size, room) for name, size in extents.items()}
    first, *_ = units
    for name, unit in units.items():
        if unit != units[first]:
            raise InputError(
                "--unit",
                "subjects in the same unit",
                f"{first}, {extents[first]:.4g} across, as if in {_UNIT_NAMES[units[first]]}, and"
                f" {name}, {extents[name]:.4g} across, as if in {_UNIT_NAMES[unit]}",
                "give --unit, or evaluate them apart",
            )
    return units[first]


def _fitting(name: str, size: float, room: float) -> str:
    fitting = next((unit for unit, scale in UNITS.items() if size * scale <= room), None)
    if fitting is None:
        raise InputError(
            name,
            f"a surface that has room between the cameras, which are {room:.2f} m apart",
            f"one that is {size:.4g} across, also in millimetres too much",
            "give --unit, or another rig",
        )
    return fitting


def find_up(surfaces: Sequence[Surface], placing: Placing, rig: Rig) -> str:
    """Return the axis that is up: z, unless a rig sees clearly more with y or x.

    Parameters
    ----------
    surfaces : sequence of Mesh or PointCloud
        Some of the data set.
    placing : Placing
        All but the axis.
    rig : Rig
    """
    seen = {up: _seen(surfaces, replace(placing, up=up), rig) for up in _UPS}
    best = max(seen, key=lambda up: seen[up])
    return best if seen[best] > _BETTER * seen["z"] else "z"


def _seen(surfaces: Iterable[Surface], placing: Placing, rig: Rig) -> float:
    return sum(sight(Scene(placing.apply(surface)), rig).score for surface in surfaces)


def notes_on(
    placing: Placing, unit: str, *, up_found: bool, unit_found: bool, moves: bool
) -> tuple[Note, ...]:
    """Return what was assumed, and how to say otherwise."""
    notes = []
    if unit_found and unit != "m":
        notes.append(
            Note(
                "unit",
                f"taken as {_UNIT_NAMES[unit]}: in metres it has no room between the cameras;"
                " --unit says otherwise",
            )
        )
    if up_found and placing.up != "z":
        notes.append(
            Note(
                "up_axis",
                f"taken with {placing.up} up: so the cameras see most; --up says otherwise",
            )
        )
    if placing.centre is not None and moves:
        x, y = placing.centre
        notes.append(
            Note(
                "placement",
                f"put in the middle of the cameras, at ({x:g}, {y:g}), its lowest point at z = 0;"
                " --place as_is leaves it where it is",
            )
        )
    return tuple(notes)


def _positions(rig: Rig) -> FloatArray:
    return np.array([camera.position for camera in rig.cameras])
