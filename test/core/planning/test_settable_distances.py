# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Plans name only distances that the lenses can be set to."""

import dataclasses
import math

import numpy as np
import pytest

from focus_planner import (
    CameraStatus,
    InputError,
    Lens,
    LensTable,
    PlanRequest,
    Rig,
    plan_focus,
)
from focus_planner.core.planning.request import METHODS
from testing.plans import RIG, SCENE, away, distances, without_seconds
from testing.problems import (
    around,
    stepped_lenses,
)

each_method = pytest.mark.parametrize("method", METHODS)


@each_method
def test_lens_limits_are_kept_exactly(method):
    lens = Lens(0.05, 10.0, 0.8, 0.95)
    rig = around(6, 1.0, lens=lens)
    plan = plan_focus(SCENE, rig, PlanRequest(method, samples=300))
    assert ((distances(plan) >= 0.8) & (distances(plan) <= 0.95)).all()
    free = plan_focus(SCENE, RIG, PlanRequest(method, samples=300))
    assert ((distances(free) < 0.8) | (distances(free) > 0.95)).any()


@each_method
def test_every_distance_that_a_plan_names_can_be_set(method):
    rig = stepped_lenses(Rig((*RIG.cameras, away(), away("far_away"))))
    assert rig.cameras[-1].lens.focus_steps == 8
    for shots, tolerance in ((1, 0.0), (2, 0.0), (3, 0.002)):
        request = PlanRequest(method, samples=300, shots=shots, depth_tolerance=tolerance)
        plan = plan_focus(SCENE, rig, request)
        assert without_seconds(plan) == without_seconds(plan_focus(SCENE, rig, request))
        for camera, of_rig in zip(plan.cameras, rig.cameras, strict=True):
            settable = of_rig.lens.settable_distances
            if settable is not None:
                assert {shot.focus_distance for shot in camera.shots} <= set(settable)
                assert camera.focus_distance in settable


@each_method
def test_device_values_are_what_the_tables_say_and_whole_where_they_must_be(method):
    tables = (
        LensTable("focus_absolute", True, (0.55, 0.8, 1.3), (90, 40.5, 3)),
        LensTable("steps", False, (0.6, 1.0, math.inf), (0, 500, 900)),
        LensTable("dioptres"),
        None,
    )
    rig = Rig((*RIG.cameras, away(), away("far_away")))
    rig = Rig(
        tuple(
            dataclasses.replace(camera, lens=Lens(table=tables[i % len(tables)]))
            for i, camera in enumerate(rig.cameras)
        )
    )
    plan = plan_focus(SCENE, rig, PlanRequest(method, samples=300, shots=2))
    assert {camera.device_unit for camera in plan.cameras} == {
        *("focus_absolute", "steps", "dioptres", None)
    }
    for camera, of_rig in zip(plan.cameras, rig.cameras, strict=True):
        table = of_rig.lens.table
        if table is None:
            assert (camera.device_value, camera.device_unit) == (None, None)
            assert all(shot.device_value is None for shot in camera.shots)
            continue
        assert camera.device_unit == table.unit
        for shot in (camera, *camera.shots):
            assert table.nearest <= shot.focus_distance <= table.farthest
            assert shot.device_value == table.value_at(shot.focus_distance)
            if table.whole:
                assert table.distance_at(round(shot.device_value)) == shot.focus_distance


def test_a_table_that_allows_every_distance_changes_no_plan():
    told = around(6, 1.0, lens=Lens(table=LensTable("dioptres")))
    for method in METHODS:
        plain, with_table = (
            plan_focus(SCENE, rig, PlanRequest(method, samples=300)) for rig in (RIG, told)
        )
        assert plain.cost == with_table.cost
        np.testing.assert_array_equal(plain.focus_distances, with_table.focus_distances)


def test_tables_with_nothing_in_reach_are_an_error():
    table = LensTable("steps", True, (40.0, 50.0), (0, 10))
    rig = around(6, 1.0, lens=Lens(table=table))
    with pytest.raises(InputError, match=r"^lens.table, lens.min_focus, .* none of it, at depths"):
        plan_focus(SCENE, rig, PlanRequest(samples=300))


def test_a_list_is_planned_on_not_rounded_to():
    # In focus as far as the listed distances allow, which rounding misses.
    lens = Lens(focus_distances=tuple(np.arange(0.6, 1.4, 0.06)))
    request = PlanRequest(samples=1000)
    exact = plan_focus(SCENE, around(6, 1.0, lens=lens), request)
    free = plan_focus(SCENE, RIG, request)
    rounded = [
        lens.settable_distances[np.abs(lens.settable_distances - s).argmin()]
        for s in free.focus_distances
    ]
    assert free.cost < exact.cost < exact.problem.cost(np.array(rounded))


def test_a_list_with_nothing_in_reach_leaves_a_camera_out_of_focus():
    blind = dataclasses.replace(RIG.cameras[0], lens=Lens(focus_distances=(4.0, 5.0)))
    for method in METHODS:
        plan = plan_focus(SCENE, Rig((blind, *RIG.cameras[1:])), PlanRequest(method, 300))
        camera = plan.cameras[0]
        assert (camera.focus_distance, camera.in_focus_samples) == (4.0, 0)
        assert camera.status in {CameraStatus.PLANNED, CameraStatus.UNASSIGNED}


def test_lists_with_nothing_in_reach_are_an_error():
    rig = around(6, 1.0, lens=Lens(focus_distances=(40.0, 50.0)))
    with pytest.raises(InputError, match=r"^lens.focus_distances, .* none of it, at depths from"):
        plan_focus(SCENE, rig, PlanRequest(samples=300))
