# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Parameters that name the driver nodes of lenses, and say how these take a focus."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from focus_planner.core.rig.camera import check_camera_name
from focus_planner.core.validation import InputError, check_choice
from focus_planner.io.yaml_values import read_yaml
from focus_planner.lenses.profiles import (
    CAMERA,
    CUSTOM,
    DRIVERS,
    LENS,
    PROFILES,
    Assignment,
    DriverProfile,
)
from focus_planner.parameters.declaration import Declaration, one_of

# rclpy takes an empty list for a list of bytes.
NONE = ("",)

# These nodes read their parameters once.
declare = partial(Declaration, read_only=True)

DRIVER_DECLARATIONS = (
    declare(
        "cameras", NONE, "Names of the cameras, as in the planner's rig: [cam_0_00, cam_0_01, ...]."
    ),
    declare(
        "driver_node",
        "",
        "Name of a camera's driver node, in which {camera} stands for the camera's name; one that"
        " does not begin with / is in this node's own namespace. '' for the driver's usual one: "
        + ", ".join(f"{profile.node} ({name})" for name, profile in PROFILES.items())
        + f", {DriverProfile.node} ({CUSTOM}).",
    ),
    declare(
        "driver_nodes",
        NONE,
        "Driver nodes whose names do not follow driver_node, each as camera=name.",
    ),
    declare("driver", "camera_ros", "Kind of driver. " + one_of(DRIVERS)),
    declare(
        "lens",
        "",
        "What the driver calls a camera's lens, where its node has several: depthai's parameters"
        " begin with it, in others it stands for {lens}. {camera} stands for the camera's name. ''"
        " for rgb with depthai, else the camera's name.",
    ),
    declare("lenses", NONE, "Lenses that are not called as lens says, each as camera=lens."),
    declare(
        "parameter",
        "",
        "Name of the driver's parameter that moves the lens; {camera} and {lens} stand for the"
        " camera's name and its lens's. Only with driver custom.",
    ),
    declare("whole", False, "Whether that parameter is an integer. Only with driver custom."),
    declare(
        "first",
        NONE,
        "What to set before that parameter, in this order, each as name=value: what ends autofocus."
        " Parameters that the driver does not have are left out. Only with driver custom.",
    ),
    declare(
        "one_by_one",
        False,
        "Whether they are set in calls of their own, for a driver that heeds only what was set"
        " before a call; else all in one. Only with driver custom.",
    ),
)


@dataclass(frozen=True)
class LensAddress:
    """Where a camera's lens is.

    Attributes
    ----------
    node : str
        Full name of the driver node.
    profile : DriverProfile
        With the names of this lens's parameters.
    """

    node: str
    profile: DriverProfile


def addresses(
    values: Mapping[str, Any], namespace: str, unit: str, measures: bool = False
) -> dict[str, LensAddress]:
    """Return the lenses by camera.

    Parameters
    ----------
    values : mapping of str to value
        All parameters of ``DRIVER_DECLARATIONS``.
    namespace : str
        Of the node that has these parameters.
    unit : str
        Of a custom driver.
    measures : bool
        Whether a custom driver measures where the lens is.

    Raises
    ------
    InputError
        If values contradict each other.
    """
    profile = _profile(values, unit, measures)
    cameras = _cameras(given(values["cameras"]))
    nodes = _by_camera("driver_nodes", "cam_0=/left/camera", values, cameras)
    lenses = _by_camera("lenses", "cam_0=left", values, cameras)
    if (values["lens"] or lenses) and LENS not in profile.parameter:
        raise InputError(
            "lens",
            f"nothing with driver {values['driver']}, whose parameters do not name lenses",
            repr(values["lens"] or next(iter(lenses.values()))),
        )
    pattern = values["driver_node"] or profile.node
    found = {
        camera: LensAddress(
            full_name("driver_node", nodes.get(camera, pattern).replace(CAMERA, camera), namespace),
            profile.of(camera, lenses.get(camera, values["lens"])),
        )
        for camera in cameras
    }
    _check_distinct(found.values())
    return found


