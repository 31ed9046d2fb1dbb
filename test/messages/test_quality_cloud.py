# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The quality cloud beside the numbers of the plan, found pair by pair."""

from __future__ import annotations

import numpy as np
import pytest
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import PointCloud2, PointField

from focus_planner import Lens, PlanRequest
from focus_planner.core.planning.plan_focus import plan_focus
from focus_planner.core.planning.sampled_quality import sampled_quality
from focus_planner.core.surface.scene import Scene
from focus_planner.messages.quality_cloud import quality_cloud_to_fields
from focus_planner.messages.typestore import CLOUD, serialize
from testing.problems import around, sphere
from testing.visuals import cloud_columns

RIG = around(5, 2.2)
# Holds so little in focus that a camera's shots are of different parts.
SHALLOW = around(5, 2.2, lens=Lens(0.085, 60.0))


def planned(shots=1, images=0):
    request = PlanRequest("em", 300, fresh_samples=200, shots=shots, images=images)
    return plan_focus(Scene(sphere(0.6)), RIG if shots == 1 else SHALLOW, request)


def cloud_of(quality):
    """What ROS reads of it."""
    payload = serialize(CLOUD, quality_cloud_to_fields(quality, "stage", (7, 8)))
    return deserialize_message(payload, PointCloud2)


def obvious(plan):
    """Return each sample's cost, camera, whether it is in focus, and views, one by one."""
    problem, focus, shots = plan.fresh_problem, plan.focus_distances, plan.shots
    rows = []
    for p in range(problem.sample_count):
        pairs = range(problem.sample_offsets[p], problem.sample_offsets[p + 1])
        best, holds = (1.0, -1, False), set()
        for pair in pairs:
            picture = problem.camera_index[pair]
            if focus[picture] == -np.inf:  # it is not taken
                continue
            sharp = problem.focus_near[pair] <= focus[picture] <= problem.focus_far[pair]
            cost = problem.base_cost[pair] + (0.0 if sharp else problem.focus_weight)
            if cost < best[0]:
                best = (cost, picture // shots, sharp)
            if sharp:
                holds.add(picture // shots)
        rows.append((*best, len(holds)))
    return tuple(np.array(column) for column in zip(*rows, strict=True))


@pytest.mark.parametrize(("shots", "images"), [(1, 0), (3, 0), (1, 4), (3, 7)])
def test_every_point_has_the_numbers_of_the_plan(shots, images):
    plan = planned(shots, images)
    found = cloud_columns(cloud_of(sampled_quality(plan.fresh_problem, plan.focus_distances)))
    cost, camera, in_focus, views = obvious(plan)
    assert 0 < in_focus.sum() < len(in_focus)
    assert len(set(views)) > 2
    points = np.stack([found[axis] for axis in "xyz"], axis=1)
    np.testing.assert_array_equal(points, plan.fresh_problem.samples.points.astype(np.float32))
    np.testing.assert_array_equal(found["cost"], cost.astype(np.float32))
    np.testing.assert_array_equal(found["camera"], camera)
    np.testing.assert_array_equal(found["in_focus"], in_focus)
    np.testing.assert_array_equal(found["views"], views)
    assert 1000 * found["cost"].mean(dtype=float) == pytest.approx(plan.fresh_cost)
    blue, orange, grey = 0x2C6FB5, 0xF4B45C, 0x9AA3AB
    expected = [blue if sharp else orange for sharp in in_focus]
    expected = [each if c >= 0 else grey for each, c in zip(expected, camera, strict=True)]
    assert found["rgb"].view(np.uint32).tolist() == expected


def test_what_no_camera_sees_costs_1_and_has_no_camera():
    plan = plan_focus(
        Scene(sphere(0.6)), around(1, 2.2), PlanRequest("closest", 300, fresh_samples=200)
    )
    found = cloud_columns(cloud_of(sampled_quality(plan.fresh_problem, plan.focus_distances)))
    unseen = found["camera"] < 0
    assert 0 < unseen.sum() < len(unseen)
    assert set(found["cost"][unseen]) == {1.0}
    assert not found["in_focus"][unseen].any()
    assert not found["views"][unseen].any()
    assert set(found["rgb"].view(np.uint32)[unseen]) == {0x9AA3AB}


def test_its_form_is_one_that_viewers_take():
    plan = planned()
    cloud = cloud_of(sampled_quality(plan.fresh_problem, plan.focus_distances))
    assert cloud.header.frame_id == "stage"
    assert (cloud.header.stamp.sec, cloud.header.stamp.nanosec) == (7, 8)
    assert (cloud.height, cloud.width, cloud.is_dense, cloud.is_bigendian) == (1, 200, True, False)
    assert cloud.row_step == cloud.point_step * cloud.width == len(cloud.data)
    by_name = {field.name: field for field in cloud.fields}
    assert [*by_name] == ["x", "y", "z", "cost", "rgb", "camera", "views", "in_focus"]
    # Viewers place points by single precision only, and find colours in four bytes of it.
    for name in ("x", "y", "z", "cost", "rgb"):
        assert by_name[name].datatype == PointField.FLOAT32
    for field in cloud.fields:
        assert (field.count, field.offset % 4) == (1, 0)


def test_nothing_is_a_cloud_of_the_same_fields():
    cloud = cloud_of(None)
    assert (cloud.width, len(cloud.data), len(cloud.fields)) == (0, 0, 8)
    assert cloud.header.frame_id == "stage"
