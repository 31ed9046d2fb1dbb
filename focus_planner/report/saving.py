"""Writing a report."""

from __future__ import annotations

from pathlib import Path

from focus_planner.io.files import atomic_write
from focus_planner.report.content import ReportContent
from focus_planner.report.page import report_page


def save_report(content: ReportContent, path: Path) -> None:
    """Write the report as one HTML file, whole or not at all.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    page = report_page(content).encode()
    with atomic_write(path) as file:
        file.write(page)
