"""What markers show, of scenes that can be worked out by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rclpy.serialization import deserialize_message
from visualization_msgs.msg import Marker, MarkerArray

from focus_planner import CameraIntrinsics, Lens, PlanRequest, Rig
from focus_planner.core.planning.plan import CameraStatus
from focus_planner.core.planning.plan_focus import plan_focus
from focus_planner.core.surface.scene import Scene
from focus_planner.messages.markers import markers_to_fields
from focus_planner.messages.typestore import MARKERS, serialize
from testing.problems import forward, plane

STAMP = (7, 8)
GREEN, ORANGE, GREY = (0.0, 0.62, 0.45), (0.90, 0.38, 0.0), (0.55, 0.55, 0.58)
SQUARE = CameraIntrinsics(
    100, 100, 100.0, 100.0, 49.5, 49.5
)  # half as wide as it is far, to each side
# In focus at 1 m: 0.9 m to 1.1 m, or so.
LENS = Lens(focal_length=0.05, hyperfocal_distance=10.0)


def planned(surface, *cameras, distances=None):
    """A plan for these cameras, or one that has them at these distances instead."""
    rig = Rig(cameras, "stage")
    plan = plan_focus(Scene(surface), rig, PlanRequest("closest", 400, fresh_samples=400))
    if distances is not None:
        foci = tuple(
            replace(
                camera,
                focus_distance=distance,
                shots=(replace(camera.shots[0], focus_distance=distance),),
            )
            for camera, distance in zip(plan.cameras, distances, strict=True)
        )
        plan = replace(plan, cameras=foci)
    return plan, rig


def markers(plan, rig):
    """What ROS reads of them."""
    payload = serialize(MARKERS, markers_to_fields(plan, rig, STAMP))
    return deserialize_message(payload, MarkerArray).markers


def points(marker):
    return np.array([(p.x, p.y, p.z) for p in marker.points])


def colour(said):
    assert said.a == 1.0
    return tuple(round(float(v), 4) for v in (said.r, said.g, said.b))


def test_there_is_a_marker_for_the_surface_and_one_for_each_camera():
    cameras = (forward("a", intrinsics=SQUARE), forward("b", (9.0, 0.0, 0.0), intrinsics=SQUARE))
    found = markers(*planned(plane(0.5, 0.5, 1.0), *cameras))
    assert [(m.ns, m.id, m.type) for m in found] == [
        ("surface", 0, Marker.POINTS),
        ("cameras", 0, Marker.LINE_LIST),
        ("cameras", 1, Marker.LINE_LIST),
    ]
    for marker in found:
        assert marker.header.frame_id == "stage"
        assert (marker.header.stamp.sec, marker.header.stamp.nanosec) == STAMP
        assert marker.action == Marker.ADD
        assert marker.pose.orientation.w == 1.0
        assert 0.0 < marker.scale.x < 0.02
        assert (marker.lifetime.sec, marker.lifetime.nanosec) == (0, 0)


@pytest.mark.parametrize(
    ("distance", "expected"), [(1.0, GREEN), (1.02, GREEN), (0.5, ORANGE), (3.0, ORANGE)]
)
def test_a_plane_before_a_camera_is_green_only_where_it_is_focused(distance, expected):
    camera = forward(intrinsics=SQUARE, lens=LENS)
    surface, *_ = markers(*planned(plane(0.5, 0.5, 1.0), camera, distances=[distance]))
    assert {colour(each) for each in surface.colors} == {expected}


def test_what_no_camera_sees_is_grey_and_what_is_too_far_is_orange():
    # The image ends at x = 0.5 at a depth of 1: of the plane from -1 to 1 it shows the middle.
    plan, rig = planned(
        plane(2.0, 0.5, 1.0), forward(intrinsics=SQUARE, lens=LENS), distances=[1.0]
    )
    surface, *_ = markers(plan, rig)
    samples = points(surface)
    np.testing.assert_array_equal(samples, plan.fresh_problem.samples.points)
    seen = np.abs(samples[:, 0]) < 0.5
    assert 0 < seen.sum() < len(seen)
    assert [colour(each) for each in surface.colors] == [GREEN if s else GREY for s in seen]


def test_a_point_is_green_if_it_is_in_focus_in_the_camera_that_images_it_best():
    # Each camera sees its own half: one of them is focused on it.
    surface = plane(2.0, 0.2, 1.0)
    cameras = [
        forward(n, (x, 0.0, 0.0), intrinsics=SQUARE, lens=LENS)
        for n, x in [("a", -0.5), ("b", 0.5)]
    ]
    found, *_ = markers(*planned(surface, *cameras, distances=[1.0, 0.6]))
    left = points(found)[:, 0] < 0
    assert 0 < left.sum() < len(left)
    assert [colour(each) for each in found.colors] == [GREEN if x else ORANGE for x in left]


def test_a_camera_is_a_pyramid_to_the_plane_that_it_is_focused_at():
    camera = forward("a", (1.0, 2.0, 3.0), intrinsics=SQUARE, lens=LENS)
    _, marker = markers(*planned(plane(9.0, 9.0, 4.0), camera, distances=[2.0]))
    corners = [(0.0, 1.0), (2.0, 1.0), (2.0, 3.0), (0.0, 3.0)]
    corners = [(x, y, 5.0) for x, y in corners]
    ends = points(marker).reshape(-1, 2, 3).round(12)
    edges = {frozenset(map(tuple, edge)) for edge in ends.tolist()}
    assert len(edges) == len(ends) == 8
    apex = (1.0, 2.0, 3.0)
    around = zip(corners, corners[1:] + corners[:1], strict=True)
    assert edges == {frozenset((apex, c)) for c in corners} | {frozenset(e) for e in around}


def test_a_camera_that_images_nothing_best_is_grey():
    cameras = (
        forward("a", intrinsics=SQUARE),
        forward("away", (50.0, 0.0, 0.0), intrinsics=SQUARE),
    )
    plan, rig = planned(plane(0.5, 0.5, 1.0), *cameras)
    assert [c.status for c in plan.cameras] == [CameraStatus.PLANNED, CameraStatus.SEES_NOTHING]
    used, unused = (colour(marker.color) for marker in markers(plan, rig)[1:])
    assert used != unused
    assert max(unused) - min(unused) < 0.05
