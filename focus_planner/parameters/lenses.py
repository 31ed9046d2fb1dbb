# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Parameters of the lens adapter and of simulated lenses, and the settings they amount to."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from focus_planner.core.rig.lens_table import LensTable
from focus_planner.core.validation import InputError, check_choice
from focus_planner.io.lens_tables import load_lens_tables
from focus_planner.lenses.calls import Timeouts
from focus_planner.lenses.driver import Tolerance
from focus_planner.lenses.profiles import CUSTOM, DEVICE, UNITS
from focus_planner.lenses.simulation import LensMechanics
from focus_planner.parameters.declaration import FAR, MAX_INTEGER, one_of, with_defaults
from focus_planner.parameters.drivers import (
    DRIVER_DECLARATIONS,
    NONE,
    LensAddress,
    addresses,
    check_known,
    declare,
    full_name,
    given,
    only_custom,
)

_REFUSE, _CLAMP = "refuse", "clamp"

_POSITION, _COMMAND = "position", "command"

# The usual travel: dioptres of a phone's lens, steps of a webcam's, the range of depthai's r_focus.
_TRAVEL = {
    "camera_ros": 10.0,
    "v4l2_camera": 250.0,
    "usb_cam": 250.0,
    "depthai": 255.0,
    CUSTOM: 1.0,
}

_TIMEOUTS, _TOLERANCE = Timeouts(), Tolerance()

_CUSTOM_DRIVER = (
    declare("unit", "", "Unit of that parameter. Only with driver custom. " + one_of(UNITS)),
    declare(
        "measures",
        False,
        "Whether that parameter reads back where the lens is, measured by the driver, and not what"
        " was set: only then a lens is verified by it. Only with driver custom.",
    ),
)

#: Parameters that name the driver nodes of lenses, and say how these take a focus.
ABOUT_DRIVERS = (*DRIVER_DECLARATIONS, *_CUSTOM_DRIVER)

ADAPTER_DECLARATIONS = (
    declare(
        "planner",
        "focus_planner",
        "Name of the planner node; one that does not begin with / is in this node's own namespace.",
    ),
    *ABOUT_DRIVERS,
    declare(
        "lens_tables",
        "",
        "YAML file of lens tables, the same as the planner's; '' for none.",
    ),
    declare(
        "tolerance",
        _TOLERANCE.absolute,
        "Greatest difference between the value read back and the value sent at which the lens"
        " counts as set, in the driver's unit.",
    ),
    declare(
        "relative_tolerance",
        _TOLERANCE.relative,
        "What to add to tolerance, as a fraction of the value sent.",
        high=1.0,
    ),
    declare(
        "timeout",
        _TIMEOUTS.timeout,
        "How long to wait for a driver's response, for a driver to appear, and for the next frame"
        " of a lens that has arrived, in seconds.",
        low=0.01,
        high=600.0,
    ),
    declare(
        "retries",
        _TIMEOUTS.retries,
        "How often a call that gets no response is repeated.",
        high=100,
    ),
    declare(
        "settle_time",
        _TIMEOUTS.settle_time,
        "Time from sending a value to reading it back for the first time, in seconds.",
        high=600.0,
    ),
    declare(
        "verify_timeout",
        _TIMEOUTS.verify_timeout,
        "How long after the first reading a lens may take to arrive, in seconds: then it is sent"
        " its value once more, and after as long again it is reported to differ.",
        high=600.0,
    ),
    declare(
        "poll_period",
        _TIMEOUTS.poll_period,
        "Time between two readings while a lens moves, in seconds.",
        low=0.01,
        high=600.0,
    ),
    declare(
        "watch_period",
        _TIMEOUTS.watch_period,
        "Time between two readings of a lens that has arrived, in seconds: one that has moved"
        " since is sent its value once more. 0 to stop reading it.",
        high=86400.0,
    ),
)

