# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""``focus_planner publish``: what is refused before a node is looked for."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import pytest

from focus_planner.cli import main as cli
from focus_planner.io.bodies import body

BODY = str(body("arms_down"))


@pytest.mark.parametrize(
    ("words", "telling"),
    [
        ([], "expected SURFACE, --rig RIG.YAML or both, got neither"),
        (["--rig", "none.yaml"], "none.yaml"),
        ([BODY, "--node", "~/x"], "--node: expected a node's name"),
        (["none.ply"], "none.ply"),
        ([BODY, "--rig", "none.yaml"], "none.yaml"),
    ],
)
def test_what_cannot_be_published_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: list[str], telling: str, capsys: Any
) -> None:
    monkeypatch.chdir(tmp_path)
    assert cli.main(["publish", *words]) == 2
    out, err = capsys.readouterr()
    assert telling in err
    assert out == ""
    assert len(err.splitlines()) == 1


def test_an_importance_that_a_mesh_message_cannot_carry_is_refused(
    tmp_path: Path, capsys: Any
) -> None:
    importance = tmp_path / "importance.txt"
    importance.write_text("1\n" * 13_718)
    assert cli.main(["publish", BODY, "--importance", str(importance)]) == 2
    assert "got a mesh, whose message has no place for it" in capsys.readouterr().err


@pytest.mark.parametrize("command", ["publish", "status"])
def test_without_ros_it_says_so(command: str, monkeypatch: pytest.MonkeyPatch, capsys: Any) -> None:
    for name in ("client", "reaching", "feeding"):
        monkeypatch.setitem(sys.modules, f"focus_planner.ros.{name}", None)
    words = [BODY] if command == "publish" else []
    assert cli.main([command, *words]) == 2
    assert f"{command} needs ROS 2 (rclpy) and focus_planner_msgs" in capsys.readouterr().err
