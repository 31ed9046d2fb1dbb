"""The planner's parameters: what they mean, their ranges, and the settings that they amount to."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from focus_planner.core.planning.request import (
    BOUNDS,
    MAX_SAMPLES,
    MAX_SHOTS,
    METHODS,
    SCOPES,
    TUPLES,
    PlanRequest,
)
from focus_planner.core.problem.cost_model import CostModel
from focus_planner.core.rig.camera import CameraIntrinsics
from focus_planner.core.rig.lens import Lens
from focus_planner.core.rig.lens_table import MAX_FOCUS_STEPS
from focus_planner.core.validation import InputError, check_choice
from focus_planner.io.lens_tables import LensTables, lens_tables_from_yaml, load_lens_tables
from focus_planner.messages.limits import Limits
from focus_planner.messages.reading import Optics, lens_from_message
from focus_planner.parameters.declaration import _FAR, Declaration, Value, _one_of

_MAX_COUNT = 2**31 - 1

_MAX_SEED = 2**63 - 1

#: What becomes of a goal that comes while others are planned or wait.
OVERLAPS = ("queue", "preempt", "refuse")

# rclpy takes an empty list for one of bytes.
_ANY_DISTANCE = (0.0,)

# Parameters have no place for one: it is in a file.
_NO_TABLE = SimpleNamespace(unit="", whole=False, distances=(), values=())

_REQUEST, _IMAGE, _LENS, _MODEL = PlanRequest(), CameraIntrinsics(), Lens(), CostModel()

_NEXT_CALL = " A change applies from the next request on."

_POSES = " For cameras that bring none of their own." + _NEXT_CALL

_COST = " The paper's Eq. 1." + _NEXT_CALL

DECLARATIONS = (
    Declaration(
        "frame_id",
        "world",
        "Frame of the surface and of the rig. Messages in another frame are refused, a mesh has no"
        " frame of its own and is taken to be in this one.",
        read_only=True,
    ),
    Declaration(
        "method",
        _REQUEST.method,
        "Solver for requests that name none. " + _one_of(METHODS) + _NEXT_CALL,
    ),
    Declaration(
        "k",
        _REQUEST.k,
        "Number of cameras that k_view moves together." + _NEXT_CALL,
        low=2,
        high=3,
    ),
    Declaration(
        "scope",
        _REQUEST.scope,
        "Samples that a k_view step may re-assign. " + _one_of(SCOPES) + _NEXT_CALL,
    ),
    Declaration(
        "tuples",
        _REQUEST.tuples,
        "What makes cameras move together in k_view: that they see the same surface, or that they"
        " are neighbours on the rig's grid. " + _one_of(TUPLES) + _NEXT_CALL,
    ),
    Declaration(
        "samples",
        _REQUEST.samples,
        "Number of surface samples to plan on; 0 takes a cloud's points themselves, and on a mesh"
        " as many as standard_error asks for." + _NEXT_CALL,
        high=MAX_SAMPLES,
    ),
    Declaration(
        "fresh_samples",
        _REQUEST.fresh_samples,
        "Number of samples that the solver does not see, to judge the plan on." + _NEXT_CALL,
        low=2,
        high=MAX_SAMPLES,
    ),
    Declaration(
        "standard_error",
        _REQUEST.standard_error,
        "Standard error that a plan's cost on fresh samples is to have, in the cost's unit, above"
        " 0. Read only where samples is 0 on a mesh: both numbers of samples are then chosen for"
        " it." + _NEXT_CALL,
    ),
    Declaration("seed", _REQUEST.seed, "Seed of the sampling." + _NEXT_CALL, high=_MAX_SEED),
    Declaration(
        "time_budget",
        0.0,
        "Seconds after which the planner stops with its best plan so far, and its bound; 0 for no"
        " limit. Samples that half of them do not suffice for are left out." + _NEXT_CALL,
    ),
    Declaration(
        "bound",
        _REQUEST.bound,
        "What to spend on proving how near a plan is to the best; optimal always proves it. "
        + _one_of(BOUNDS)
        + _NEXT_CALL,
    ),
    Declaration(
        "gap",
        _REQUEST.gap,
        "How near the best is near enough for optimal, and for a tight bound, as a part of the"
        " cost." + _NEXT_CALL,
        high=1,
    ),
    Declaration(
        "warm_start",
        False,
        "Start from the last plan and its prices: sooner done after small changes of the surface"
        " or the poses, but the same request need not give the same plan." + _NEXT_CALL,
    ),
    Declaration(
        "shots",
        _REQUEST.shots,
        "Number of pictures that each camera takes, each with a focus distance of its own."
        + _NEXT_CALL,
        low=1,
        high=MAX_SHOTS,
    ),
    Declaration(
        "depth_tolerance",
        _REQUEST.depth_tolerance,
        "Metres that the depth of the surface may be off either way: only what is then still in"
        " focus counts as in focus." + _NEXT_CALL,
    ),
    Declaration(
        "image.width", _IMAGE.width, "Image width, pixels." + _POSES, low=1, high=_MAX_COUNT
    ),
    Declaration(
        "image.height", _IMAGE.height, "Image height, pixels." + _POSES, low=1, high=_MAX_COUNT
    ),
    Declaration("image.fx", _IMAGE.fx, "Horizontal focal length, pixels, above 0." + _POSES),
    Declaration("image.fy", _IMAGE.fy, "Vertical focal length, pixels, above 0." + _POSES),
    Declaration(
        "image.cx", _IMAGE.cx, "Principal point from the left, pixels." + _POSES, low=-_FAR
    ),
    Declaration("image.cy", _IMAGE.cy, "Principal point from the top, pixels." + _POSES, low=-_FAR),
    Declaration("lens.focal_length", _LENS.focal_length, "Focal length, metres, above 0." + _POSES),
    Declaration(
        "lens.hyperfocal_distance",
        _LENS.hyperfocal_distance,
        "Hyperfocal distance, metres; 0 to compute it from lens.f_number and"
        " lens.circle_of_confusion." + _POSES,
    ),
    Declaration(
        "lens.f_number",
        0.0,
        "Focal length over aperture diameter; read only where lens.hyperfocal_distance is 0."
        + _POSES,
    ),
    Declaration(
        "lens.circle_of_confusion",
        0.0,
        "Largest blur on the sensor that counts as sharp, metres; read only where"
        " lens.hyperfocal_distance is 0." + _POSES,
    ),
    Declaration("lens.min_focus", _LENS.min_focus, "Nearest focus distance, metres." + _POSES),
    Declaration("lens.max_focus", 0.0, "Farthest focus distance, metres; 0 for no limit." + _POSES),
    Declaration(
        "lens.focus_distances",
        _ANY_DISTANCE,
        "The only distances that the lens can be set to, metres; [0.0] if it takes all between its"
        " limits." + _POSES,
    ),
    Declaration(
        "lens.focus_steps",
        0,
        "Number of positions that the lens has from lens.min_focus to lens.max_focus, equally"
        " spaced in dioptres; 0 if it has no steps." + _POSES,
        high=MAX_FOCUS_STEPS,
    ),
    Declaration(
        "lens_tables",
        "",
        "YAML file of lens tables, by camera: what lens drivers want to be told, for cameras that"
        " bring none of their own; '' for none. It is read when this is set, and set again to read"
        " it again." + _NEXT_CALL,
    ),
    Declaration(
        "cost.projected_area_weight",
        _MODEL.projected_area_weight,
        "w1, the weight of the projected area." + _COST,
        high=1,
    ),
    Declaration(
        "cost.axis_deviation_weight",
        _MODEL.axis_deviation_weight,
        "w2, the weight of the distance from the optical axis." + _COST,
        high=1,
    ),
    Declaration(
        "cost.focus_weight",
        _MODEL.focus_weight,
        "w3, the weight of being out of focus. The three sum to at most 1." + _COST,
        high=1,
    ),
    Declaration(
        "cost.projected_area_scale",
        _MODEL.projected_area_scale,
        "epsilon1, the scale of the projected area's cost, 1/m^2." + _COST,
    ),
    Declaration(
        "cost.axis_deviation_limit",
        _MODEL.axis_deviation_limit,
        "epsilon2, metres from the optical axis at which that cost is full, above 0." + _COST,
    ),
    Declaration(
        "max_points",
        5_000_000,
        "Number of points that a cloud may have; a larger one is refused before it is read. 0 for"
        " no limit. A change applies to the clouds that come after it.",
        high=_MAX_COUNT,
    ),
    Declaration(
        "max_triangles",
        5_000_000,
        "Number of triangles that a mesh may have, and of vertices three times as many; a larger"
        " one is refused before it is read. 0 for no limit. A change applies to the meshes that"
        " come after it.",
        high=_MAX_COUNT,
    ),
    Declaration(
        "max_cameras",
        20_000,
        "Number of cameras that a rig may have, each of which has a topic; a larger one is refused"
        " before it is read. 0 for no limit. A change applies to the rigs that come after it.",
        high=_MAX_COUNT,
    ),
    Declaration(
        "record_directory",
        "",
        "Folder below which every run is recorded, one folder each; '' to record none. It is made"
        " where it is missing." + _NEXT_CALL,
        plans=False,
    ),
    Declaration(
        "record_markers",
        False,
        "Whether a recorded run holds markers too, which show what the plan is worth, in 3D."
        + _NEXT_CALL,
        plans=False,
    ),
    Declaration(
        "record_max_runs",
        0,
        "Number of runs that record_directory keeps: the oldest are deleted, never the newest; 0"
        " for no limit." + _NEXT_CALL,
        high=_MAX_COUNT,
        plans=False,
    ),
    Declaration(
        "record_max_bytes",
        0,
        "Bytes that the runs of record_directory may take together: the oldest are deleted, never"
        " the newest; 0 for no limit." + _NEXT_CALL,
        high=_MAX_SEED,
        plans=False,
    ),
    Declaration(
        "autostart",
        True,
        "Whether the node configures and activates itself when it starts; false leaves that to"
        " whoever manages its life cycle.",
        read_only=True,
        plans=False,
    ),
    Declaration(
        "overlap",
        OVERLAPS[0],
        "What becomes of a goal of ~/plan that comes while others are planned or wait. queue: it"
        " waits for its turn. preempt: goals before it end with the best plan so far, which is"
        " answered and not published. refuse: it is rejected. Calls of ~/plan_focus always wait for"
        " their turn. " + _one_of(OVERLAPS) + _NEXT_CALL,
        plans=False,
    ),
    Declaration(
        "service_max_wait",
        5.0,
        "Seconds that a call of ~/plan_focus waits for its turn before it is answered that the"
        " planner is busy." + _NEXT_CALL,
        plans=False,
    ),
    Declaration(
        "max_waiting",
        100,
        "Number of requests that may wait for their turn; a call beyond is answered that the"
        " planner is busy, a goal is rejected." + _NEXT_CALL,
        low=1,
        high=100_000,
        plans=False,
    ),
    Declaration(
        "status_period",
        1.0,
        "Seconds between messages on ~/status and on /diagnostics; ~/status is also published when"
        " it changes, at most ten times a second. A change applies at once.",
        low=0.1,
        high=3600.0,
        plans=False,
    ),
    Declaration(
        "max_input_age",
        0.0,
        "Seconds after which a surface or a rig is reported as old on /diagnostics; it is planned"
        " with all the same. 0 for no limit. A change applies at once.",
        plans=False,
    ),
)


@dataclass(frozen=True)
class Recording:
    """Whether, and how, runs are recorded.

    Attributes
    ----------
    directory : Path or None
        The folder that the runs' folders are in; None to record none.
    markers : bool
        Whether a run holds markers.
    max_runs, max_bytes : int
        What is kept at most; 0 for no limit.
    """

    directory: Path | None = None
    markers: bool = False
    max_runs: int = 0
    max_bytes: int = 0


@dataclass(frozen=True)
class Serving:
    """How requests are served, and what is told of it.

    Attributes
    ----------
    autostart : bool
        Whether the node configures and activates itself.
    overlap : {"queue", "preempt", "refuse"}
        What becomes of a goal that comes while others are planned or wait.
    service_max_wait : float
        Seconds that a call waits for its turn.
    max_waiting : int
        Requests that may wait.
    status_period : float
        Seconds between reports.
    max_input_age : float
        Seconds after which an input is reported as old.
    """

    autostart: bool = True
    overlap: str = OVERLAPS[0]
    service_max_wait: float = 5.0
    max_waiting: int = 100
    status_period: float = 1.0
    max_input_age: float = math.inf

    def __post_init__(self) -> None:
        check_choice("overlap", self.overlap, OVERLAPS)


@dataclass(frozen=True)
class Settings:
    """What the parameters amount to.

    Attributes
    ----------
    frame_id : str
    request : PlanRequest
        What a request takes that leaves something out.
    warm_start : bool
        Whether plans start from the last one.
    optics : Optics
        What a camera takes that brings no image, lens or lens table.
    model : CostModel
    limits : Limits
        How large a message may be.
    recording : Recording
    serving : Serving
    values : tuple
        The parameters that they were made of: names and values, as declared.
    """

    frame_id: str
    request: PlanRequest
    warm_start: bool
    optics: Optics
    model: CostModel
    limits: Limits
    recording: Recording
    serving: Serving
    values: tuple[tuple[str, Value], ...]

    @classmethod
    def from_values(
        cls, values: Mapping[str, Any], lens_tables_text: str | None = None
    ) -> Settings:
        """Return the settings of parameters by name; those left out have their defaults.

        Parameters
        ----------
        values : mapping
        lens_tables_text : str, optional
            What the file of the parameter ``lens_tables`` had in it when it was read, "" for none;
            without it the file is read.

        Raises
        ------
        InputError
            If a value is out of range, they contradict each other, or the file of lens tables
            cannot be used.
        """
        values = {d.name: d.default for d in DECLARATIONS} | dict(values)
        if not values["frame_id"]:
            raise InputError("frame_id", "the name of a frame", "''")
        lens = _group(values, "lens.")
        if tuple(lens["focus_distances"]) == _ANY_DISTANCE:
            lens["focus_distances"] = ()
        return cls(
            frame_id=values["frame_id"],
            request=PlanRequest(
                method=values["method"],
                samples=values["samples"],
                seed=values["seed"],
                k=values["k"],
                scope=values["scope"],
                tuples=values["tuples"],
                time_budget=values["time_budget"] or math.inf,
                shots=values["shots"],
                depth_tolerance=values["depth_tolerance"],
                fresh_samples=values["fresh_samples"],
                standard_error=values["standard_error"],
                bound=values["bound"],
                gap=values["gap"],
            ),
            warm_start=values["warm_start"],
            optics=Optics(
                intrinsics=CameraIntrinsics(**_group(values, "image.")),
                lens=lens_from_message(SimpleNamespace(**lens, table=_NO_TABLE)),
                tables=_lens_tables(values["lens_tables"], lens_tables_text),
            ),
            model=CostModel(**_group(values, "cost.")),
            limits=Limits(
                max_points=values["max_points"] or math.inf,
                max_triangles=values["max_triangles"] or math.inf,
                max_cameras=values["max_cameras"] or math.inf,
            ),
            recording=Recording(
                directory=_path("record_directory", "a folder", values["record_directory"]),
                markers=values["record_markers"],
                max_runs=values["record_max_runs"],
                max_bytes=values["record_max_bytes"],
            ),
            serving=Serving(
                autostart=values["autostart"],
                overlap=values["overlap"],
                service_max_wait=values["service_max_wait"],
                max_waiting=values["max_waiting"],
                status_period=values["status_period"],
                max_input_age=values["max_input_age"] or math.inf,
            ),
            values=tuple((d.name, _plain(values[d.name])) for d in DECLARATIONS),
        )

    @property
    def lens_tables(self) -> LensTables | None:
        """The lens tables in force."""
        return self.optics.tables

    @property
    def lens_tables_text(self) -> str:
        """The text of their file, "" for none."""
        return self.optics.tables.text if self.optics.tables else ""


def _group(values: Mapping[str, Any], prefix: str) -> dict[str, Any]:
    return {
        name.removeprefix(prefix): value
        for name, value in values.items()
        if name.startswith(prefix)
    }


def _lens_tables(name: str, text: str | None) -> LensTables | None:
    """Return the tables of a text, or else of a file."""
    if text is None:
        path = _path("lens_tables", "a file", name)
        return load_lens_tables(path) if path else None
    return lens_tables_from_yaml(text, name or "lens_tables") if text else None


def _path(parameter: str, what: str, name: str) -> Path | None:
    try:
        return Path(name).expanduser() if name else None
    except RuntimeError:
        raise InputError(parameter, what, f"{name!r}, of no known user") from None


def _plain(value: Any) -> Value:
    """Return the value, a list (ROS has it as an array) as a tuple."""
    plain: Value = value if isinstance(value, (str, int, float)) else tuple(map(float, value))
    return plain
