# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A node in a process of its own, called over DDS."""

from __future__ import annotations

import math
import re
import threading
from dataclasses import replace

import numpy as np
import pytest
from focus_planner_msgs.msg import CameraFocus, CameraRig
from geometry_msgs.msg import PoseArray
from sensor_msgs.msg import PointCloud2

from focus_planner.core.planning.plan_focus import plan_focus
from focus_planner.core.planning.request import PlanRequest
from focus_planner.core.rig.camera import Camera, CameraIntrinsics
from focus_planner.core.rig.layouts import cylinder_rig
from focus_planner.core.rig.lens import Lens
from focus_planner.core.rig.rig import Rig
from focus_planner.core.surface.scene import Scene
from focus_planner.core.surface.surface import PointCloud
from focus_planner.lenses.orders import order_from_message
from focus_planner.messages.cdr import write_mesh
from focus_planner.messages.plan_reading import plan_from_message
from focus_planner.messages.writing import (
    cloud_to_fields,
    mesh_to_bytes,
    poses_to_fields,
    rig_to_fields,
)
from focus_planner.ros.client import PlannerClient
from focus_planner.ros.conversions import message_to_ros
from testing.ros.bits import bits
from testing.ros.calls import having, what_counts
from testing.ros.goals import cancelled, planning
from testing.ros.planner_process import PATIENCE

pytestmark = pytest.mark.processes

SAMPLES = 300


@pytest.fixture
def ready(client, body, rig):
    """The client of a node that has a good surface and a good rig in force."""
    client.publish_mesh(body)
    client.publish_rig(rig)
    return client


def planned(client, **request):
    response = client.plan(**{"samples": SAMPLES, **request})
    assert response.success, response.message
    return response.plan


def refused(client, **request):
    response = client.plan(**{"samples": SAMPLES, **request})
    assert not response.success
    assert response.plan.plan_id == ""
    return response.message


def of_the_core(surface, rig, **request):
    plan = plan_focus(Scene(surface), rig, PlanRequest(**{"samples": SAMPLES, **request}))
    return plan.cost, plan.cameras


@pytest.mark.parametrize(
    "request_",
    [
        {"method": "closest"},
        {"method": "average", "seed": 7},
        {"method": "em", "samples": 1000},
        {"method": "k_view"},
        {"method": "k_view", "k": 3, "scope": "assigned"},
        {"method": "k_view", "shots": 3, "depth_tolerance": 0.002},
        {"method": "em", "views": 2, "max_mm_per_pixel": 1.0, "bound": "none"},
        {"method": "k_view", "shots": 2, "images": 5},
    ],
)
def test_a_plan_is_the_cores_bit_for_bit(ready, body, rig, request_):
    plan = plan_from_message(planned(ready, **request_))
    assert (plan.cost, plan.cameras) == of_the_core(body, rig, **request_)


def test_the_same_request_gives_the_same_plan_under_another_name(ready):
    first, second = planned(ready), planned(ready)
    assert what_counts(first) == what_counts(second)
    assert first.plan_id != second.plan_id


def test_a_plan_tells_about_itself(ready, body):
    plan = planned(ready, method="em", seed=3)
    assert (plan.method, plan.samples, plan.seed) == ("em", SAMPLES, 3)
    assert plan.header.frame_id == "world"
    assert plan.header.stamp.sec > 0
    assert 0.8 * plan.cost < plan.lower_bound <= plan.cost
    assert plan.surface_area == pytest.approx(Scene(body).area)
    assert 0 < plan.in_focus_area <= plan.covered_area <= plan.surface_area
    assert 0 < plan.in_focus_standard_error < plan.in_focus_area
    assert plan.fresh_samples == 4096
    assert plan.fresh_cost > plan.cost > plan.fresh_standard_error > 0
    assert 0 <= plan.solve_seconds <= plan.total_seconds


