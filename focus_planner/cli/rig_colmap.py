# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""``focus_planner rig colmap``: the images of a COLMAP model as cameras."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from focus_planner.cli.progress import shown
from focus_planner.cli.rig_imports import add_placement_options, import_options, naming_the_kind
from focus_planner.cli.rig_options import add_lens_options, lens_of, print_rig
from focus_planner.cli.terminal import show_note


def add(kinds: Any) -> None:
    """Add the kind of rig."""
    colmap = kinds.add_parser(
        "colmap",
        help="the images of a COLMAP model as cameras",
        description="Print the rig.yaml of a sparse COLMAP model, text or binary: every image is a"
        " camera. Cameras are named after their images' paths, without the beginning and the end"
        " common to all: cam01/0001.jpg and cam02/0001.jpg become cam01 and cam02.",
    )
    colmap.set_defaults(command=_colmap)
    option = colmap.add_argument
    option(
        "folder",
        type=Path,
        metavar="FOLDER",
        help="folder of the model, such as sparse/0, with cameras and images (.bin or .txt)",
    )
    option(
        "--images",
        "--cameras",
        default="*",
        metavar="PATTERN",
        help="use only images whose names match, such as 'cam*/0001.jpg' (default: all)",
    )
    add_placement_options(colmap, "the model, which has no unit of its own")
    add_lens_options(colmap)


def _colmap(options: argparse.Namespace) -> int:
    from focus_planner.io.rig_files.colmap import load_colmap
    from focus_planner.io.rig_files.found import on_unit

    with shown(quiet=False) as tell, naming_the_kind(options.folder, "colmap"):
        tell(f"reading {options.folder}")
        rig = load_colmap(
            options.folder,
            images=options.images,
            rig_from_model=import_options(options).rig_from_file,
            lens=lens_of(options),
            frame_id=options.frame_id or "world",
        )
    if options.scale is None and options.transform is None:
        show_note(on_unit(rig, "a COLMAP model has no unit"))
    return print_rig(rig, options)
