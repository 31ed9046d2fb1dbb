# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""``focus_planner rig nerfstudio``: the frames of a transforms.json as cameras."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from focus_planner.cli.rig_imports import add_image_folder, add_import, run_import


def add(kinds: Any) -> None:
    """Add the kind of rig."""
    parser = add_import(
        kinds,
        "nerfstudio",
        summary="the frames of a transforms.json of nerfstudio or instant-ngp as cameras",
        description="Print the rig.yaml of a transforms.json, as nerfstudio, instant-ngp and"
        " Blender's synthetic scenes have it: every frame is a camera, with the pose and the"
        " intrinsics that the file gives it, named after its image.",
        file="transforms.json; or transforms_train.json",
        cameras="whose images' paths match, such as 'images/left*'",
        unit_of="the poses, which mostly have none",
    )
    add_image_folder(parser)
    parser.set_defaults(command=run)


def run(options: argparse.Namespace) -> int:
    """Print the rig."""
    from focus_planner.io.rig_files.nerfstudio import load_nerfstudio

    return run_import(options, load_nerfstudio, "nerfstudio")


def is_file_of_it(path: Path) -> bool:
    """Return whether a file has frames of images.

    Raises
    ------
    InputError
        If it cannot be read.
    """
    from focus_planner.io.files import read_text
    from focus_planner.io.rig_files.nerfstudio import nerfstudio_frames
    from focus_planner.io.rig_files.transforms import EXPECTED

    return nerfstudio_frames(read_text(path, EXPECTED)) is not None
