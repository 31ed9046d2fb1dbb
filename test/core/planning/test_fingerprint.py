# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Fingerprints: equal where all is equal, and different where, and only where, something is not."""

from dataclasses import replace

import numpy as np
import pytest

from focus_planner import CostModel, PlanRequest, PointCloud, Scene, plan_focus
from focus_planner.core.planning.fingerprint import fingerprints
from testing.problems import around, torus

MESH = torus(0.4, 0.15)
RIG = around(6, 1.0)
STAGES = ("samples", "visibility", "costs")


def plan(**changes):
    return plan_focus(Scene(MESH), RIG, PlanRequest("em", **{"samples": 300, **changes}))


def changed(one, other):
    """The stages that differ, and in which entries."""
    pairs = zip(fingerprints(one), fingerprints(other), strict=True)
    return {
        a.stage: [k for k, digest in enumerate(a.digests) if digest != b.digests[k]]
        for a, b in pairs
        if a != b
    }


@pytest.fixture(scope="module")
def before():
    return plan()


def test_the_same_plan_has_the_same(before):
    assert fingerprints(plan()) == fingerprints(before)


def test_they_count_what_there_is(before):
    found = fingerprints(before)
    assert [f.stage for f in found] == [*(f"fresh {stage}" for stage in STAGES), *STAGES]
    for problem, (samples, visibility, costs) in (
        (before.fresh_problem, found[:3]),
        (before.problem, found[3:]),
    ):
        assert samples.counts == (problem.sample_count,)
        expected = tuple(np.bincount(problem.camera_index, minlength=len(RIG)))
        assert visibility.counts == costs.counts == expected
        for fingerprint in (samples, visibility, costs):
            assert len(fingerprint.digests) == len(fingerprint.counts)
            assert all(0 <= digest < 2**64 for digest in fingerprint.digests)
            assert all(type(digest) is int for digest in fingerprint.digests)
            assert all(type(count) is int for count in fingerprint.counts)


def test_a_seed_changes_all_and_a_model_only_costs(before):
    assert set(changed(plan(seed=1), before)) == {f.stage for f in fingerprints(before)}
    model = CostModel(0.2, 0.2, 0.6)
    other = plan_focus(Scene(MESH), RIG, PlanRequest("em", 300), model)
    every = list(range(len(RIG)))
    assert changed(other, before) == {"fresh costs": every, "costs": every}


def test_one_pair_changes_its_camera(before):
    p = before.problem
    for name, change, stages in (
        ("sample_index", 1, {"visibility"}),
        ("base_cost", 1e-16, {"costs"}),
        ("focus_near", 1e-16, {"costs"}),
        ("focus_far", 1e-15, {"costs"}),
        ("depth", 1e-15, {"costs"}),
    ):
        values = getattr(p, name).copy()
        values[77] += change
        assert values[77] != getattr(p, name)[77]
        other = replace(before, problem=replace(p, **{name: values}))
        assert changed(other, before) == {stage: [p.camera_index[77]] for stage in stages}


@pytest.mark.parametrize("name", ["points", "normals", "weights", "areas"])
def test_the_last_bit_of_a_sample_counts(before, name):
    samples = before.problem.samples
    values = getattr(samples, name).copy()
    values[5] = np.nextafter(values[5], 9)
    problem = replace(before.problem, samples=replace(samples, **{name: values}))
    assert changed(replace(before, problem=problem), before) == {"samples": [0]}


def test_shots_see_the_same(before):
    bracket = fingerprints(plan(shots=3))
    for one, three in zip(fingerprints(before), bracket, strict=True):
        assert one == three


def test_a_camera_that_sees_nothing_has_no_pairs():
    away = replace(RIG.cameras[2], orientation=(0.0, 0.0, 0.0, 1.0), position=(0.0, 0.0, 50.0))
    rig = type(RIG)((*RIG.cameras[:2], away, *RIG.cameras[3:]))
    found = fingerprints(plan_focus(Scene(MESH), rig, PlanRequest("em", 300)))
    assert [f.counts[2] for f in found if len(f.counts) > 1] == [0] * 4
    assert all(len(f.digests) in (1, len(rig)) for f in found)


def test_a_cloud_has_them_too():
    scene = Scene(PointCloud(MESH.vertices))
    request = PlanRequest("em", 0, fresh_samples=100)
    one, other = (fingerprints(plan_focus(scene, RIG, request)) for _ in range(2))
    assert one == other
    assert one[3].counts == (len(MESH.vertices),)
