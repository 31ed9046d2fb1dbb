# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The settings that the planner's parameters amount to."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from focus_planner.core.planning.request import PlanRequest
from focus_planner.core.planning.resource_limits import ResourceLimits
from focus_planner.core.problem.cost_model import CostModel
from focus_planner.core.rig.camera import CameraIntrinsics
from focus_planner.core.rig.lens import Lens
from focus_planner.core.validation import InputError, check_choice
from focus_planner.io.lens_tables import LensTables, lens_tables_from_yaml, load_lens_tables
from focus_planner.messages.limits import Limits
from focus_planner.messages.reading import Optics, lens_from_message
from focus_planner.messages.requests import request_from_values
from focus_planner.messages.untold import lacks_circle
from focus_planner.parameters.camera_frames import CameraFrames
from focus_planner.parameters.declaration import Value, group, with_defaults
from focus_planner.parameters.planner import ACCESSES, ANY_DISTANCE, DECLARATIONS, OVERLAPS, REPLANS

# Parameters have no place for a table: it is in a file.
_NO_TABLE = SimpleNamespace(unit="", whole=False, distances=(), values=())


@dataclass(frozen=True)
class Recording:
    """Whether and how runs are recorded.

    Attributes
    ----------
    directory : Path or None
        The folder of the runs' folders; None to record none.
    markers : bool
        Whether runs include what shows their plans in 3D.
    max_runs, max_bytes : int
        How many runs to keep, and of what total size; 0 for no limit.
    access : {"owner", "group", "all"}
        Who may read runs.
    replan_period : float
        Seconds from one recorded plan that nobody asked for to the next.
    """

    directory: Path | None = None
    markers: bool = False
    max_runs: int = 0
    max_bytes: int = 0
    access: str = ACCESSES[0]
    replan_period: float = 10.0

    def __post_init__(self) -> None:
        check_choice("record_access", self.access, ACCESSES)


@dataclass(frozen=True)
class Replan:
    """When to plan without being asked.

    Attributes
    ----------
    mode : {"never", "on_surface", "rate"}
    rate : float
        With ``"rate"``, how often a second at most.
    """

    mode: str = REPLANS[0]
    rate: float = 10.0

    def __post_init__(self) -> None:
        check_choice("replan", self.mode, REPLANS)

    @property
    def is_on(self) -> bool:
        """Whether to plan for new surfaces at all."""
        return self.mode != REPLANS[0]

    @property
    def period(self) -> float:
        """Shortest time from one plan to the next, seconds."""
        return 1.0 / self.rate if self.mode == "rate" else 0.0


@dataclass(frozen=True)
class Serving:
    """How requests are served, and what is reported.

    Attributes
    ----------
    autostart : bool
        Whether the node configures and activates itself.
    overlap : {"queue", "preempt", "refuse"}
        What happens to a goal that arrives while other requests are being planned or waiting.
    service_max_wait : float
        How long a call waits for its turn, seconds.
    max_waiting : int
        How many requests may wait.
    status_period : float
        Seconds between two reports.
    lens_tolerance : float
        By how much the distance read back of a lens that is said to be there may differ from the
        planned one, dioptres.
    max_input_age : float
        Age from which an input is reported as old, seconds.
    max_planning_time : float
        How long planning for a request may take, seconds.
    max_memory : int
        Bytes that planning may take; 0 for no limit.
    """

    autostart: bool = True
    overlap: str = OVERLAPS[0]
    service_max_wait: float = 5.0
    max_waiting: int = 100
    status_period: float = 1.0
    lens_tolerance: float = 0.1
    max_input_age: float = math.inf
    max_planning_time: float = 600.0
    max_memory: int = 4_000_000_000

    def __post_init__(self) -> None:
        check_choice("overlap", self.overlap, OVERLAPS)


