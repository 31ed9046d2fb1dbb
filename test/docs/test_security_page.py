# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""docs/security.md beside what the planner has and what it logs."""

from __future__ import annotations

import re
from xml.etree import ElementTree as ET

import pytest

from focus_planner.core.text import MAX_LINE
from testing.pages import ROOT

PAGE = (ROOT / "docs/security.md").read_text(encoding="utf-8")
# Tests compare it with running nodes.
POLICY = ET.parse(ROOT / "security/policies.xml").getroot()
PLANNER = POLICY.find("enclaves/enclave[@path='/focus_planner']")
NAMES = sorted({name.text for rules in PLANNER.find("profiles/profile") for name in rules})


@pytest.mark.parametrize("name", NAMES)
def test_the_page_says_what_a_peer_can_do_with_everything_that_the_planner_has(name):
    assert f"`{name.replace('*', '<name>')}`" in PAGE


def test_it_names_every_file_that_closes_something():
    for path in sorted((ROOT / "security").iterdir()):
        assert f"security/{path.name}" in PAGE
    assert "(focus_planner.service)" in PAGE


def test_it_says_how_long_a_line_may_be():
    (told,) = re.findall(r"one line of at most ([\d,]+) characters", PAGE.replace("\n", " "))
    assert int(told.replace(",", "")) == MAX_LINE
