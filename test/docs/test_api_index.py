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
