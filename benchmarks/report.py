# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Reports in a browser: their size, the seconds from load to picture, and how smoothly they turn.

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

# Seconds until a page is loaded, and from then until all of its samples are drawn.
_ALLOWED = 3.0
_DRAWN = "#stage[data-drawn]"
_ARGUMENTS = ("--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")
_MILLISECONDS = 300_000
# Turns it by arrows for four seconds; pictures per second of the last two.
_TURN = """async () => {
  const canvas = document.querySelector(".canvas canvas");
  const start = performance.now();
  let pictures = 0;
  while (performance.now() - start < 4000) {
    canvas.dispatchEvent(new KeyboardEvent("keydown", { key: "ArrowRight" }));
    await new Promise(requestAnimationFrame);
    if (performance.now() - start > 2000) pictures++;
  }
  return pictures / 2;
}"""


def run(console: Console) -> bool:
    """Measure what a report is to cope with; return whether it is drawn as fast as it has to be."""
    contents = {
        "body, 16,384 samples, 168 cameras": report_contents.real(),
        "body, 65,536 samples, 168 cameras": report_contents.real(65_536),
        "sphere, 65,536 samples, 1,000 cameras": report_contents.made_large(),
    }
    chromium = shutil.which("chromium")
    table = Table(title="reports", title_justify="left")
    for heading in (
        "report",
        "write / s",
        "size / MB",
        "load / s",
        "then drawn / s",
        "turning / Hz",
    ):
        table.add_column(heading, justify="left" if heading == "report" else "right")
    fast = True
    with tempfile.TemporaryDirectory() as folder:
        for name, content in contents.items():
            path = Path(folder) / "report.html"
            start = time.perf_counter()
            write_report(content, path)
            written = time.perf_counter() - start
            shown = None if chromium is None else _shown(chromium, path)
            fast &= shown is None or max(shown[:2]) <= _ALLOWED
            told = ("–",) * 3 if shown is None else [f"{each:.2f}" for each in shown]
            table.add_row(name, f"{written:.2f}", f"{path.stat().st_size / 1e6:.2f}", *told)
    console.print(table)
    if not fast:
        console.print(f"slower than {_ALLOWED:g} s to load, or then to be drawn")
    return fast


def _shown(chromium: str, path: Path) -> tuple[float, float, float]:
    """Return the seconds of a page's load, then of its drawing, and its pictures per second."""
    from playwright.sync_api import sync_playwright  # noqa: PLC0415

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=[*_ARGUMENTS])
        page = browser.new_page(viewport={"width": 1440, "height": 900})
        start = time.perf_counter()
        page.goto(path.as_uri(), timeout=_MILLISECONDS)
        loaded = time.perf_counter()
        page.wait_for_selector(_DRAWN, timeout=_MILLISECONDS)
        drawn = time.perf_counter()
        turning = page.evaluate(_TURN)
        browser.close()
    return loaded - start, drawn - loaded, turning
