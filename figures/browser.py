# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Pictures of reports, as Debian's Chromium shows them."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from playwright.sync_api import Page, sync_playwright

# Without a graphics card; and nothing is looked up, not even the browser's own updates.
_ARGUMENTS = (
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
)
# Milliseconds: a machine without a graphics card is slow.
_PATIENCE = 60_000


@dataclass(frozen=True)
class Views:
    """How a report is pictured.

    Attributes
    ----------
    width, height : int
        Of the window, pixels.
    selected : str
        The camera that is selected; none if empty.
    part : str
        The part of the page that is pictured, as a CSS selector; the window if empty.
    """

    width: int = 1440
    height: int = 900
    selected: str = ""
    part: str = "#stage .picture-box"


def picture_report(report: Path, views: Views, path: Path) -> None:
    """Write a PNG of a report."""
    with _page(views) as page:
        page.goto(report.resolve().as_uri())
        page.wait_for_selector("#stage[data-drawn]", timeout=_PATIENCE)
        if views.selected:
            page.get_by_role("button", name=views.selected, exact=True).first.click()
            page.wait_for_selector("#stage .inspector[data-kind=camera]", timeout=_PATIENCE)
        if views.part:
            page.locator(views.part).screenshot(path=path)
        else:
            page.evaluate("scrollTo(0, 0)")
            page.screenshot(path=path)


@contextmanager
def _page(views: Views) -> Iterator[Page]:
    executable = shutil.which("chromium") or shutil.which("google-chrome")
    if executable is None:
        raise SystemExit("figures: expected Chromium, got none; install it: apt install chromium")
    # Chromium's sandbox does not start as root.
    sandbox = os.geteuid() != 0
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=executable, args=list(_ARGUMENTS), chromium_sandbox=sandbox
        )
        try:
            size = {"width": views.width, "height": views.height}
            yield browser.new_page(viewport=size, color_scheme="light")  # type: ignore[arg-type]
        finally:
            browser.close()