def test_a_plan_tells_what_is_sharp_in_how_many_views_and_how_finely(ready):
    plan = planned(ready, method="em", views=2, max_mm_per_pixel=1.0, bound="none")
    assert (plan.views, plan.max_mm_per_pixel) == (2, 1.0)
    assert list(plan.sharp_views) == [1, 2, 3, 5]
    assert list(plan.sharp_area) == sorted(plan.sharp_area, reverse=True)
    assert plan.in_focus_area <= plan.sharp_area[0] <= plan.covered_area
    assert len(plan.sharp_standard_error) == 4
    assert 0 < plan.median_mm_per_pixel < plan.percentile_90_mm_per_pixel <= 1.0
    without = planned(ready, method="em")
    assert (without.views, without.max_mm_per_pixel) == (1, 0.0)
    assert without.covered_area > plan.covered_area


def test_who_subscribes_late_gets_the_newest_plan(ready, planner, rig):
    plan = planned(ready)
    with PlannerClient(planner.name) as late:
        assert late.latched_plan().plan_id == plan.plan_id
        assert what_counts(late.latched_plan()) == what_counts(plan)
        for index in (0, len(rig) - 1):
            focus = late.latched_focus(rig.cameras[index].name)
            assert bits(focus) == bits(plan.cameras[index])


def test_a_driver_gets_the_bracket_of_its_camera(ready, rig):
    plan = planned(ready, shots=2)
    assert plan.shots == 2
    name = rig.cameras[0].name
    focus = ready.latched_focus(name)
    assert bits(focus) == bits(plan.cameras[0])
    assert list(focus.bracket) == sorted(focus.bracket)
    assert len(focus.bracket) == 2
    assert focus.focus_distance in focus.bracket
    assert len(planned(ready).cameras[0].bracket) == 1


def test_a_camera_that_takes_no_picture_is_told_so_and_where_to_rest(ready, rig):
    plan = planned(ready, images=3)
    assert (plan.images, plan.shots) == (3, 1)
    idle = [focus for focus in plan.cameras if focus.status == CameraFocus.STATUS_DROPPED]
    assert len(idle) == len(rig) - 3
    focus = ready.latched_focus(idle[0].name)
    assert bits(focus) == bits(idle[0])
    assert (len(focus.shots), len(focus.bracket)) == (0, 0)
    order = order_from_message(focus, idle[0].name)
    assert order.planned
    assert order.focus_distance == focus.focus_distance > 0
    # 0 is the parameter's, which sets no limit.
    assert planned(ready).images == 0


def test_a_lens_that_takes_certain_distances_is_set_to_them(ready, rig):
    lenses = [Lens(focus_distances=(0.6, 0.8, 1.1)), Lens(min_focus=0.5, focus_steps=30)]
    stepped = replace(
        rig,
        cameras=tuple(replace(c, lens=lenses[i % 2]) for i, c in enumerate(rig.cameras)),
    )
    ready.publish_rig(stepped)
    plan = planned(ready, shots=2)
    for focus, camera in zip(plan.cameras, stepped.cameras, strict=True):
        assert set(focus.bracket) <= set(camera.lens.settable_distances)


def test_poses_alone_make_a_rig(ready, body, rig):
    ready.publish_poses(rig)
    plan = planned(ready)
    named = Rig(
        tuple(replace(c, name=f"cam_{i:03d}") for i, c in enumerate(rig.cameras)), rig.frame_id
    )
    assert (plan.cost, plan_from_message(plan).cameras) == of_the_core(body, named)
    assert bits(ready.latched_focus("cam_007")) == bits(plan.cameras[7])


def test_a_rig_says_what_its_cameras_are(ready, body, rig):
    cameras = [
        replace(c, lens=Lens(0.035, 6.0), intrinsics=CameraIntrinsics(width=700))
        for c in rig.cameras
    ]
    other = Rig((*cameras[:5], *rig.cameras[5:]), rig.frame_id)
    ready.publish_rig(other)
    plan = planned(ready)
    assert (plan.cost, plan_from_message(plan).cameras) == of_the_core(body, other)


@pytest.mark.parametrize("with_normals", [False, True])
@pytest.mark.parametrize("samples", [0, SAMPLES])
def test_a_cloud_is_planned_for(ready, body, rig, with_normals, samples):
    random = Scene(body).sample(4000, 1)
    cloud = PointCloud(random.points, random.normals if with_normals else None)
    ready.publish_cloud(cloud)
    assert ready.set_parameters(samples=samples)[0].successful
    plan = planned(ready, samples=0)
    assert ready.set_parameters(samples=4096)[0].successful
    assert plan.cost == of_the_core(cloud, rig, samples=samples)[0]


