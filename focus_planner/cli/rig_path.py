# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""``focus_planner rig path``: the places of a camera that moves along a path."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from focus_planner.cli.progress import shown
from focus_planner.cli.rig_imports import add_placement_options, naming_the_kind
from focus_planner.cli.rig_layouts import print_layout
from focus_planner.cli.rig_options import (
    add_image_options,
    add_lens_options,
    errors_of_options,
    lens_of,
)
from focus_planner.core.validation import InputError


def add(kinds: Any) -> None:
    """Add the kind of rig."""
    path = kinds.add_parser(
        "path",
        help="one camera that moves along a path",
        description="Print the rig.yaml of one camera that takes its pictures along a path: every"
        " picture is a camera, in shooting order, with a focus distance of its own.",
    )
    path.set_defaults(command=_path)
    option = path.add_argument
    option(
        "file",
        type=Path,
        metavar="FILE",
        help="a table whose first line has the titles x, y, z and either qx, qy, qz, qw or"
        " target_x, target_y, target_z, optionally name, separated by commas, semicolons, tabs or"
        " spaces (a CSV of plan --output is one); or a trajectory as of TUM, lines of timestamp tx"
        " ty tz qx qy qz qw; or lines of x y z qx qy qz qw, or of x y z",
    )
    option(
        "--target",
        type=float,
        nargs=3,
        metavar=("X", "Y", "Z"),
        help="look at this point of the rig's frame, metres, whatever orientations the file has",
    )
    option(
        "--steps",
        type=int,
        default=0,
        metavar="N",
        help="take N pictures, equally spaced along the path, the first and the last at its ends;"
        " positions are interpolated linearly, orientations by the shortest turn (default: one"
        " picture at each pose of the file)",
    )
    option(
        "--closed",
        action="store_true",
        help="the path leads back to its first pose; with --steps",
    )
    option(
        "--convention",
        default="optical",
        metavar="NAME",
        help="axes that the quaternions turn: optical (z forward) or body (x forward) (default:"
        " optical)",
    )
    add_placement_options(path, "the positions")
    add_image_options(path)
    add_lens_options(path)


def _path(options: argparse.Namespace) -> int:
    from focus_planner.io.rig_files.alignment import load_alignment
    from focus_planner.io.rig_files.camera_path import load_path

    if options.closed and not options.steps:
        raise InputError("--closed", "--steps with it", "none")
    with (
        shown(quiet=False) as tell,
        naming_the_kind(options.file, "path"),
        errors_of_options(dict.fromkeys(("steps", "convention"))),
    ):
        tell(f"reading {options.file}")
        rig = load_path(
            options.file,
            target=options.target,
            steps=options.steps,
            closed=options.closed,
            convention=options.convention,
            scale=options.scale,
            transform=None if options.transform is None else load_alignment(options.transform),
            lens=lens_of(options),
            frame_id=options.frame_id,
        )
    return print_layout(rig, options)
