"""All cameras of a rig, in one frame."""

from __future__ import annotations

from dataclasses import dataclass

from focus_planner.core.rig.camera import Camera
from focus_planner.core.validation import (
    InputError,
    check_whole,
)

#: kernels/k_view.py numbers cameras with 18 bits.
MAX_CAMERAS = 250_000


@dataclass(frozen=True)
class Grid:
    """The places of a rig's cameras on a cylinder.

    Camera ``row * columns + column`` stands in that row (from the bottom) and column; the last
    column is the first one's neighbour.
    """

    rows: int
    columns: int

    def __post_init__(self) -> None:
        check_whole("grid.rows", self.rows, 1)
        check_whole("grid.columns", self.columns, 1)


@dataclass(frozen=True)
class Rig:
    """The cameras of one capture, in one frame.

    Raises
    ------
    InputError
        If there is no camera, a name occurs twice, or the grid does not fit the cameras.
    """

    cameras: tuple[Camera, ...]
    frame_id: str = "world"
    grid: Grid | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "cameras", tuple(self.cameras))
        if not self.cameras:
            raise InputError("rig", "at least one camera", "none")
        if len(self.cameras) > MAX_CAMERAS:
            raise InputError("rig", f"at most {MAX_CAMERAS} cameras", str(len(self.cameras)))
        names = [camera.name for camera in self.cameras]
        if len(set(names)) < len(names):
            twice = next(name for name in names if names.count(name) > 1)
            raise InputError("rig", "unique camera names", f"{twice!r} {names.count(twice)} times")
        if self.grid is not None and self.grid.rows * self.grid.columns != len(self.cameras):
            raise InputError(
                "rig.grid",
                f"rows × columns = {len(self.cameras)}, the number of cameras",
                f"{self.grid.rows} × {self.grid.columns}",
            )

    def __len__(self) -> int:
        return len(self.cameras)
