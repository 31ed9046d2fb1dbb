"""The report of a body, as a browser shows it."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

from rich.console import Console

from figures.browser import Views, picture_report
from figures.places import DOCS
from figures.program import focus_planner
from focus_planner.io.bodies import body


def run(console: Console) -> None:
    """Draw ``docs/report.png``."""
    with TemporaryDirectory() as folder:
        rig, report = Path(folder) / "rig.yaml", Path(folder) / "report.html"
        rig.write_text(focus_planner("rig", "cylinder"))
        focus_planner("plan", body("arms_out"), "--rig", rig, "--report", report, "--quiet")
        picture_report(
            report, Views(height=1000, selected="cam_2_15", part=""), DOCS / "report.png"
        )
    console.print("report: drawn")
