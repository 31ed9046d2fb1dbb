# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Planning where there is neither ROS nor POSIX: played here, since no such system runs tests."""

from __future__ import annotations

import ast
import io
import json
import os
import runpy
import subprocess
import sys
from itertools import chain
from pathlib import Path
from unittest.mock import patch

import pytest
import trimesh
from packaging.markers import Marker
from packaging.requirements import Requirement

from focus_planner.cli import main as cli
from focus_planner.cli.legible import make_legible
from testing.runs import TORUS

REPOSITORY = Path(__file__).parents[1]
PACKAGE = REPOSITORY / "focus_planner"
OF_POSIX = {"fcntl", "grp", "pty", "pwd", "resource", "syslog", "termios", "tty"}
# Of the node, which runs on Linux.
OF_THE_NODE = {"runtime/planning_process.py"}


# --- what is imported and called ---------------------------------------------------------------


def imported(nodes: list[ast.stmt]) -> set[str]:
    return {
        name.partition(".")[0]
        for node in nodes
        for name in (
            [alias.name for alias in node.names]
            if isinstance(node, ast.Import)
            else [node.module or ""]
            if isinstance(node, ast.ImportFrom)
            else []
        )
    }


def test_no_module_but_the_nodes_imports_what_only_posix_has() -> None:
    found = {
        str(path.relative_to(PACKAGE))
        for path in PACKAGE.rglob("*.py")
        if imported(ast.parse(path.read_text(encoding="utf-8")).body) & OF_POSIX
    }
    assert found == OF_THE_NODE


@pytest.mark.processes
def test_all_that_needs_no_ros_runs_without_posix_and_plans_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    trimesh.Trimesh(TORUS.vertices, TORUS.triangles, process=False).export(tmp_path / "torus.ply")
    cylinder = ["rig", "cylinder", "--rows", "2", "--columns", "3", "--radius", "2.5"]
    capsys.readouterr()
    assert cli.main(cylinder) == 0
    rig = capsys.readouterr().out
    (tmp_path / "rig.yaml").write_text(rig, encoding="utf-8")
    plan = ["plan", "torus.ply", "--rig", "rig.yaml", "--samples", "300"]
    commands = [
        cylinder,
        [*plan, "--output", "plan.json", "--output", "sheet.csv", "--record", "runs"],
        [
            *plan,
            "--method",
            "em",
            "--report",
            "plan.html",
            "--picture",
            "plan.png",
            "--output",
            "-",
        ],
        ["replay", "RUN"],
        ["replay", "RUN", "--set", "method=closest"],
        ["report", "RUN", "--output", "report.html"],
        ["preview", "RUN", "--all", "--output", "preview"],
        ["masks", "RUN", "--output", "masks", "--depth"],
        ["parameters"],
    ]
    done = subprocess.run(
        [sys.executable, "-m", "testing.program_elsewhere", json.dumps(commands)],
        env={
            **os.environ,
            "PYTHONPATH": str(REPOSITORY),
            "PYTHONIOENCODING": "cp437:strict",
            "PYTHONWARNDEFAULTENCODING": "1",
            "PYTHONWARNINGS": "ignore::EncodingWarning",
        },
        cwd=tmp_path,
        capture_output=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr.decode("cp437")
    assert done.stdout.startswith(rig.encode())
    assert {"report.html", "plan.html", "plan.png", "preview", "masks", "sheet.csv"} <= {
        path.name for path in tmp_path.iterdir()
    }
    monkeypatch.chdir(tmp_path)
    assert cli.main([*plan, "--output", "here.json"]) == 0
    there, here = (
        json.loads(Path(f"{name}.json").read_text(encoding="utf-8")) for name in ("plan", "here")
    )
    for seconds in ("solve_seconds", "total_seconds"):
        del there[seconds], here[seconds]
    assert there == here


@pytest.mark.parametrize("command", ["node", "lens_adapter", "simulated_lens", "demo"])
def test_what_runs_on_linux_only_says_so(
    command: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "platform", "darwin")
    assert cli.main([command]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line == (
        f"focus_planner: error: {command} runs on Linux, with ROS 2; this is darwin, where all"
        " commands run that need no ROS (see focus_planner --help)"
    )


# --- text ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("encoding", "text"),
    [
        ("cp1252", "3.1 ± 0.2 m² - 5 × 2 >= 1 … “\\u03bb”"),
        ("ascii", "3.1 +- 0.2 m2 - 5 x 2 >= 1 ... \\u201c\\u03bb\\u201d"),
        ("utf-8", "3.1 ± 0.2 m² − 5 × 2 ≥ 1 … “λ”"),
    ],
)
def test_what_a_stream_lacks_is_written_as_what_it_has(encoding: str, text: str) -> None:
    written = io.BytesIO()
    stream = io.TextIOWrapper(written, encoding, newline="")
    make_legible(stream)
    stream.write("3.1 ± 0.2 m² − 5 × 2 ≥ 1 … “λ”")
    stream.flush()
    assert written.getvalue() == text.encode(encoding)


# --- what is installed ---------------------------------------------------------------------------

SYSTEMS = {
    "Linux x86-64": ("linux", "x86_64"),
    "Linux aarch64": ("linux", "aarch64"),
    "macOS arm64": ("darwin", "arm64"),
    "Windows x86-64": ("win32", "AMD64"),
}


def on(marker: Marker | None, system: str) -> bool:
    platform, machine = SYSTEMS[system]
    return marker is None or marker.evaluate(
        {"sys_platform": platform, "platform_machine": machine, "os_name": "posix"}
    )


def needed(requirements: list[str], system: str) -> set[str]:
    found = map(Requirement, requirements)
    return {each.name.lower().replace("_", "-") for each in found if on(each.marker, system)}


@pytest.mark.parametrize("system", SYSTEMS)
def test_the_lock_has_what_the_package_needs_on_every_system(system: str) -> None:
    """With a wheel each: ``tools/check_lock.sh`` asks the index for them."""
    with patch("setuptools.setup") as setup:
        runpy.run_path(str(REPOSITORY / "setup.py"))
    given = setup.call_args.kwargs
    needs = [*given["install_requires"], *chain.from_iterable(given["extras_require"].values())]
    lines = (REPOSITORY / "requirements.in").read_text(encoding="utf-8").splitlines()
    direct = [line.partition("#")[0] for line in lines if line[:1].isalpha()]
    assert needed(needs, system) <= needed(direct, system)
    lock = (REPOSITORY / "requirements.lock").read_text(encoding="utf-8").splitlines()
    pins = [line.rstrip(" \\") for line in lock if line[:1].isalnum()]
    assert needed(direct, system) <= needed(pins, system)
    casters = needed(needs, system) & {"open3d", "open3d-cpu"}
    assert casters == {"open3d-cpu" if system == "Linux x86-64" else "open3d"}
    assert any(name.startswith("ros-") for name in needed(pins, system)) == (
        system == "Linux x86-64"
    )
