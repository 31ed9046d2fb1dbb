# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The report of a body, as a browser shows it."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

from rich.console import Console

from figures.browser import Views, picture_report
from figures.places import DOCS
from figures.program import focus_planner
from focus_planner import cylinder_rig, save_rig
from focus_planner.io.bodies import body


def run(console: Console) -> None:
    """Draw ``docs/report.png``."""
    with TemporaryDirectory() as folder:
        rig, report = Path(folder) / "rig.yaml", Path(folder) / "report.html"
        save_rig(cylinder_rig(), rig)  # the paper's, without notes that nobody has told it
        focus_planner(
            "plan", body("arms_out"), "--rig", rig, "--report", report, "--no-pictures", "--quiet"
        )
        picture_report(
            report, Views(height=1000, selected="cam_2_15", part=""), DOCS / "report.png"
        )
    console.print("report: drawn")
