"""``focus_planner rig``: making a rig.yaml, from a layout or from the data of other programs."""

from __future__ import annotations

from typing import Any

from focus_planner.cli import (
    rig_colmap,
    rig_kalibr,
    rig_layouts,
    rig_metashape,
    rig_nerfstudio,
    rig_realitycapture,
    rig_transforms,
)


def add(commands: Any) -> None:
    """Add the command."""
    rig = commands.add_parser(
        "rig",
        help="make a rig.yaml from a layout or from another program's cameras",
        description="Print a rig.yaml made from a regular layout, from tf2 transforms, or from the"
        " cameras of COLMAP, Kalibr, Metashape, nerfstudio or RealityScan.",
    )
    kinds = rig.add_subparsers(title="kinds of rig", metavar="KIND")
    for kind in (
        rig_layouts,
        rig_colmap,
        rig_kalibr,
        rig_metashape,
        rig_nerfstudio,
        rig_realitycapture,
        rig_transforms,
    ):
        kind.add(kinds)