def test_a_clouds_importance_is_planned_for(ready, body, rig):
    random = Scene(body).sample(4000, 1)
    cloud = PointCloud(random.points, random.normals, random.points[:, 2].clip(0))
    ready.publish_cloud(cloud)
    weighted = planned(ready).cost
    assert weighted == of_the_core(cloud, rig)[0]
    ready.publish_cloud(PointCloud(random.points, random.normals))
    assert planned(ready).cost != weighted


def test_samples_0_leaves_a_meshs_number_to_the_planner(ready, body, rig):
    values = {"samples": 0, "standard_error": 3.0}
    assert all(result.successful for result in ready.set_parameters(**values))
    response = ready.plan(method="em")
    assert all(r.successful for r in ready.set_parameters(samples=4096, standard_error=2.0))
    plan = response.plan
    assert (plan.cost, plan_from_message(plan).cameras) == of_the_core(
        body, rig, method="em", **values
    )
    assert plan.samples == plan.fresh_samples
    assert plan.fresh_standard_error == pytest.approx(3.0, rel=0.1)
    assert f"{plan.fresh_cost:.1f} ± {plan.fresh_standard_error:.1f} on" in response.message


def test_big_endian_meshes_are_read(ready, body, rig):
    before = planned(ready)
    ready.publish_cloud(PointCloud(body.vertices))
    ready.publish("mesh", mesh_to_bytes(body, big_endian=True))
    assert what_counts(planned(ready)) == what_counts(before)


def test_the_newest_surface_is_planned_for_mesh_or_cloud(ready, body, rig):
    mesh_cost = planned(ready).cost
    ready.publish_cloud(PointCloud(body.vertices))
    cloud_cost = planned(ready).cost
    ready.publish_mesh(body)
    assert planned(ready).cost == mesh_cost != cloud_cost


# --- bad input ---------------------------------------------------------------------------------


def mesh(change):
    def bad(body, rig):
        vertices, triangles = body.vertices.copy(), body.triangles.copy()
        vertices, triangles = change(vertices, triangles)
        return "mesh", write_mesh(triangles, vertices)

    return bad


def with_nan(vertices, triangles):
    vertices[5, 1] = math.nan
    return vertices, triangles


def out_of_range(vertices, triangles):
    triangles[9, 2] = len(vertices)
    return vertices, triangles


def degenerate(vertices, triangles):
    triangles[9] = triangles[9, [0, 0, 1]]
    return vertices, triangles


def cloud(frame_id="world", **change):
    def bad(body, rig):
        message = message_to_ros(PointCloud2, cloud_to_fields(PointCloud(body.vertices), frame_id))
        for name, value in change.items():
            setattr(message, name, value)
        return "cloud", message

    return bad


def poses(change):
    def bad(body, rig):
        message = message_to_ros(PoseArray, poses_to_fields(rig))
        change(message)
        return "camera_poses", message

    return bad


def no_poses(message):
    message.poses = []


def zero_quaternion(message):
    q = message.poses[3].orientation
    q.x = q.y = q.z = q.w = 0.0


def nan_position(message):
    message.poses[3].position.y = math.nan


def inside(message):
    p = message.poses[3].position
    p.x, p.y, p.z = 0.0, 0.0, 1.2


def in_millimetres(message):
    for pose in message.poses:
        p = pose.position
        p.x, p.y, p.z = 1000 * p.x, 1000 * p.y, 1000 * p.z


def rig_with(change):
    def bad(body, rig):
        message = message_to_ros(CameraRig, rig_to_fields(rig))
        change(message)
        return "rig", message

    return bad


def duplicate(message):
    message.cameras[1].name = message.cameras[0].name


def no_cameras(message):
    message.cameras = []


def bad_name(message):
    message.cameras[1].name = "left/right"


def bad_grid(message):
    message.grid_rows = 3


def wrong_frame(message):
    message.header.frame_id = "base_link"


