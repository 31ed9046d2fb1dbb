# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Options that have an effect only beside others are refused without them, in the same words."""

from __future__ import annotations

from pathlib import Path

import pytest

from focus_planner.cli import main as cli

RUN = "bags/mesh_k_view"
PLAN = "plan body.ply --rig rig.yaml"
PREVIEW = f"preview {RUN}"
PUBLISH_RIG = "publish --rig rig.yaml"


@pytest.mark.parametrize(
    ("words", "error"),
    [
        (f"{PLAN} --markers", "--markers: expected --record with it, got none"),
        (f"{PLAN} --record-access owner", "--record-access: expected --record with it, got none"),
        (f"{PLAN} --no-pictures", "--pictures: expected --report with it, got none"),
        (f"replay {RUN} --markers", "--markers: expected --record with it, got none"),
        (f"replay {RUN} --record-access all", "--record-access: expected --record with it, got"),
        (f"replay {RUN} --node /other", "--node: expected --live with it, got none"),
        (f"replay {RUN} --pictures", "--pictures: expected --report with it, got none"),
        (f"masks {RUN} -o out --maps exr", "--maps: expected --depth or --blur with it, got none"),
        (f"masks {RUN} -o out --up y", "--up: expected --surface with it, got none"),
        (f"report {RUN} -o r.html --up y", "--up: expected --surface with it, got none"),
        (f"{PUBLISH_RIG} --up y", "--up: expected SURFACE with it, got none"),
        (f"{PUBLISH_RIG} --importance i.txt", "--importance: expected SURFACE with it, got none"),
        (
            f"{PUBLISH_RIG} --importance-property weight",
            "--importance-property: expected SURFACE with it, got none",
        ),
        ("publish body.ply --lens-tables t.yaml", "--lens-tables: expected --rig with it, got"),
        ("publish body.ply --method em", "--method: expected --plan with it, got none"),
        (f"{PREVIEW} --all --up y", "--up: expected --surface with it, got none"),
        (f"{PREVIEW} --all --scale 0.5", "--scale: expected --camera with it, got none"),
        (f"{PREVIEW} --all -o all.png --scale 0.5", "--scale: expected --camera with it, got none"),
    ],
)
def test_what_would_have_no_effect_is_refused(
    words: str, error: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(words.split()) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert f"focus_planner: error: {error}" in err
    assert err.count("\n") == 1
    for name in ("out", "r.html", "all.png"):
        assert not Path(name).exists()


@pytest.mark.parametrize("name", ["plan.gif", "plan", "plan.webp", "plan.png.gz"])
def test_a_picture_that_would_not_be_what_its_name_says_is_refused(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main([*PLAN.split(), "--picture", name]) == 2
    expected = "a name that ends in .png, .jpg, .jpeg, .tif, .tiff, .pdf or .svg"
    assert (
        capsys.readouterr().err
        == f"focus_planner: error: --picture: expected {expected}, got {name}\n"
    )


@pytest.mark.parametrize(
    ("option", "name", "error"),
    [
        ("--picture", ".PNG", "--picture: expected a name before .PNG, got .PNG; such as x.PNG"),
        ("--problem", "problem.json", "--problem: expected a name that ends in .npz, got problem"),
        ("--problem", ".npz", "--problem: expected a name before .npz, got .npz"),
        ("--output", ".json", "--output: expected a name before .json, got .json; such as x.json"),
    ],
)
def test_so_is_any_other_file(
    option: str, name: str, error: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main([*PLAN.split(), option, name]) == 2
    assert f"error: {error}" in capsys.readouterr().err
