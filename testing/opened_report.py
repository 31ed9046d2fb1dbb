# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Reports in a browser, for tests."""

from __future__ import annotations

import io
import shutil
import time
from contextlib import contextmanager

import numpy as np
import pytest
from PIL import Image

CHROMIUM = shutil.which("chromium")
ARGUMENTS = (
    *("--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking"),
    *("--disable-component-update", "--disable-sync", "--ignore-gpu-blocklist"),
    *("--use-angle=swiftshader", "--enable-unsafe-swiftshader"),
)
DESKTOP = {"width": 1100, "height": 720}
PATIENCE = 120_000  # milliseconds until a browser that does not answer is taken to hang


@contextmanager
def chromium():
    """Run Chromium; skip the test where it or its driver is missing."""
    if CHROMIUM is None:
        pytest.skip("needs Chromium: apt-get install chromium")
    sync_api = pytest.importorskip("playwright.sync_api")
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=[*ARGUMENTS])
        yield browser
        browser.close()


class Opened:
    """A report in a tab of its own; what it asked for and complained of."""

    def __init__(self, browser, path, size=DESKTOP, **options):
        self._context = browser.new_context(viewport=size, reduced_motion="reduce", **options)
        self._context.set_default_timeout(PATIENCE)
        self.page = self._context.new_page()
        self.requests, self.complaints = [], []
        self.page.on("request", lambda request: self.requests.append(request.url))
        self.page.on("console", lambda message: self.complaints.append(message.text))
        self.page.on("pageerror", lambda error: self.complaints.append(str(error)))
        self.page.goto(path.as_uri())
        self.page.wait_for_selector("#stage[data-drawn]")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._context.close()

    @property
    def canvas(self):
        return self.page.locator(".canvas canvas[tabindex]")

    @property
    def inspector(self):
        return self.page.locator(".inspector")

    def choose(self, label, value):
        self.page.get_by_label(label, exact=True).select_option(value)

    def click_picture(self, x, y):
        box = self.canvas.bounding_box()
        self.page.mouse.click(box["x"] + x * box["width"], box["y"] + y * box["height"])

    def selected(self, kind):
        """Wait until something of this kind is selected; return its number."""
        self.page.wait_for_selector(f".inspector[data-kind={kind}]")
        return int(self.inspector.get_attribute("data-index"))

    def until(self, expression):
        """Wait until an expression is true: asked from outside, as the page evaluates no text."""
        self._wait_for(lambda: self.page.evaluate(expression))

    def wait_until_it_looks_unlike(self, before):
        """Wait until the picture has been drawn otherwise."""
        self._wait_for(lambda: not np.array_equal(self.pixels(), before))

    def _wait_for(self, condition):
        until = time.monotonic() + PATIENCE / 1000
        while not condition():
            assert time.monotonic() < until
            self.page.wait_for_timeout(20)

    def pixels(self):
        """(height, width, 3) the picture as it is shown."""
        shot = Image.open(io.BytesIO(self.canvas.screenshot())).convert("RGB")
        return np.asarray(shot).astype(int)
