# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What draws reports, as it is committed; CI builds it anew and compares."""

from __future__ import annotations

import json
import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGE, BUNDLE = ROOT / "report_page", ROOT / "focus_planner/report/bundle"


def test_the_lock_is_exact_and_names_no_address():
    text = (PAGE / "package-lock.json").read_text()
    assert "resolved" not in text
    assert "http" not in text
    package = json.loads((PAGE / "package.json").read_text())
    for versions in (package["dependencies"], package["devDependencies"]):
        assert all(re.fullmatch(r"\d+\.\d+\.\d+", version) for version in versions.values())


def test_the_bundle_keeps_the_licence_and_cannot_end_its_script():
    program = (BUNDLE / "report.js").read_text()
    assert "three.js authors" in program
    assert "The above copyright notice and this permission notice" in program
    assert "</script" not in program.lower()
    assert "</style" not in (BUNDLE / "report.css").read_text().lower()