BAD_INPUTS = {
    "a mesh of NaN": (
        mesh(lambda v, t: (np.nan * v, t)),
        r"NaN or infinity in \d+ of \d+ \(first: vertex 0\)",
    ),
    "no triangles": (mesh(lambda v, t: (v, t[:0])), "mesh: expected at least one triangle"),
    "indices out of range": (mesh(out_of_range), "mesh triangles: expected vertex indices from"),
    "millimetres": (mesh(lambda v, t: (1000 * v, t)), "surface is probably in millimetres"),
    "inverted normals": (mesh(lambda v, t: (v, t[:, ::-1])), "normals are probably inverted"),
    "half a mesh": (lambda body, _: ("mesh", mesh_to_bytes(body)[:-5]), "the message is truncated"),
    "an empty cloud": (
        cloud(width=0, row_step=0, data=b""),
        "cloud: expected at least 16 points, got an empty cloud",
    ),
    "a cloud in another frame": (cloud("lidar"), "'world' .*, got 'lidar'"),
    "a cloud without a frame": (cloud(""), "'world' .*, got ''"),
    "a cloud of integers": (cloud(fields=[]), "cloud fields: expected x, y and z"),
    "an empty cloud message": (lambda *_: ("cloud", PointCloud2()), "header.frame_id"),
    "no poses": (poses(no_poses), "rig: expected at least one camera, got none"),
    "a zero quaternion": (poses(zero_quaternion), "cam_003: orientation: .*never set"),
    "a pose with NaN": (poses(nan_position), "cam_003: position: expected finite coordinates"),
    "poses in another frame": (poses(wrong_frame), "'world' .*, got 'base_link'"),
    "poses in millimetres": (poses(in_millimetres), "camera poses are probably in millimetres"),
    "a camera inside the body": (poses(inside), r"1 of 32 inside it \(cam_003\)"),
    "no cameras": (rig_with(no_cameras), "rig: expected at least one camera, got none"),
    "duplicate names": (rig_with(duplicate), "unique camera names, got 'cam_0_00' 2 times"),
    "a bad name": (rig_with(bad_name), "camera name: expected letters.*'left/right'"),
    "a bad grid": (rig_with(bad_grid), r"rows × columns = 32"),
    "a rig in another frame": (rig_with(wrong_frame), "'world' .*, got 'base_link'"),
    "half a rig": (lambda *_: ("rig", b"\x00\x01\x00\x00\x07"), "CameraRig message"),
}


@pytest.mark.parametrize("case", BAD_INPUTS)
def test_bad_input_is_told_once_and_the_last_good_one_is_planned_for(ready, body, rig, case):
    bad, reason = BAD_INPUTS[case]
    before = planned(ready)
    ready.publish(*bad(body, rig))
    message = refused(ready)
    assert re.search(reason, message), message
    assert "stays in force: call again" in message
    # Nothing was published in place of the last good plan.
    assert ready.latched_plan().plan_id == before.plan_id
    assert what_counts(planned(ready)) == what_counts(before)


@pytest.mark.parametrize(
    ("damage", "telling"),
    [
        (with_nan, r"left out: \d of 27,420 triangles, with corners that are not finite"),
        (degenerate, r"left out: 1 of 27,420 triangles, which have no area"),
    ],
    ids=["NaN", "degenerate"],
)
def test_a_mesh_is_planned_for_without_its_bad_triangles(ready, body, rig, damage, telling):
    try:
        ready.publish(*mesh(damage)(body, rig))
        (note,) = planned(ready).notes
        assert note.code == "left_out"
        assert re.match(telling, note.text), note.text
    finally:
        ready.publish_mesh(body)


@pytest.mark.parametrize(
    ("request_", "reason"),
    [
        (
            {"method": "guess"},
            "method: expected one of closest, average, em, greedy, k_view.*, got 'guess'",
        ),
        ({"k": 4}, "k: expected 2 or 3, got 4"),
        ({"scope": "some"}, "scope: expected one of all, assigned, got 'some'"),
        ({"time_budget": -1.0}, "time_budget: expected a number of at least 0, got -1"),
        ({"time_budget": math.nan}, "time_budget: expected a number of at least 0, got nan"),
        ({"bound": "some"}, "bound: expected one of none, quick, tight, got 'some'"),
        ({"gap": -0.5}, "gap: expected a number of at least 0, got -0.5"),
        ({"gap": 1e300}, r"gap: expected at most 1, the whole cost, got 1e\+300"),
    ],
)
def test_a_bad_request_is_told(ready, request_, reason):
    before = planned(ready)
    assert re.search(reason, refused(ready, **request_))
    assert what_counts(planned(ready)) == what_counts(before)


