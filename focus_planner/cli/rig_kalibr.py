# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""``focus_planner rig kalibr``: the cameras of a Kalibr chain."""

from __future__ import annotations

import argparse
from typing import Any

from focus_planner.cli.rig_imports import add_import, run_import


def add(kinds: Any) -> None:
    """Add the kind of rig."""
    parser = add_import(
        kinds,
        "kalibr",
        summary="the cameras of a Kalibr calibration",
        description="Print the rig.yaml of a camchain of Kalibr: cameras in the optical frame of"
        " the first, named after their topics.",
        file="the camchain, such as camchain-imucam.yaml",
        cameras="whose names match, such as 'front*'",
        unit_of="the chain, which Kalibr writes in metres",
    )
    parser.set_defaults(command=_kalibr)


def _kalibr(options: argparse.Namespace) -> int:
    from focus_planner.io.rig_files.kalibr import load_kalibr

    return run_import(options, load_kalibr, "kalibr")
