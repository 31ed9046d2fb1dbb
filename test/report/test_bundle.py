"""What is committed is what the sources give."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE, BUNDLE = ROOT / "report_page", ROOT / "focus_planner/report/bundle"


@pytest.mark.processes
def test_the_bundle_is_what_its_sources_give(tmp_path):
    if shutil.which("node") is None:
        pytest.skip("needs Node 20 or later: apt-get install nodejs npm")
    if not (PAGE / "node_modules").is_dir():
        pytest.skip("needs what the lock names: cd report_page && npm ci --ignore-scripts")
    subprocess.run(["node", "build.mjs", str(tmp_path)], cwd=PAGE, check=True)
    for name in ("report.js", "report.css"):
        assert (tmp_path / name).read_bytes() == (BUNDLE / name).read_bytes(), "run: make bundle"


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
