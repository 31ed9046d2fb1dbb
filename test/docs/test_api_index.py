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

import pkgutil
import re
from pathlib import Path

import focus_planner

INDEX = Path(__file__).parents[2] / "docs" / "api" / "index.md"
# Bodies are data, and __main__ only calls the command line.
WITHOUT_A_PAGE = {"bodies", "__main__"}


def test_every_package_has_its_page():
    listed = re.findall(r"^   focus_planner\.(\w+)$", INDEX.read_text("utf-8"), re.MULTILINE)
    there = {module.name for module in pkgutil.iter_modules(focus_planner.__path__)}
    assert sorted(listed) == sorted(there - WITHOUT_A_PAGE)
