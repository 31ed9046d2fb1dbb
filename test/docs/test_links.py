# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import pytest

from testing.pages import PAGES, ROOT, name_of

# Of an image within a link, both.
LINK = re.compile(r"\]\(([^)\s]+)\)")
# In prose: a file's path, as architecture.md and docstrings tell where to look. X stands for any.
PATH = re.compile(r"`((?:\w+/)+(?!X\.)\w+\.(?:py|md|yaml|xml))`")
PROSE = [*PAGES, *sorted((ROOT / "focus_planner").rglob("*.py"))]

INDEX = ROOT / "docs/index.md"


def without_code(text: str) -> str:
    return re.sub(r"^```.*?^```$", "", text, flags=re.MULTILINE | re.DOTALL)


@cache
def anchors(page: Path) -> set[str]:
    """Return the anchors that GitHub, and MyST, make of a page's headings."""
    titles = re.findall(r"^#+ (.+)$", without_code(page.read_text()), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


def test_the_front_page_is_short():
    assert len((ROOT / "README.md").read_bytes()) <= 7000


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_links_lead_somewhere(page):
    for link in LINK.findall(without_code(page.read_text())):
        if re.match(r"https?://", link):
            continue
        path, _, anchor = link.partition("#")
        target = (page.parent / path).resolve() if path else page
        assert target.exists(), link
        assert target.is_relative_to(ROOT), link
        assert not anchor or anchor in anchors(target), link


@pytest.mark.parametrize("page", PROSE, ids=name_of)
def test_files_are_where_prose_says(page):
    package = ROOT / "focus_planner"
    for path in PATH.findall(page.read_text()):
        assert any((folder / path).exists() for folder in (ROOT, package, package / "core")), path


def test_every_page_is_in_the_site():
    listed = set(re.findall(r"^(?:\w+ <)?([\w/]+)>?$", INDEX.read_text(), re.MULTILINE))
    assert {page.stem for page in (ROOT / "docs").glob("*.md")} - {"index"} <= listed
