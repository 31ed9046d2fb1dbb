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

import csv
import re
from collections import Counter
from pathlib import Path

import pytest

from focus_planner.core.rig.layouts import cylinder_rig
from focus_planner.io.bodies import body
from focus_planner.io.plans import load_plan
from focus_planner.io.rigs import save_rig
from testing.forked import PIPE, ForkedProcess, run_forked
from testing.ros.calls import WAITING
from testing.ros.planner_process import PATIENCE, PlannerProcess

ROOT = Path(__file__).parents[1]
EXAMPLES = ROOT / "examples"
PROGRAM = "testing.ros.patient_script"

pytestmark = pytest.mark.processes


def path_of(name):
    return str(EXAMPLES / f"{name}.py")


def run(name, *arguments):
    done = run_forked(PROGRAM, path_of(name), *map(str, arguments))
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture
def rig_file(tmp_path):
    path = tmp_path / "rig.yaml"
    save_rig(cylinder_rig(2, 8), path)
    return path


def test_every_example_is_listed_and_tested():
    scripts = {path.stem for path in EXAMPLES.glob("*.py")}
    listed = re.findall(r"\]\((\w+)\.py\)", (EXAMPLES / "README.md").read_text())
    page = (ROOT / "docs/examples.md").read_text()
    shown = re.findall(r"include\} \.\./examples/(\w+)\.py", page)
    tested = re.findall(r'(?:run|path_of)\("(\w+)"', Path(__file__).read_text())
    assert scripts == set(listed) == set(shown) == set(tested)


def test_plan_a_file(rig_file, tmp_path):
    said = run("plan_a_file", body("arms_out"), rig_file, tmp_path / "plan.json")
    plan = load_plan(tmp_path / "plan.json")
    assert said.startswith("k_view, cost ")
    assert all(f"{c.name}: {c.focus_distance:.3f} m" in said for c in plan.cameras)


def test_booth(rig_file):
    persons = body("arms_out"), body("arms_down")
    said = run("booth", rig_file, body("arms_raised"), *persons).splitlines()
    assert [line.split(":")[0] for line in said] == [
        *("arms_out", "arms_down"),
        *("the visitor, taped", "the visitor, autofocus", "the visitor, own plan"),
    ]
    assert sum(line.endswith(", the worst") for line in said) == 1
    taped, autofocus, own = (int(re.search(r"(\d+)%", line)[1]) for line in said[2:])
    assert autofocus < taped < own


def test_compare_methods(rig_file):
    head, *rows = run("compare_methods", body("arms_out"), rig_file).splitlines()
    assert head.split()[2:] == ["closest", "em", "k_view"]
    shares = [[int(share.rstrip("%")) for share in row.split()[1:]] for row in rows]
    assert len(shares) == 3
    assert all(closest < k_view for closest, _, k_view in shares)  # planning pays
    assert shares == sorted(shares)  # so does stopping down


def test_photogrammetry(rig_file, tmp_path):
    said = run("photogrammetry", rig_file, body("arms_out"), tmp_path / "plan.json")
    *rows, last = said.splitlines()
    assert [row.split(":")[0] for row in rows] == [
        *("autofocus", "planned for one view", "planned for three")
    ]
    autofocus, one, three = (
        {views: int(share) for share, views in re.findall(r"(\d+)% in (\d)", row)} for row in rows
    )
    assert list(one) == ["1", "2", "3", "5"]
    assert autofocus["3"] <= one["3"] < three["3"]
    assert three["1"] < one["1"]
    assert re.fullmatch(r"within \d\.\d% of the best plan for three", last)
    assert load_plan(tmp_path / "plan.json").views == 3


def test_turntable(tmp_path):
    said = run("turntable", body("arms_out"), tmp_path / "capture.csv").splitlines()
    shares, pictures = zip(
        *(re.search(r": (\d+)% sharp in 3 views, (\d+) pictures$", line).groups() for line in said),
        strict=True,
    )
    autofocus, each_pose, as_many, more = map(int, shares)
    assert autofocus < each_pose < as_many < more
    assert autofocus < 20
    assert more > 90
    assert pictures == ("48", "48", "48", "72")
    with (tmp_path / "capture.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [int(row["picture"]) for row in rows] == list(range(1, 73))
    # Turn by turn, the pictures of a stop one after the other, some stops none and others several.
    names = [row["name"] for row in rows]
    assert names == sorted(names)
    at_a_stop = Counter(names)
    assert len(at_a_stop) < 48
    assert 2 < max(at_a_stop.values()) <= 4
    assert [int(row["shot"]) for row in rows] == [
        shot for name in at_a_stop for shot in range(1, at_a_stop[name] + 1)
    ]
    assert all(0.27 < float(row["distance_m"]) < 0.33 for row in rows)


def test_table1():
    said = run("table1", body("arms_out").parent, 200, 500)
    head, *rows = said.splitlines()
    assert head.split()[:3] == ["method", "closest", "average"]
    costs = {row.split()[0]: list(map(float, row.split()[1:])) for row in rows[1:4]}
    assert list(costs) == ["arms_down", "arms_out", "arms_raised"]
    for closest, average, em, two_view, two_view_all, bound in costs.values():
        assert bound < two_view_all <= two_view < em < min(closest, average)
    assert "Every method planned for 3 subjects, on 200 samples of each" in said


def test_another_aperture():
    said = run("another_aperture", ROOT / "bags/mesh_k_view", 32).splitlines()
    recorded, stopped_down = (
        float(re.search(r"([\d.]+) m² in focus", line)[1]) for line in said[:2]
    )
    assert stopped_down > recorded


def test_orchestrate_and_camera_driver(rig_file):
    node = PlannerProcess("focus_planner", *WAITING)
    driver = ForkedProcess(PROGRAM, path_of("camera_driver"), "cam_0_03", stdout=PIPE)
    try:
        said = run("orchestrate", body("arms_out"), rig_file)
        assert re.search(r"^optimal, cost .*^in force: ", said, re.MULTILINE | re.DOTALL)
        assert re.match(r"cam_0_03: 0\.\d+ m, \d\.\d+ 1/m$", driver.stdout.readline())
    finally:
        driver.kill()
        driver.wait(PATIENCE)
        driver.stdout.close()
        assert node.stop() == 0