@dataclass(frozen=True)
class Settings:
    """What the parameters amount to.

    Attributes
    ----------
    frame_id : str
    importance_field : str
        The field of a cloud that holds the importance of its points.
    request : PlanRequest
        The defaults of what a request leaves out.
    subjects : int
        How many of the newest surfaces are planned for together.
    warm_start : bool
        Whether a plan starts from the last one.
    min_change : float
        A plan that does so moves a lens for more than this fraction of its depth of field.
    optics : Optics
        The defaults of what a camera leaves out: image, lens, lens table.
    model : CostModel
    limits : Limits
        How large messages may be.
    resources : ResourceLimits
        What a plan may take.
    camera_frames : CameraFrames
        Of a rig that is put together from frames.
    recording : Recording
    serving : Serving
    replan : Replan
    values : tuple
        The parameters that these settings were made from: names and values, in the order of their
        declarations.
    """

    frame_id: str
    importance_field: str
    request: PlanRequest
    subjects: int
    warm_start: bool
    min_change: float
    optics: Optics
    model: CostModel
    limits: Limits
    resources: ResourceLimits
    camera_frames: CameraFrames
    recording: Recording
    serving: Serving
    replan: Replan
    values: tuple[tuple[str, Value], ...]

    @classmethod
    def from_values(
        cls, values: Mapping[str, Any], lens_tables: LensTables | str | None = None
    ) -> Settings:
        """Return the settings that parameters amount to.

        Parameters
        ----------
        values : mapping
            Parameters by name; those left out have their defaults.
        lens_tables : LensTables or str, optional
            What is in the file that the parameter ``lens_tables`` names, or its text, as read
            before; "" for no tables. By default the file is read.

        Raises
        ------
        InputError
            If a value is out of range, values contradict each other, or the file of lens tables
            cannot be used.
        """
        values = with_defaults(DECLARATIONS, values)
        if not values["frame_id"]:
            raise InputError("frame_id", "the name of a frame", "''")
        if not values["importance_field"]:
            raise InputError("importance_field", "the name of a field", "''")
        return cls(
            frame_id=values["frame_id"],
            importance_field=values["importance_field"],
            camera_frames=CameraFrames.from_values(
                *(values[f"camera_{name}"] for name in ("frames", "convention", "info_topics"))
            ),
            request=request_from_values(values),
            subjects=values["subjects"],
            warm_start=values["warm_start"],
            min_change=values["min_change"],
            optics=_optics(values, lens_tables_of(values["lens_tables"], lens_tables)),
            model=CostModel(**group(values, "cost.")),
            limits=Limits(
                max_points=values["max_points"] or math.inf,
                max_triangles=values["max_triangles"] or math.inf,
                max_cameras=values["max_cameras"] or math.inf,
            ),
            resources=ResourceLimits(
                max_problem_size=values["max_problem_size"] or math.inf,
                max_memory=values["max_memory"] or math.inf,
            ),
            recording=Recording(
                directory=_path("record_directory", "a folder", values["record_directory"]),
                markers=values["record_markers"],
                max_runs=values["record_max_runs"],
                max_bytes=values["record_max_bytes"],
                access=values["record_access"],
                replan_period=values["record_replan_period"],
            ),
            replan=Replan(mode=values["replan"], rate=values["replan_rate"]),
            serving=Serving(
                autostart=values["autostart"],
                overlap=values["overlap"],
                service_max_wait=values["service_max_wait"],
                max_waiting=values["max_waiting"],
                status_period=values["status_period"],
                lens_tolerance=values["lens_tolerance"],
                max_input_age=values["max_input_age"] or math.inf,
                max_planning_time=values["max_planning_time"] or math.inf,
                max_memory=values["max_memory"],
            ),
            values=tuple((d.name, _plain(values[d.name])) for d in DECLARATIONS),
        )

    @property
    def lens_tables(self) -> LensTables | None:
        """The lens tables in force."""
        return self.optics.tables

    @property
    def lens_tables_text(self) -> str:
        """The contents of their file; "" for none."""
        return self.optics.tables.text if self.optics.tables else ""


def _optics(values: Mapping[str, Any], tables: LensTables | None) -> Optics:
    """Return the defaults of what a camera leaves out."""
    intrinsics = CameraIntrinsics(**group(values, "image."))
    given = group(values, "lens.")
    if tuple(given["focus_distances"]) == ANY_DISTANCE:
        given["focus_distances"] = ()
    message = SimpleNamespace(**given, table=_NO_TABLE)
    told = given["focal_length"] != Lens().focal_length
    return Optics(
        intrinsics=intrinsics,
        lens=lens_from_message(message, intrinsics, focal_length_told=told),
        tables=tables,
        f_number=given["f_number"] if lacks_circle(message) else 0.0,
        unused_f_number=given["f_number"] if given["hyperfocal_distance"] else 0.0,
    )


def lens_tables_of(name: str, given: LensTables | str | None = None) -> LensTables | None:
    """Return the lens tables that are given, or else those in the file of this name.

    Parameters
    ----------
    name : str
        The value of the parameter ``lens_tables``.
    given : LensTables or str, optional
        What is in the file, or its text, as read before; "" for no tables.

    Raises
    ------
    InputError
        If they cannot be used.
    """
    if given is None:
        path = _path("lens_tables", "a file", name)
        return load_lens_tables(path) if path else None
    if isinstance(given, str):
        return lens_tables_from_yaml(given, name or "lens_tables") if given else None
    return given


def _path(parameter: str, what: str, name: str) -> Path | None:
    try:
        return Path(name).expanduser() if name else None
    except RuntimeError:
        raise InputError(parameter, what, f"{name!r}, of no known user") from None


def _plain(value: Any) -> Value:
    """Return the value; an array, as ROS has lists, as a tuple."""
    plain: Value = value if isinstance(value, (str, int, float)) else tuple(map(float, value))
    return plain
