# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""``focus_planner rig cylinder | dome | turntable | gantry``: rigs of regular layout."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from focus_planner.cli.rig_options import (
    add_image_options,
    add_lens_options,
    errors_of_options,
    has_image,
    intrinsics_of,
    lens_of,
    print_rig,
)

if TYPE_CHECKING:
    from focus_planner.core.rig.rig import Rig

# The measures of cameras that look at a centre.
_CENTRED = ("radius", "lowest", "highest", "height")

_COUNT: dict[str, Any] = {"type": int, "metavar": "N"}
_METRES: dict[str, Any] = {"type": float, "metavar": "METRES"}
_DEGREES: dict[str, Any] = {"type": float, "metavar": "DEGREES"}


def add(kinds: Any) -> None:
    """Add the layouts."""
    _add_cylinder(kinds)
    _add_dome(kinds)
    _add_turntable(kinds)
    _add_gantry(kinds)


def _add_cylinder(kinds: Any) -> None:
    cylinder = kinds.add_parser(
        "cylinder",
        help="cameras on a cylinder, facing its axis",
        description="Print the rig.yaml of cameras on a cylinder about the z axis, which they face"
        " horizontally. Column j is at the angle 2πj/columns from +x; the order is row by row from"
        " the bottom. The defaults are the paper's.",
    )
    cylinder.set_defaults(command=_cylinder)
    _add_numbers(
        cylinder,
        rows=(7, "number of rows", _COUNT),
        columns=(24, "number of columns", _COUNT),
        radius=(0.75, "from the axis to the cameras, metres", _METRES),
        bottom=(0.1, "z of the lowest row, metres", _METRES),
        top=(1.7, "z of the highest row, metres", _METRES),
    )


def _add_dome(kinds: Any) -> None:
    dome = kinds.add_parser(
        "dome",
        help="cameras on a dome, looking at its centre",
        description="Print the rig.yaml of cameras on rings of a dome about the z axis, which look"
        " at its centre. Higher rings have fewer cameras. Camera j of n is at the angle 2πj/n from"
        " +x; the order is ring by ring from the lowest.",
    )
    dome.set_defaults(command=_dome)
    _add_numbers(
        dome,
        rings=(5, "number of rings, equally spaced in elevation", _COUNT),
        columns=(20, "cameras of a ring at the height of the centre", _COUNT),
        radius=(1.2, "from the centre to the cameras, metres", _METRES),
        lowest=(0.0, "elevation of the lowest ring above the centre, degrees", _DEGREES),
        highest=(80.0, "elevation of the highest ring, degrees", _DEGREES),
        height=(0.8, "z of the centre, metres", _METRES),
    )
    dome.add_argument(
        "--one-camera",
        action="store_true",
        help="one camera moves to all places: list them in shooting order, every second ring"
        " backwards",
    )


def _add_turntable(kinds: Any) -> None:
    turntable = kinds.add_parser(
        "turntable",
        help="cameras before a turntable, one per camera and stop",
        description="Print the rig.yaml of cameras on an arc before a subject that turns: every"
        " picture is a camera, cam_CAMERA_STOP, with a focus distance of its own. Poses are in the"
        " turning subject's frame, its axis is z. At stop 0 the cameras are above +x; the subject"
        " turns counter-clockwise seen from above, by 360°/STOPS from stop to stop.",
    )
    turntable.set_defaults(command=_turntable)
    _add_numbers(
        turntable,
        cameras=(3, "number of cameras, equally spaced in elevation", _COUNT),
        stops=(24, "pictures that each camera takes in a turn", _COUNT),
        radius=(0.6, "from the centre to the cameras, metres", _METRES),
        lowest=(10.0, "elevation of the lowest camera above the centre, degrees", _DEGREES),
        highest=(60.0, "elevation of the highest camera, degrees", _DEGREES),
        height=(0.05, "z of the centre, at which the cameras look, metres", _METRES),
    )
    option = turntable.add_argument
    option("--bottom", help="or level cameras at heights: z of the lowest, metres", **_METRES)
    option("--top", help="z of the highest of them, metres; --radius away from the axis", **_METRES)
    option(
        "--one-camera",
        action="store_true",
        help="one camera, moved after every turn: shooting order is turn by turn (default: stop by"
        " stop)",
    )