def test_more_cameras_at_once_than_there_are_are_all_of_them(ready, body, rig):
    few = Rig(rig.cameras[:2])
    ready.publish_rig(few)
    for k in (2, 3):
        plan = planned(ready, method="k_view", k=k)
        assert plan.cost == of_the_core(body, few)[0]


def test_malformed_bytes_do_not_end_the_node(ready, body):
    before = planned(ready)
    payload = mesh_to_bytes(body)
    random = np.random.default_rng(4)
    for length in (4, 7, 8, 9, 1000, len(payload) - 1):
        ready.publish("mesh", payload[:length])
    for topic in ("mesh", "cloud", "camera_poses", "rig"):
        for size in (4, 40, 400):
            ready.publish(topic, random.bytes(size))
            ready.publish(topic, b"\x00\x01\x00\x00" + random.bytes(size))
    assert "refused" in refused(ready)
    assert what_counts(planned(ready)) == what_counts(before)


def test_without_input_every_call_says_what_is_missing(start_planner, body, rig):
    planner = start_planner("-p", "method:=em", "-p", "samples:=200")
    with PlannerClient(planner.name) as client:
        for _ in range(2):
            message = client.plan().message
            assert "surface: expected a mesh on ~/mesh or a cloud on ~/cloud, got none" in message
            assert "rig: expected poses on ~/camera_poses or a rig on ~/rig, got none" in message
        client.publish_rig(rig)
        client.publish("mesh", b"\x00\x01\x00\x00")
        for _ in range(2):
            assert "got none that can be used: the surface received on" in client.plan().message
        client.publish_mesh(body)
        plan = client.plan().plan
        assert (plan.method, plan.samples) == ("em", 200)


# --- many callers, parameters, long plans ------------------------------------------------------


def test_many_callers_at_once_are_all_answered_alike(ready, planner):
    wanted = planned(ready, method="em")
    answers = []

    def call():
        with PlannerClient(planner.name) as another:
            calls = [another.plan_async(method="em", samples=SAMPLES) for _ in range(5)]
            answers.extend(another.wait_for(call) for call in calls)

    with having(ready, service_max_wait=float(PATIENCE)):
        callers = [threading.Thread(target=call) for _ in range(6)]
        for caller in callers:
            caller.start()
        for caller in callers:
            caller.join()
    assert len(answers) == 30
    assert all(answer.success for answer in answers)
    assert all(what_counts(answer.plan) == what_counts(wanted) for answer in answers)
    assert len({answer.plan.plan_id for answer in answers}) == 30


def test_a_burst_of_one_caller_is_answered_whole(ready):
    with having(ready, service_max_wait=float(PATIENCE)):
        calls = [ready.plan_async(method="closest", samples=100) for _ in range(50)]
        assert all(ready.wait_for(call).success for call in calls)


def test_a_bad_parameter_is_refused_with_the_reason(ready):
    results = ready.set_parameters(method="guess", frame_id="base", k=9, samples=-1)
    assert not any(result.successful for result in results)
    assert "method: expected one of" in results[0].reason
    assert "read-only" in results[1].reason
    assert "Max: 3" in results[2].reason
    assert "out of range" in results[3].reason


def test_a_changed_lens_applies_to_poses_at_the_next_call(ready, body, rig):
    ready.publish_poses(rig)
    sharper = planned(ready)
    assert ready.set_parameters(lens__hyperfocal_distance=40.0)[0].successful
    plan = planned(ready)
    assert ready.set_parameters(lens__hyperfocal_distance=10.0)[0].successful
    other = Rig(
        tuple(
            Camera(f"cam_{i:03d}", c.position, c.orientation, lens=Lens(0.05, 40.0))
            for i, c in enumerate(rig.cameras)
        )
    )
    assert (plan.cost, plan_from_message(plan).cameras) == of_the_core(body, other)
    assert what_counts(planned(ready)) == what_counts(sharper)


def test_the_node_answers_while_it_plans(ready, body):
    ready.publish_rig(cylinder_rig())
    with having(ready, service_max_wait=float(PATIENCE)):
        long = planning(ready)
        for seed in range(5):
            assert ready.set_parameters(seed=seed)[0].successful
        ready.publish_mesh(body)
        next_ = ready.plan_async(method="closest", samples=100)
        assert not next_.done()
        assert cancelled(long).cost > 0
        assert ready.wait_for(next_).success
    assert ready.set_parameters(seed=0)[0].successful


