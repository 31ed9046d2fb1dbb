# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""``focus_planner rig transforms``: tf2 frames as cameras."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from focus_planner.cli import rig_nerfstudio
from focus_planner.cli.progress import shown
from focus_planner.cli.rig_imports import naming_the_kind
from focus_planner.cli.rig_options import (
    add_image_options,
    add_lens_options,
    has_image,
    intrinsics_of,
    lens_of,
    print_rig,
)
from focus_planner.cli.terminal import show_note
from focus_planner.core.validation import InputError


def add(kinds: Any) -> None:
    """Add the kind of rig."""
    transforms = kinds.add_parser(
        "transforms",
        help="tf2 frames as cameras",
        description="Print the rig.yaml of cameras whose poses are tf2 transforms; chains of"
        " transforms are composed. Cameras are named after their frames, without _optical_frame.",
    )
    transforms.set_defaults(command=_transforms)
    option = transforms.add_argument
    option(
        "file",
        type=Path,
        metavar="FILE",
        help="TransformStamped messages as YAML or JSON, as printed by ros2 topic echo /tf_static;"
        " or a text file with a transform on each line: x y z qx qy qz qw parent child, or x y z"
        " yaw pitch roll parent child, or a static_transform_publisher command; nerfstudio's"
        " transforms.json is read as by focus_planner rig nerfstudio, which has more options",
    )
    option(
        "--root", default="", metavar="FRAME", help="frame of the rig (default: root of the tree)"
    )
    option(
        "--cameras",
        default="",
        metavar="PATTERN",
        help="frames of the cameras, such as 'cam*_optical_frame' (default: the leaves of the tree"
        " with optical in their names, or all leaves if there are none)",
    )
    option(
        "--convention",
        default="",
        metavar="NAME",
        help="axes of the cameras' frames: optical (z forward) or body (x forward) (default:"
        " optical if their names end in _optical_frame or _optical, otherwise body, with a note)",
    )
    option(
        "--scale",
        type=float,
        metavar="METRES",
        help="metres per unit of the translations (default: 1)",
    )
    option("--frame-id", default="", metavar="NAME", help="frame of the poses (default: --root)")
    add_image_options(transforms)
    add_lens_options(transforms)


def _transforms(options: argparse.Namespace) -> int:
    from focus_planner.io.rig_files.transforms import load_transforms

    if rig_nerfstudio.is_file_of_it(options.file):
        return _frames_of_images(options)
    with shown(quiet=False) as tell, naming_the_kind(options.file, "transforms"):
        tell(f"reading {options.file}")
        rig, notes = load_transforms(
            options.file,
            root=options.root,
            cameras=options.cameras,
            convention=options.convention,
            scale=options.scale,
            intrinsics_of=intrinsics_of(options) if has_image(options) else None,
            lens=lens_of(options),
            frame_id=options.frame_id,
        )
    for note in notes:
        show_note(note)
    return print_rig(rig, options)


def _frames_of_images(options: argparse.Namespace) -> int:
    """Read nerfstudio's file, which is called like this kind of rig."""
    if options.root or options.convention:
        got = "frames of images, which have neither"
        raise InputError(str(options.file), "a tree of frames for --root and --convention", got)
    options.image_folder = None  # an option of that kind, with which --image may be alone
    status = rig_nerfstudio.run(options)
    show_note("frames of images: read as by focus_planner rig nerfstudio, which has more options")
    return status
