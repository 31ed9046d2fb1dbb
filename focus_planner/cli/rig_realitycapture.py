# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""``focus_planner rig realitycapture``: a registration of RealityScan as cameras."""

from __future__ import annotations

import argparse
from typing import Any

from focus_planner.cli.rig_imports import add_image_folder, add_import, run_import


def add(kinds: Any) -> None:
    """Add the kind of rig."""
    parser = add_import(
        kinds,
        "realitycapture",
        aliases=["realityscan"],
        summary="the cameras of RealityScan, formerly RealityCapture",
        description="Print the rig.yaml of cameras that RealityScan (formerly RealityCapture)"
        " registered, named after their images. Export the registration as Internal/External camera"
        " parameters (CSV), or metadata as XMP files beside the images. Neither tells the size of"
        " the images: their headers do.",
        file="the CSV, or the folder with the XMP files",
        cameras="whose images' names match, such as 'left*'",
        unit_of="the registration",
    )
    add_image_folder(parser)
    parser.set_defaults(command=_realitycapture)


def _realitycapture(options: argparse.Namespace) -> int:
    from focus_planner.io.rig_files.realitycapture import load_realitycapture

    return run_import(options, load_realitycapture, "realitycapture")
