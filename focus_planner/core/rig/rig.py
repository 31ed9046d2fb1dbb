# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A rig: all its cameras in one frame."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field

from focus_planner.core.brief import brief_repr
from focus_planner.core.notes import Note
from focus_planner.core.rig.camera import Camera
from focus_planner.core.rig.names import proposed_name
from focus_planner.core.validation import InputError, check_whole

#: kernels/k_view.py stores a camera's index in 18 bits.
MAX_CAMERAS = 250_000


@dataclass(frozen=True)
class Grid:
    """The arrangement of a rig's cameras in rows and columns around a cylinder.

    Camera ``row * columns + column`` stands in that row (from the bottom) and column; the last
    column is next to the first.
    """

    rows: int
    columns: int

    def __post_init__(self) -> None:
        check_whole("grid.rows", self.rows, 1, MAX_CAMERAS)
        check_whole("grid.columns", self.columns, 1, MAX_CAMERAS)


@dataclass(frozen=True)
class Rig:
    """All cameras of a capture rig.

    Parameters
    ----------
    cameras : tuple of Camera
        Their names are unique.
    frame_id : str
        The frame of the cameras' poses, which surfaces must be given in as well.
    grid : Grid, optional
        How the cameras are arranged. It tells the 2-view and 3-view methods which are neighbours.
    notes : tuple of Note
        What was noticed when it was read; plans for it pass them on.
    assumed : mapping of str to frozenset of str
        By the name of a camera, which of its values nothing told: ``lens.focal_length``,
        ``image.width``. Of cameras that are not named, everything was told.
    sequence : bool
        Whether the cameras are places that one camera, or a few, take one after the other, in this
        order: the shooting order. It changes no plan, only the order in which people and programs
        are told what to set.

    Raises
    ------
    InputError
        If there are no cameras or too many, a name occurs twice, or the grid's size does not
        match the number of cameras.
    """

    cameras: tuple[Camera, ...]
    frame_id: str = "world"
    grid: Grid | None = None
    notes: tuple[Note, ...] = field(default=(), compare=False)
    assumed: Mapping[str, frozenset[str]] = field(default_factory=dict, compare=False, repr=False)
    sequence: bool = False

    __repr__ = brief_repr

    def __post_init__(self) -> None:
        object.__setattr__(self, "cameras", tuple(self.cameras))
        if not self.cameras:
            raise InputError("rig", "at least one camera", "none")
        if len(self.cameras) > MAX_CAMERAS:
            raise InputError("rig", f"at most {MAX_CAMERAS} cameras", str(len(self.cameras)))
        names = [camera.name for camera in self.cameras]
        repeated, times = Counter(names).most_common(1)[0]
        if times > 1:
            raise InputError(
                "rig",
                "unique camera names",
                f"{repeated!r} {times} times",
                f"name one of them {proposed_name(repeated, {*names})}",
            )
        if self.grid is not None and self.grid.rows * self.grid.columns != len(self.cameras):
            raise InputError(
                "rig.grid",
                f"rows × columns = {len(self.cameras)}, the number of cameras",
                f"{self.grid.rows} × {self.grid.columns}",
            )

    def __len__(self) -> int:
        return len(self.cameras)