def _add_gantry(kinds: Any) -> None:
    gantry = kinds.add_parser(
        "gantry",
        help="one camera that moves over a plane",
        description="Print the rig.yaml of the places from which one camera that moves over a plane"
        " photographs a rectangle of it: every picture is a camera, cam_ROW_COLUMN, with a focus"
        " distance of its own. The order is that of shooting, row by row there and back from the"
        " lowest.",
    )
    gantry.set_defaults(command=_gantry)
    _add_numbers(
        gantry,
        width=(1.0, "width of the rectangle, along the image's x axis, metres", _METRES),
        height=(0.7, "its height, along the image's y axis, metres", _METRES),
        distance=(0.5, "from the plane to the camera, metres", _METRES),
        overlap=(
            0.5,
            "least share of a picture that the next one shows too, beside it and above it",
            {"type": float, "metavar": "SHARE"},
        ),
    )
    option = gantry.add_argument
    option("--columns", help="pictures per row (default: as --overlap asks for)", **_COUNT)
    option("--rows", help="number of rows (default: as --overlap asks for)", **_COUNT)
    option(
        "--look",
        default="down",
        metavar="WAY",
        help="down, up, forward (+x), backward, left (+y) or right (default: %(default)s)",
    )
    option(
        "--centre",
        "--center",
        type=float,
        nargs=3,
        default=(0.0, 0.0, 0.0),
        metavar=("X", "Y", "Z"),
        help="middle of the rectangle, metres (default: 0 0 0)",
    )


def _add_numbers(parser: Any, **numbers: tuple[float, str, dict[str, Any]]) -> None:
    """Add options by name, each with its default, meaning and kind, and those of all layouts."""
    for name, (default, meaning, kind) in numbers.items():
        help_ = f"{meaning} (default: %(default)s)"
        parser.add_argument(f"--{name}", default=default, help=help_, **kind)
    parser.add_argument(
        "--frame-id",
        default="world",
        metavar="NAME",
        help="frame of the poses (default: %(default)s)",
    )
    add_image_options(parser)
    add_lens_options(parser)


def _cylinder(options: argparse.Namespace) -> int:
    from focus_planner.core.rig.layouts import cylinder_rig

    numbers = (options.rows, options.columns, options.radius, options.bottom, options.top)
    shared = _shared(options)
    with errors_of_options(dict.fromkeys(("rows", "columns", "radius", "bottom", "top"))):
        rig = cylinder_rig(*numbers, **shared)
    return print_layout(rig, options)


def _dome(options: argparse.Namespace) -> int:
    from focus_planner.core.rig.layouts import dome_rig

    numbers = (options.rings, options.columns, *_around_a_centre(options))
    shared = _shared(options)
    with errors_of_options(dict.fromkeys(("rings", "columns", *_CENTRED))):
        rig = dome_rig(*numbers, one_camera=options.one_camera, **shared)
    return print_layout(rig, options)


def _turntable(options: argparse.Namespace) -> int:
    from focus_planner.core.rig.layouts import turntable_rig

    numbers = (options.cameras, options.stops, *_around_a_centre(options))
    shared = _shared(options) | {
        name: getattr(options, name) for name in ("bottom", "top", "one_camera")
    }
    with errors_of_options(dict.fromkeys(("cameras", "stops", *_CENTRED, "bottom", "top"))):
        rig = turntable_rig(*numbers, **shared)
    return print_layout(rig, options)


def _gantry(options: argparse.Namespace) -> int:
    from focus_planner.core.rig.gantry import gantry_rig

    measures = ("width", "height", "distance", "overlap", "columns", "rows", "look", "centre")
    values = _shared(options) | {name: getattr(options, name) for name in measures}
    # The camera is one: what its first picture shows, all show.
    values["intrinsics"] = intrinsics_of(options)("cam_0_00")
    with errors_of_options(dict.fromkeys(measures)):
        rig = gantry_rig(**values)
    return print_layout(rig, options)


def _around_a_centre(options: argparse.Namespace) -> list[float]:
    return [getattr(options, name) for name in _CENTRED]


def _shared(options: argparse.Namespace) -> dict[str, Any]:
    return {"lens": lens_of(options), "frame_id": options.frame_id}


def print_layout(rig: Rig, options: argparse.Namespace) -> int:
    """Print a layout with the image that the options tell."""
    from dataclasses import replace

    from focus_planner.core.rig.defaults import keys_of

    image_of = intrinsics_of(options)
    cameras = tuple(replace(each, intrinsics=image_of(each.name)) for each in rig.cameras)
    of_image = frozenset[str]() if has_image(options) else keys_of("image")
    assumed = {camera.name: of_image for camera in cameras}
    return print_rig(replace(rig, cameras=cameras, assumed=assumed), options)
