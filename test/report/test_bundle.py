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
import subprocess
from pathlib import Path
from shutil import which

import numpy as np
import pytest

from focus_planner.core.rig.geometry import camera_rotations
from focus_planner.core.surface.resolution import metres_per_pixel
from focus_planner.report.payload import encoded_payload
from testing import report_contents
from testing.payloads import decoded

ROOT = Path(__file__).parents[2]
PAGE, BUNDLE = ROOT / "report_page", ROOT / "focus_planner/report/bundle"
ESBUILD = PAGE / "node_modules/.bin/esbuild"


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


@pytest.mark.processes
@pytest.mark.skipif(
    not (which("node") and ESBUILD.exists()), reason="needs Node and the packages of make bundle"
)
def test_the_page_s_resolution_is_the_planners(tmp_path):
    content = report_contents.small()
    facts, _ = decoded(encoded_payload(content))
    surface, rig = content.surface, content.rig
    samples = np.repeat(np.arange(len(surface.points)), np.diff(surface.pair_offsets))[::7]
    cameras = surface.pair_camera[::7]
    points, normals = surface.points[samples], surface.normals[samples]
    expected = metres_per_pixel(points, normals, rig, cameras)
    told = [
        {
            "position": rig.cameras[c].position,
            "rotation": rotation,
            "picture": facts["images"][facts["cameras"][c]["image"]],
        }
        for c, rotation in enumerate(camera_rotations(rig).reshape(-1, 9).tolist())
    ]
    asked = [
        [told[c], point, normal]
        for c, point, normal in zip(cameras, points.tolist(), normals.tolist(), strict=True)
    ]
    module = tmp_path / "geometry.mjs"
    bundled = [str(ESBUILD), "src/geometry.ts", "--format=esm", f"--outfile={module}"]
    subprocess.run([*bundled, "--log-level=error"], cwd=PAGE, check=True)
    (tmp_path / "asked.json").write_text(json.dumps(asked))
    (tmp_path / "run.mjs").write_text(
        """
        import { readFileSync } from "node:fs";
        import { metresPerPixel } from "./geometry.mjs";
        const asked = JSON.parse(readFileSync("asked.json", "utf8"));
        console.log(JSON.stringify(asked.map((each) => metresPerPixel(...each))));
        """
    )
    done = subprocess.run(
        ["node", "run.mjs"], cwd=tmp_path, check=True, capture_output=True, text=True
    )
    assert {image["kind"] for image in facts["images"]} == {"polynomial", "fisheye"}
    assert json.loads(done.stdout) == pytest.approx(expected.tolist(), rel=1e-4)
