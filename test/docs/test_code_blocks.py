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

import pytest

from testing.pages import (
    PAGES,
    RECIPES,
    ROOT,
    WITH_CODE,
    Reader,
    lay_out,
    make_targets,
    name_of,
)

FENCE = re.compile(r"^```(.*)$", re.MULTILINE)
LANGUAGES = {"bash", "python", "text", "yaml"}
MAKE = re.compile(r"make ([a-z]+)(?: ARGS=\"?([a-z ]+))?")
CODE = re.compile(r"^```(?:bash|python)$", re.MULTILINE)
INDENTED = re.compile(r"^    (?:focus_planner|ros2|make|import|from) .*$", re.MULTILINE)


@pytest.mark.processes
@pytest.mark.timeout(600)
@pytest.mark.parametrize(
    "page",
    [page for page in WITH_CODE if CODE.search(page.read_text()) and page not in RECIPES],
    ids=name_of,
)
def test_all_code_of_a_page_runs(page, tmp_path, monkeypatch):
    lay_out(tmp_path)
    monkeypatch.chdir(tmp_path)
    with Reader(page, tmp_path) as reader:
        assert reader.read()


@pytest.mark.parametrize("page", WITH_CODE, ids=name_of)
def test_code_is_fenced_and_says_its_language(page):
    text = page.read_text()
    openings = FENCE.findall(text)[::2]
    assert {name for name in openings if not name.startswith("{")} <= LANGUAGES
    outside = re.sub(r"^```.*?^```$", "", text, flags=re.MULTILINE | re.DOTALL)
    assert not INDENTED.findall(outside)


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_what_make_is_told_exists(page):
    for target, parts in re.findall(r"`+(?:text\n)?" + MAKE.pattern, page.read_text()):
        assert target in make_targets()
        for part in parts.split() if target == "bench" else ():
            path = ROOT / "benchmarks" / part.replace(".", "/")
            assert path.with_name(f"{path.name}.py").exists() or (path / "__init__.py").exists()