def test_a_time_budget_is_told(ready):
    response = ready.plan(method="em", samples=SAMPLES, time_budget=1e-6)
    assert response.success
    assert "ended before it converged" in response.message
    assert not response.plan.converged
    response = ready.plan(method="em", samples=SAMPLES)
    assert "converged" not in response.message
    assert response.plan.converged


def test_how_near_the_best_a_plan_is_is_told(ready):
    none = ready.plan(samples=SAMPLES, bound="none")
    assert math.isnan(none.plan.lower_bound)
    assert "of the best" not in none.message
    bounds = []
    for request in ({}, {"bound": "tight"}, {"method": "optimal", "gap": 1e-4}):
        response = ready.plan(samples=SAMPLES, **request)
        plan = plan_from_message(response.plan)
        within = float(re.search(r"within ([\d.e-]+) % of the best", response.message)[1])
        assert within == pytest.approx(100 * plan.gap, rel=0.1)
        bounds.append(plan.lower_bound)
    assert plan.gap <= 1e-4 + 1e-9
    assert bounds[0] <= bounds[1] <= plan.cost


def test_a_warm_start_is_from_the_last_plan(ready, body, rig):
    scene, (first, second) = Scene(body), (PlanRequest("em", SAMPLES, seed=s) for s in (5, 6))
    cold = plan_focus(scene, rig, second)
    warm = plan_focus(scene, rig, second, warm_start=plan_focus(scene, rig, first).warm_start)
    assert cold.cameras != warm.cameras
    assert ready.set_parameters(warm_start=True)[0].successful
    try:
        planned(ready, method="em", seed=5)
        plan = plan_from_message(planned(ready, method="em", seed=6))
    finally:
        assert ready.set_parameters(warm_start=False)[0].successful
    assert (plan.cost, plan.cameras) == (warm.cost, warm.cameras)
    assert plan_from_message(planned(ready, method="em", seed=6)).cameras == cold.cameras


def test_shots_and_lens_lists_may_be_parameters(ready, body, rig):
    ready.publish_poses(rig)
    parameters = {"shots": 2, "depth_tolerance": 0.001, "lens__focus_distances": [0.7, 0.9, 1.2]}
    assert all(result.successful for result in ready.set_parameters(**parameters))
    try:
        plan = planned(ready)
    finally:
        undo = {"shots": 1, "depth_tolerance": 0.0, "lens__focus_distances": [0.0]}
        assert all(result.successful for result in ready.set_parameters(**undo))
    assert (plan.shots, plan.depth_tolerance) == (2, 0.001)
    assert {s for focus in plan.cameras for s in focus.bracket} <= {0.7, 0.9, 1.2}


def test_distortion_binning_and_region_are_honoured(ready, body, rig):
    before = planned(ready)
    fisheye = {"distortion_model": "equidistant", "distortion": (0.0,) * 4}
    intrinsics = replace(
        rig.cameras[0].intrinsics, **fisheye, binning=(2, 2), region=(0, 0, 300, 870)
    )
    mixed = replace(
        rig,
        cameras=tuple(
            replace(c, intrinsics=intrinsics) if i % 2 else c for i, c in enumerate(rig.cameras)
        ),
    )
    ready.publish_rig(mixed)
    plan = plan_from_message(planned(ready))
    assert (plan.cost, plan.cameras) == of_the_core(body, mixed)
    assert plan.cost != before.cost


def test_distortion_of_an_unknown_model_is_refused(ready, rig):
    message = message_to_ros(CameraRig, rig_to_fields(rig))
    message.cameras[4].camera_info.d = [0.1, 0.0]
    message.cameras[4].camera_info.distortion_model = "of this maker"
    ready.publish("rig", message)
    response = ready.plan(samples=SAMPLES)
    assert not response.success
    assert "camera cam_0_04: image.distortion_model: expected one of plumb_bob" in response.message
    assert planned(ready).cost > 0


def test_the_log_holds_no_traceback(ready, planner):
    planned(ready)
    assert "Traceback" not in planner.log
