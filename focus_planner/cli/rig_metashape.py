# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

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