SIMULATION_DECLARATIONS = (
    *DRIVER_DECLARATIONS,
    declare("min_value", 0.0, "Lower end of the lens's travel, in the driver's unit.", low=-FAR),
    declare(
        "max_value",
        0.0,
        "Upper end of the lens's travel, in the driver's unit; 0 for the driver's usual one: "
        + ", ".join(f"{name} {travel:g}" for name, travel in _TRAVEL.items())
        + ".",
        low=-FAR,
    ),
    declare(
        "beyond_limits",
        _REFUSE,
        "What happens to a value beyond the travel. " + one_of((_REFUSE, _CLAMP)),
    ),
    declare(
        "speed",
        0.0,
        "Speed of the lens, in the driver's unit per second; 0 for a lens that arrives at once.",
    ),
    declare(
        "latency", 0.0, "Time from a command to the start of the movement, in seconds.", high=600.0
    ),
    declare(
        "backlash",
        0.0,
        "How far above its motor's position a downward movement leaves the lens, in the driver's"
        " unit.",
    ),
    declare("step", 0.0, "Step of the motor, in the driver's unit; 0 for a motor without steps."),
    declare(
        "reports",
        _COMMAND,
        "What the parameter reads back: the last command, as with most drivers, or the position of"
        " the lens, only with driver custom. " + one_of((_COMMAND, _POSITION)),
    ),
    declare(
        "frame_rate",
        10.0,
        "Frames per second with driver camera_ros: what was set takes effect with the next one.",
        low=0.1,
        high=1000.0,
    ),
    declare(
        "metadata",
        True,
        "Whether frames tell where the lens is, on /diagnostics: camera_ros does from 0.7 on.",
    ),
    declare("autofocus", True, "Whether autofocus is on at the start, as in most cameras."),
    declare("failure_rate", 0.0, "Fraction of commands refused at random.", high=1.0),
    declare("seed", 0, "Seed of the random refusals.", high=MAX_INTEGER),
    declare("stuck", NONE, "Names of the cameras whose lens never moves."),
)


@dataclass(frozen=True)
class AdapterSettings:
    """The settings that the adapter's parameters amount to.

    Attributes
    ----------
    planner : str
        Full name of the planner node.
    lenses : mapping of str to LensAddress
        The lenses by camera.
    tables : mapping of str to LensTable
        Lens tables of the cameras that have one.
    tolerance : Tolerance
    timeouts : Timeouts
    """

    planner: str
    lenses: Mapping[str, LensAddress]
    tables: Mapping[str, LensTable]
    tolerance: Tolerance
    timeouts: Timeouts

    @classmethod
    def from_values(cls, values: Mapping[str, Any], namespace: str = "/") -> AdapterSettings:
        """Return the settings that parameters amount to; those left out have their defaults.

        Parameters
        ----------
        values : mapping of str to value
        namespace : str
            Of the node, in which relative names are.

        Raises
        ------
        InputError
            If values contradict each other, or the lens tables cannot be read.
        """
        values = with_defaults(ADAPTER_DECLARATIONS, values)
        unit = only_custom(values, "unit", values["unit"])
        if values["driver"] == CUSTOM:
            check_choice("unit", unit, UNITS)
        lenses = addresses(values, namespace, unit, measures=values["measures"])
        return cls(
            planner=full_name("planner", values["planner"], namespace),
            lenses=lenses,
            tables=_tables(values["lens_tables"], lenses),
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
    driver : str
        Kind of driver.
    lenses : mapping of str to LensAddress
        The lenses by camera.
    mechanics : LensMechanics
    clamps : bool
        Whether values beyond the limits are clamped rather than refused.
    reports_position : bool
        Whether the position of a lens is read back rather than the last command.
    frame_rate : float
        Frames per second.
    metadata : bool
        Whether frames tell where the lens is.
    autofocus : bool
        Whether autofocus is on at the start.
    failure_rate : float
        Fraction of commands refused at random.
    seed : int
    stuck : frozenset of str
        Cameras whose lens never moves.
    """

    driver: str
    lenses: Mapping[str, LensAddress]
    mechanics: LensMechanics
    clamps: bool
    reports_position: bool
    frame_rate: float
    metadata: bool
    autofocus: bool
    failure_rate: float
    seed: int
    stuck: frozenset[str]

    @classmethod
    def from_values(cls, values: Mapping[str, Any], namespace: str = "/") -> SimulationSettings:
        """Return the settings that parameters amount to; those left out have their defaults.

        Parameters
        ----------
        values : mapping of str to value
        namespace : str
            Of the node, in which relative names are.

        Raises
        ------
        InputError
            If values contradict each other.
        """
        values = with_defaults(SIMULATION_DECLARATIONS, values)
        lenses = addresses(values, namespace, DEVICE)
        limits = check_choice("beyond_limits", values["beyond_limits"], (_REFUSE, _CLAMP))
        reports = check_choice("reports", values["reports"], (_COMMAND, _POSITION))
        if reports == _POSITION:
            only_custom(values, "reports", reports)
        return cls(
            driver=values["driver"],
            lenses=lenses,
            mechanics=_mechanics(values),
            clamps=limits == _CLAMP,
            reports_position=reports == _POSITION,
            frame_rate=values["frame_rate"],
            metadata=values["metadata"],
            autofocus=values["autofocus"],
            failure_rate=values["failure_rate"],
            seed=values["seed"],
            stuck=frozenset(check_known("stuck", given(values["stuck"]), lenses)),
        )


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
    found = {camera: tables.table_of(camera) for camera in cameras}
    return {camera: table for camera, table in found.items() if table is not None}