def full_name(parameter: str, name: str, namespace: str) -> str:
    """Return a node's full name; a relative name is in the namespace.

    Raises
    ------
    InputError
        If it is no name of a node.
    """
    if not name or name.startswith("~") or name.endswith("/") or "//" in name:
        expected = "a node's name, like left/camera or /left/camera"
        raise InputError(parameter, expected, repr(name))
    return name if name.startswith("/") else f"{namespace.rstrip('/')}/{name}"


def only_custom(values: Mapping[str, Any], name: str, value: Any) -> Any:
    """Return a value that only a custom driver may have.

    Raises
    ------
    InputError
        If another driver has one.
    """
    if value and values["driver"] != CUSTOM:
        raise InputError(
            name,
            f"nothing with driver {values['driver']}, which has its own",
            repr(value),
            f"give driver:={CUSTOM}, or leave it out",
        )
    return value


def check_known(parameter: str, names: Any, cameras: Any) -> Any:
    """Return names of cameras.

    Raises
    ------
    InputError
        If one is none.
    """
    for name in names:
        if name not in cameras:
            raise InputError(parameter, "names listed in cameras", repr(name))
    return names


def given(entries: Sequence[str]) -> tuple[str, ...]:
    """Return a list of strings without the empty one that stands for none."""
    return tuple(entry for entry in entries if entry)


def _profile(values: Mapping[str, Any], unit: str, measures: bool) -> DriverProfile:
    driver = check_choice("driver", values["driver"], DRIVERS)
    parameter, whole, one_by_one = (
        only_custom(values, name, values[name]) for name in ("parameter", "whole", "one_by_one")
    )
    first = only_custom(values, "first", given(values["first"]))
    only_custom(values, "measures", measures)
    if driver != CUSTOM:
        return PROFILES[driver]
    if not parameter:
        raise InputError("parameter", "the name of the driver's parameter", "''")
    assignments = tuple(_assignment(entry) for entry in first)
    return DriverProfile(parameter, unit, whole, assignments, not one_by_one, measures)


def _assignment(entry: str) -> Assignment:
    name, equals, text = entry.partition("=")
    try:
        value = read_yaml("first", text)
    except InputError:
        value = None
    if not (name and equals) or not isinstance(value, (bool, int, float, str)):
        raise InputError("first", "entries like autofocus=false or AfMode=0", repr(entry))
    return name, value


def _by_camera(
    parameter: str, example: str, values: Mapping[str, Any], cameras: Sequence[str]
) -> dict[str, str]:
    """Return what is said of single cameras."""
    found = {}
    for entry in given(values[parameter]):
        camera, equals, name = entry.partition("=")
        if not (camera and equals and name):
            raise InputError(parameter, f"entries like {example}", repr(entry))
        found[camera] = name
    check_known(parameter, found, cameras)
    return found


def _check_distinct(lenses: Iterable[LensAddress]) -> None:
    counts = Counter((lens.node, lens.profile.parameter) for lens in lenses)
    for (node, parameter), count in counts.items():
        if count > 1:
            raise InputError(
                "driver_node",
                "a node of its own for each camera, or a parameter",
                f"{parameter} of {node!r} for several cameras",
                f"write {CAMERA} where the camera's name belongs, or tell their lenses",
            )


def _cameras(names: Sequence[str]) -> Sequence[str]:
    if not names:
        raise InputError(
            "cameras", "the names of cameras", "none", "name them, as in cameras:=[cam_0, cam_1]"
        )
    twice = [name for name, count in Counter(names).items() if count > 1]
    if twice:
        raise InputError("cameras", "each name once", f"{twice[0]!r} twice")
    for name in names:
        check_camera_name(name, names)
    return names
