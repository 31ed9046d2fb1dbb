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
