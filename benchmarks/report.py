"""Reports in a browser: their size, and the seconds from the page's load to its first picture.

Chromium draws without a graphics card here (SwiftShader), which an ordinary laptop does faster.
"""

from __future__ import annotations

import shutil
import tempfile
import time
from pathlib import Path

from rich.console import Console
from rich.table import Table

from focus_planner.report.making import write_report
from testing import report_contents

_DRAWN = "#stage[data-drawn]"
_ARGUMENTS = ("--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")
_MILLISECONDS = 300_000


def run(console: Console) -> None:
    """Measure a body in the paper's rig, and what a report is to cope with."""
    contents = {
        "body, 16,384 samples, 168 cameras": report_contents.real(),
        "body, 65,536 samples, 168 cameras": report_contents.real(65_536),
        "sphere, 65,536 samples, 1,000 cameras": report_contents.made_large(),
    }
    chromium = shutil.which("chromium")
    table = Table(title="reports", title_justify="left")
    for heading in ("report", "write / s", "size / MB", "load / s", "then drawn / s"):
        table.add_column(heading, justify="left" if heading == "report" else "right")
    with tempfile.TemporaryDirectory() as folder:
        for name, content in contents.items():
            path = Path(folder) / "report.html"
            start = time.perf_counter()
            write_report(content, path)
            written = time.perf_counter() - start
            shown = ("–", "–") if chromium is None else _drawn(chromium, path)
            table.add_row(name, f"{written:.2f}", f"{path.stat().st_size / 1e6:.2f}", *shown)
    console.print(table)


def _drawn(chromium: str, path: Path) -> tuple[str, str]:
    """Return the seconds until a page is loaded, and those until its surface is drawn."""
    from playwright.sync_api import sync_playwright  # noqa: PLC0415

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=[*_ARGUMENTS])
        page = browser.new_page(viewport={"width": 1440, "height": 900})
        start = time.perf_counter()
        page.goto(path.as_uri(), timeout=_MILLISECONDS)
        loaded = time.perf_counter()
        page.wait_for_selector(_DRAWN, timeout=_MILLISECONDS)
        drawn = time.perf_counter()
        browser.close()
    return f"{loaded - start:.2f}", f"{drawn - loaded:.2f}"
