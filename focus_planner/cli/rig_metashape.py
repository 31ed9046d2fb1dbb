"""``focus_planner rig metashape``: the aligned cameras of a Metashape export."""

from __future__ import annotations

import argparse
from typing import Any

from focus_planner.cli.rig_imports import add_import, run_import


def add(kinds: Any) -> None:
    """Add the kind of rig."""
    parser = add_import(
        kinds,
        "metashape",
        summary="the aligned cameras of Agisoft Metashape",
        description="Print the rig.yaml of Agisoft Metashape's cameras, exported with File >"
        " Export > Export Cameras as Agisoft XML: every camera that is aligned and enabled, named"
        " after its label. The focal length of its lens is that of its sensor, unless"
        " --focal-length says otherwise.",
        file="Agisoft XML, such as cameras.xml",
        cameras="whose labels match, such as 'left*'",
        unit_of="the export",
    )
    parser.set_defaults(command=_metashape)


def _metashape(options: argparse.Namespace) -> int:
    from focus_planner.io.rig_files.metashape import load_metashape

    return run_import(options, load_metashape, "metashape")
