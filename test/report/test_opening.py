# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A browser is opened where somebody sees it, and nowhere else."""

from __future__ import annotations

import sys
import webbrowser
from pathlib import Path
from typing import Any

import pytest

from focus_planner.report.opening import open_report

_SEEN = ("CI", "SSH_CONNECTION", "SSH_TTY", "DISPLAY", "WAYLAND_DISPLAY")


class Browser:
    def __init__(self) -> None:
        self.opened: list[str] = []

    def open(self, url: str) -> bool:
        self.opened.append(url)
        return True


@pytest.fixture
def browser(monkeypatch: pytest.MonkeyPatch) -> Browser:
    """The browser of somebody who sits before a terminal on a screen."""
    for name in _SEEN:
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.setattr(sys.stdin, "isatty", lambda: True, raising=False)
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True, raising=False)
    browser = Browser()
    monkeypatch.setattr(webbrowser, "get", lambda: browser)
    return browser


def test_on_a_terminal_beside_a_screen_it_is_opened(browser: Browser, tmp_path: Path) -> None:
    assert open_report(tmp_path / "a report.html")
    assert browser.opened == [f"{tmp_path.as_uri()}/a%20report.html"]


@pytest.mark.parametrize("name", ["CI", "SSH_CONNECTION", "SSH_TTY"])
def test_elsewhere_it_is_not(
    browser: Browser, monkeypatch: pytest.MonkeyPatch, name: str, tmp_path: Path
) -> None:
    monkeypatch.setenv(name, "1")
    assert not open_report(tmp_path / "report.html")
    assert browser.opened == []


def test_without_a_screen_it_is_not(
    browser: Browser, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.delenv("DISPLAY")
    assert not open_report(tmp_path / "report.html")
    monkeypatch.setenv("WAYLAND_DISPLAY", "wayland-0")
    assert open_report(tmp_path / "report.html")


@pytest.mark.parametrize("stream", ["stdin", "stdout"])
def test_in_a_pipe_it_is_not(
    browser: Browser, monkeypatch: pytest.MonkeyPatch, stream: str, tmp_path: Path
) -> None:
    monkeypatch.setattr(getattr(sys, stream), "isatty", lambda: False, raising=False)
    assert not open_report(tmp_path / "report.html")
    assert browser.opened == []


def test_a_browser_in_the_terminal_is_not_started(
    browser: Browser, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(webbrowser, "get", lambda: webbrowser.GenericBrowser("false"))
    assert not open_report(tmp_path / "report.html")


def test_where_there_is_none_nothing_happens(
    browser: Browser, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def none() -> Any:
        raise webbrowser.Error("could not locate runnable browser")

    monkeypatch.setattr(webbrowser, "get", none)
    assert not open_report(tmp_path / "report.html")
