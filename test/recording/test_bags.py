# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The recorded runs that the repository holds, planned again."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from focus_planner.core.planning.request import METHODS
from focus_planner.io.bodies import bodies
from focus_planner.io.surfaces import load_surface
from focus_planner.messages.reading import mesh_from_bytes
from focus_planner.messages.typestore import CLOUD, MESH, POSES, RIG, VERTEX_DATA
from focus_planner.recording.bag_reading import read_bag
from focus_planner.recording.replay import differences, plan_run
from focus_planner.recording.run_reading import read_run
from focus_planner.recording.software import software

BAGS = Path(__file__).parents[2] / "bags"
RUNS = sorted({file.parent for file in BAGS.glob("*/*.mcap")})
ON_THE_PROCESSOR = ("processor", "instructions", "open3d-cpu")


@pytest.mark.parametrize("path", RUNS, ids=lambda path: path.name)
def test_a_recorded_run_is_reproduced(path):
    run = read_run(path)
    assert run.fault == ""
    replayed = plan_run(run)
    assert run.ending.success is not path.name.startswith("failed")
    assert replayed.ending.success is run.ending.success
    found = differences(run, replayed)
    then, now = run.beginning.software, software()
    if all(then[name] == now[name] for name in ON_THE_PROCESSOR):
        assert found == []
    elif found:
        # A grazing ray may hit on one processor and miss on another, and a cloud's normals are
        # estimated there: nothing else may begin to differ, and no plan becomes another one.
        rays = ("visibility", "samples") if "cloud" in path.name else ("visibility",)
        assert found[0].stage.removeprefix("fresh ") in rays
        assert replayed.ending.plan.cost == pytest.approx(run.ending.plan.cost, rel=0.01)


def test_what_older_versions_did_not_tell_is_not_told():
    runs = [read_run(path) for path in RUNS]
    older = [run for run in runs if run.beginning.software["focus_planner"] == "0.1.0"]
    assert len(older) > 10
    for plan in filter(None, (run.ending.plan for run in older)):
        assert (plan.views, plan.max_mm_per_pixel) == (1, math.inf)
        assert (plan.sharp_areas, plan.resolution) == ((), None)


def test_they_are_of_every_kind():
    runs = {path.name: read_run(path) for path in RUNS}
    plans = [run.ending.plan for run in runs.values() if run.ending.plan]
    assert {plan.method for plan in plans} == set(METHODS)
    kinds = {message.type_name for run in runs.values() for message in run.inputs}
    assert kinds == {MESH, CLOUD, POSES, RIG, VERTEX_DATA}
    assert any(not run.ending.success for run in runs.values())
    assert any(not plan.converged for plan in plans)
    assert any(run.beginning.warm_start for run in runs.values())
    assert any(plan.shots > 1 for plan in plans)
    units = [{camera.device_unit for camera in plan.cameras} for plan in plans]
    assert units.count({None}) == len(plans) - 1
    assert {"focus_absolute", "steps", "dioptres"} in units
    (mixed,) = runs["mixed_rig"].rigs()
    cameras = mixed.read(runs["mixed_rig"].beginning.settings.optics).cameras
    assert len({camera.lens for camera in cameras}) == 3
    assert len({camera.intrinsics for camera in cameras}) == 2


def test_the_data_set_is_the_shipped_bodies():
    bag = read_bag(BAGS / "data_sets" / "bodies")
    assert bag.whole
    assert {(m.topic, m.type_name) for m in bag.messages} == {("/focus_planner/mesh", MESH)}
    for message, path in zip(bag.messages, bodies(), strict=True):
        mesh, body = mesh_from_bytes(message.payload), load_surface(path)
        np.testing.assert_array_equal(mesh.vertices, body.vertices)
        np.testing.assert_array_equal(mesh.triangles, body.triangles)


def test_the_readme_names_them_all():
    text = (BAGS / "README.md").read_text()
    for path in [*RUNS, BAGS / "data_sets" / "bodies"]:
        assert f"`{path.relative_to(BAGS)}" in text
