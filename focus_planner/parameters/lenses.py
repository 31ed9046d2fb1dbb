"""Parameters of the lens adapter and of simulated lenses, and the settings they amount to."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from focus_planner.core.rig.lens_table import LensTable
from focus_planner.core.validation import InputError, check_choice
from focus_planner.io.lens_tables import load_lens_tables
from focus_planner.lenses.control import Timeouts
from focus_planner.lenses.driver import (
    CUSTOM,
    DEVICE,
    DRIVERS,
    PROFILES,
    UNITS,
    DriverProfile,
    Tolerance,
)
from focus_planner.lenses.simulation import LensMechanics
from focus_planner.parameters.declaration import (
    FAR,
    MAX_INTEGER,
    Declaration,
    one_of,
    with_defaults,
)

_CAMERA = "{camera}"

# rclpy takes an empty list for a list of bytes.
_NONE = ("",)

_REFUSE, _CLAMP = "refuse", "clamp"

_POSITION, _COMMAND = "position", "command"

# The usual travel: dioptres of a phone's lens, steps of a webcam's.
_TRAVEL = {"camera_ros": 10.0, "v4l2_camera": 250.0, CUSTOM: 1.0}

_TIMEOUTS, _TOLERANCE = Timeouts(), Tolerance()

# These nodes read their parameters once.
_declare = partial(Declaration, read_only=True)

_DRIVER = (
    _declare("cameras", _NONE, "Names of the cameras, as in the planner's rig."),
    _declare(
        "driver_node",
        "/{camera}/camera",
        "Full name of a camera's driver node, in which {camera} stands for the camera's name.",
    ),
    _declare(
        "driver_nodes",
        _NONE,
        "Driver nodes whose names do not follow driver_node, each as camera=/full/name.",
    ),
    _declare("driver", "camera_ros", "Kind of driver. " + one_of(DRIVERS)),
    _declare(
        "parameter",
        "",
        "Name of the driver's parameter that moves the lens. Only with driver custom.",
    ),
    _declare("whole", False, "Whether that parameter is an integer. Only with driver custom."),
)

ADAPTER_DECLARATIONS = (
    _declare("planner", "/focus_planner", "Full name of the planner node."),
    *_DRIVER,
    _declare("unit", "", "Unit of that parameter. Only with driver custom. " + one_of(UNITS)),
    _declare(
        "lens_tables",
        "",
        "YAML file of lens tables, the same as the planner's; '' for none.",
    ),
    _declare(
        "tolerance",
        _TOLERANCE.absolute,
        "Greatest difference between the value read back and the value sent at which the lens"
        " counts as set, in the driver's unit.",
    ),
    _declare(
        "relative_tolerance",
        _TOLERANCE.relative,
        "What to add to tolerance, as a fraction of the value sent.",
        high=1.0,
    ),
    _declare(
        "timeout",
        _TIMEOUTS.timeout,
        "How long to wait for a driver's response, and for a driver to appear, in seconds.",
        low=0.01,
        high=600.0,
    ),
    _declare(
        "retries",
        _TIMEOUTS.retries,
        "How often a call that gets no response is repeated.",
        high=100,
    ),
    _declare(
        "settle_time",
        _TIMEOUTS.settle_time,
        "Time from sending a value to reading it back for the first time, in seconds.",
        high=600.0,
    ),
    _declare(
        "verify_timeout",
        _TIMEOUTS.verify_timeout,
        "How long after the first reading a lens may take to arrive before it is reported to"
        " differ, in seconds.",
        high=600.0,
    ),
    _declare(
        "poll_period",
        _TIMEOUTS.poll_period,
        "Time between two readings while a lens moves, in seconds.",
        low=0.01,
        high=600.0,
    ),
    _declare(
        "watch_period",
        _TIMEOUTS.watch_period,
        "Time between two readings of a lens that has arrived, in seconds: one that has moved"
        " since is sent its value again. 0 to stop reading it.",
        high=86400.0,
    ),
)

SIMULATION_DECLARATIONS = (
    *_DRIVER,
    _declare("min_value", 0.0, "Lower end of the lens's travel, in the driver's unit.", low=-FAR),
    _declare(
        "max_value",
        0.0,
        "Upper end of the lens's travel, in the driver's unit; 0 for the driver's usual one: "
        + ", ".join(f"{name} {travel:g}" for name, travel in _TRAVEL.items())
        + ".",
        low=-FAR,
    ),
    _declare(
        "beyond_limits",
        _REFUSE,
        "What happens to a value beyond the travel. " + one_of((_REFUSE, _CLAMP)),
    ),
    _declare(
        "speed",
        0.0,
        "Speed of the lens, in the driver's unit per second; 0 for a lens that arrives at once.",
    ),
    _declare(
        "latency", 0.0, "Time from a command to the start of the movement, in seconds.", high=600.0
    ),
    _declare(
        "backlash",
        0.0,
        "How far above its motor's position a downward movement leaves the lens, in the driver's"
        " unit.",
    ),
    _declare("step", 0.0, "Step of the motor, in the driver's unit; 0 for a motor without steps."),
    _declare(
        "reports",
        _POSITION,
        "What is read back: the position of the lens, or the last command, as with most drivers. "
        + one_of((_POSITION, _COMMAND)),
    ),
    _declare("autofocus", True, "Whether autofocus is on at the start, as in most cameras."),
    _declare("failure_rate", 0.0, "Fraction of commands refused at random.", high=1.0),
    _declare("seed", 0, "Seed of the random refusals.", high=MAX_INTEGER),
    _declare("stuck", _NONE, "Names of the cameras whose lens never moves."),
)


@dataclass(frozen=True)
class AdapterSettings:
    """The settings that the adapter's parameters amount to.

    Attributes
    ----------
    planner : str
        Full name of the planner node.
    nodes : mapping of str to str
        Full names of the driver nodes by camera.
    profile : DriverProfile
    tables : mapping of str to LensTable
        Lens tables of the cameras that have one.
    tolerance : Tolerance
    timeouts : Timeouts
    """

    planner: str
    nodes: Mapping[str, str]
    profile: DriverProfile
    tables: Mapping[str, LensTable]
    tolerance: Tolerance
    timeouts: Timeouts

    @classmethod
    def from_values(cls, values: Mapping[str, Any]) -> AdapterSettings:
        """Return the settings that parameters amount to; those left out have their defaults.

        Raises
        ------
        InputError
            If values contradict each other, or the lens tables cannot be read.
        """
        values = with_defaults(ADAPTER_DECLARATIONS, values)
        unit = _custom(values, "unit", values["unit"])
        if values["driver"] == CUSTOM:
            check_choice("unit", unit, UNITS)
        nodes = _nodes(values)
        return cls(
            planner=_full_name("planner", values["planner"]),
            nodes=nodes,
            profile=_profile(values, unit),
            tables=_tables(values["lens_tables"], nodes),
            tolerance=Tolerance(values["tolerance"], values["relative_tolerance"]),
            timeouts=Timeouts(
                timeout=values["timeout"],
                retries=values["retries"],
                settle_time=values["settle_time"],
                verify_timeout=values["verify_timeout"],
                poll_period=values["poll_period"],
                watch_period=values["watch_period"],
            ),
        )


@dataclass(frozen=True)
class SimulationSettings:
    """The settings that the parameters of simulated lenses amount to.

    Attributes
    ----------
    nodes : mapping of str to str
        Full names of the driver nodes by camera.
    profile : DriverProfile
    mechanics : LensMechanics
    clamps : bool
        Whether values beyond the limits are clamped rather than refused.
    reports_position : bool
        Whether the position of a lens is read back rather than the last command.
    autofocus : bool
        Whether autofocus is on at the start.
    failure_rate : float
        Fraction of commands refused at random.
    seed : int
    stuck : frozenset of str
        Cameras whose lens never moves.
    """

    nodes: Mapping[str, str]
    profile: DriverProfile
    mechanics: LensMechanics
    clamps: bool
    reports_position: bool
    autofocus: bool
    failure_rate: float
    seed: int
    stuck: frozenset[str]

    @classmethod
    def from_values(cls, values: Mapping[str, Any]) -> SimulationSettings:
        """Return the settings that parameters amount to; those left out have their defaults.

        Raises
        ------
        InputError
            If values contradict each other.
        """
        values = with_defaults(SIMULATION_DECLARATIONS, values)
        nodes = _nodes(values)
        limits = check_choice("beyond_limits", values["beyond_limits"], (_REFUSE, _CLAMP))
        reports = check_choice("reports", values["reports"], (_POSITION, _COMMAND))
        return cls(
            nodes=nodes,
            profile=_profile(values, DEVICE),
            mechanics=_mechanics(values),
            clamps=limits == _CLAMP,
            reports_position=reports == _POSITION,
            autofocus=values["autofocus"],
            failure_rate=values["failure_rate"],
            seed=values["seed"],
            stuck=frozenset(_known("stuck", _given(values["stuck"]), nodes)),
        )


def _profile(values: Mapping[str, Any], unit: str) -> DriverProfile:
    driver = check_choice("driver", values["driver"], DRIVERS)
    parameter = _custom(values, "parameter", values["parameter"])
    whole = _custom(values, "whole", values["whole"])
    if driver != CUSTOM:
        return PROFILES[driver]
    if not parameter:
        raise InputError("parameter", "the name of the driver's parameter", "''")
    return DriverProfile(parameter, unit, whole)


def _custom(values: Mapping[str, Any], name: str, value: Any) -> Any:
    if value and values["driver"] != CUSTOM:
        raise InputError(
            name,
            f"nothing with driver {values['driver']}, which has its own",
            repr(value),
            f"give driver:={CUSTOM}, or leave it out",
        )
    return value


def _mechanics(values: Mapping[str, Any]) -> LensMechanics:
    low, high = values["min_value"], values["max_value"] or _TRAVEL[values["driver"]]
    if high <= low:
        raise InputError("max_value", f"more than min_value, {low:g}", f"{high:g}")
    return LensMechanics(
        low=low,
        high=high,
        speed=values["speed"] or math.inf,
        latency=values["latency"],
        backlash=values["backlash"],
        step=values["step"],
    )


def _tables(path: str, cameras: Iterable[str]) -> dict[str, LensTable]:
    if not path:
        return {}
    tables = load_lens_tables(path)
    found = {camera: tables.cameras.get(camera, tables.default) for camera in cameras}
    return {camera: table for camera, table in found.items() if table is not None}


def _nodes(values: Mapping[str, Any]) -> dict[str, str]:
    cameras = _cameras(_given(values["cameras"]))
    others = dict(_assignment(entry) for entry in _given(values["driver_nodes"]))
    _known("driver_nodes", others, cameras)
    pattern = values["driver_node"]
    nodes = {
        camera: _full_name("driver_node", others.get(camera, pattern.replace(_CAMERA, camera)))
        for camera in cameras
    }
    shared = [node for node, count in Counter(nodes.values()).items() if count > 1]
    if shared:
        raise InputError(
            "driver_node",
            "a node of its own for each camera",
            f"{shared[0]!r} for several cameras",
            f"write {_CAMERA} where the camera's name belongs",
        )
    return nodes


def _cameras(names: Sequence[str]) -> Sequence[str]:
    if not names:
        raise InputError(
            "cameras", "the names of cameras", "none", "name them, as in cameras:=[cam_0, cam_1]"
        )
    twice = [name for name, count in Counter(names).items() if count > 1]
    if twice:
        raise InputError("cameras", "each name once", f"{twice[0]!r} twice")
    return names


def _known(parameter: str, names: Any, cameras: Any) -> Any:
    for name in names:
        if name not in cameras:
            raise InputError(parameter, "names listed in cameras", repr(name))
    return names


def _assignment(entry: str) -> tuple[str, str]:
    camera, equals, node = entry.partition("=")
    if not (camera and equals and node):
        raise InputError("driver_nodes", "entries like cam_0=/left/camera", repr(entry))
    return camera, node


def _full_name(parameter: str, name: str) -> str:
    if not name.startswith("/") or name.endswith("/"):
        raise InputError(parameter, "a node's full name, like /left/camera", repr(name))
    return name


def _given(entries: Sequence[str]) -> tuple[str, ...]:
    return tuple(entry for entry in entries if entry)
