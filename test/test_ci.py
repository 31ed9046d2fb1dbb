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

from testing.pages import ROOT

IMPORTS = re.compile(r"^(?:from|import) focus_planner_msgs\b", re.MULTILINE)


def listed():
    """Paths of tests that continuous integration leaves out where there are no interfaces."""
    run = (ROOT / ".ci" / "run").read_text("utf-8")
    return re.search(r"with_interfaces=\((.*?)\)", run, re.DOTALL)[1].split()


def test_tests_that_need_the_interfaces_are_left_out_where_there_are_none():
    helpers = [
        path.relative_to(ROOT).with_suffix("").as_posix().replace("/", r"\.")
        for path in (ROOT / "testing").rglob("*.py")
        if IMPORTS.search(path.read_text("utf-8"))
    ]
    of_helpers = re.compile(rf"^(?:from|import) (?:{'|'.join(helpers)})\b", re.MULTILINE)
    need_them = [
        path.relative_to(ROOT).as_posix()
        for path in (ROOT / "test").rglob("test_*.py")
        if IMPORTS.search(text := path.read_text("utf-8")) or of_helpers.search(text)
    ]
    assert len(need_them) > 20
    assert not [path for path in need_them if not path.startswith(tuple(listed()))]
    assert all((ROOT / path).exists() for path in listed())
