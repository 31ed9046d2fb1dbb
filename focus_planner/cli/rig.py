# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""``focus_planner rig``: making a rig.yaml, from a layout or from the data of other programs."""

from __future__ import annotations

from typing import Any

from focus_planner.cli import (
    rig_colmap,
    rig_kalibr,
    rig_layouts,
    rig_metashape,
    rig_nerfstudio,
    rig_path,
    rig_realitycapture,
    rig_transforms,
)


def add(commands: Any) -> None:
    """Add the command."""
    rig = commands.add_parser(
        "rig",
        help="make a rig.yaml from a layout or from another program's cameras",
        description="Print a rig.yaml made from a regular layout, from a path, from tf2 transforms,"
        " or from the cameras of COLMAP, Kalibr, Metashape, nerfstudio or RealityScan.",
    )
    kinds = rig.add_subparsers(title="kinds of rig", metavar="KIND")
    for kind in (
        rig_layouts,
        rig_path,
        rig_colmap,
        rig_kalibr,
        rig_metashape,
        rig_nerfstudio,
        rig_realitycapture,
        rig_transforms,
    ):
        kind.add(kinds)
