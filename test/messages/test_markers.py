# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What markers show, of scenes that can be worked out by hand, and what viewers ask of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rclpy.serialization import deserialize_message
from scipy.spatial.transform import Rotation
from visualization_msgs.msg import MarkerArray

from focus_planner import CameraIntrinsics, Lens, PlanRequest, Rig, cylinder_rig
from focus_planner.core.planning.plan import CameraStatus
from focus_planner.core.planning.plan_focus import plan_focus
from focus_planner.core.planning.sampled_quality import sampled_quality
from focus_planner.core.surface.scene import Scene
from focus_planner.messages.markers import MAX_NAMES, markers_to_bytes
from focus_planner.messages.typestore import MARKERS, deserialize, fields_of, serialize
from testing.problems import around, forward, plane, sphere
from testing.visuals import (
    DELETE_ALL,
    LINE_LIST,
    TEXT,
    TRIANGLE_LIST,
    check_markers,
    colours_of,
    points_of,
    shown,
)

STAMP = (7, 8)
SHARP, BLURRED = (0x2C, 0x6F, 0xB5), (0xF4, 0xB4, 0x5C)
# Sees half as far to each side as it is away.
SQUARE = CameraIntrinsics(100, 100, 100.0, 100.0, 49.5, 49.5)
# In focus at 1 m: 0.9 m to 1.1 m, or so.
LENS = Lens(focal_length=0.05, hyperfocal_distance=10.0)
A = forward("a", intrinsics=SQUARE, lens=LENS)
AWAY = forward("away", (50.0, 0.0, 0.0), intrinsics=SQUARE, lens=LENS)


def planned(surface, *cameras, shots=1, images=0):
    rig = Rig(cameras, "stage")
    request = PlanRequest("em", 400, fresh_samples=400, shots=shots, images=images)
    return plan_focus(Scene(surface), rig, request), rig


def payload_of(plan, rig):
    quality = sampled_quality(plan.fresh_problem, plan.focus_distances)
    return markers_to_bytes(plan, rig, quality, STAMP)


def markers_of(plan, rig):
    """What ROS reads of them, checked as RViz does."""
    markers = deserialize_message(payload_of(plan, rig), MarkerArray).markers
    check_markers(markers, rig.frame_id, STAMP)
    return markers


def by_namespace(markers):
    return {marker.ns: marker for marker in markers if marker.ns != "names"}


def edges_of(marker):
    """The lines of a marker as a set of unordered pairs of points."""
    ends = points_of(marker).reshape(-1, 2, 3).round(9)
    edges = {frozenset(map(tuple, edge)) for edge in ends.tolist()}
    assert len(edges) == len(ends)
    return edges


def pyramid(apex, corners):
    around_it = zip(corners, corners[1:] + corners[:1], strict=True)
    return {frozenset((apex, c)) for c in corners} | {frozenset(e) for e in around_it}


def colour_of(red_green_blue):
    return pytest.approx([each / 255 for each in red_green_blue])


# --- what viewers ask for ------------------------------------------------------------------------


def test_all_cameras_are_in_a_few_markers():
    rig = cylinder_rig(rows=2, columns=130, bottom=0.8, top=3.0)
    scene = Scene(sphere(0.4, (0.0, 0.0, 0.9)))
    plan = plan_focus(scene, rig, PlanRequest("closest", 600, fresh_samples=300))
    assert len(rig) > MAX_NAMES
    found = [(marker.ns, marker.id, marker.type) for marker in markers_of(plan, rig)]
    assert found == [
        ("", 0, 0),
        ("chosen_cameras", 0, LINE_LIST),
        ("other_cameras", 0, LINE_LIST),
        ("frusta", 0, LINE_LIST),
        ("focal_planes", 0, TRIANGLE_LIST),
        ("depth_of_field", 0, TRIANGLE_LIST),
    ]
    assert len(payload_of(plan, rig)) < 2500 * len(rig)


def test_the_bytes_are_those_that_a_library_writes():
    payload = payload_of(*planned(plane(0.5, 0.5, 1.0), A, AWAY))
    assert serialize(MARKERS, fields_of(deserialize(MARKERS, payload))) == payload


def test_nothing_is_left_of_a_larger_rig():
    surface = plane(0.5, 0.5, 1.0)
    large, small = (markers_of(*planned(surface, *cameras)) for cameras in ((A, AWAY), (A,)))
    assert ("other_cameras", 0) in shown(large)
    assert ("names", 1) in shown(large)
    assert shown([*large, *small]).keys() == shown(small).keys()
    assert ("other_cameras", 0) not in shown(small)
    assert (small[0].action, small[0].ns) == (DELETE_ALL, "")


@pytest.mark.parametrize("shots", [1, 2, 3])
def test_every_marker_is_valid_whatever_the_rig(shots):
    wide = CameraIntrinsics(
        640, 480, 250.0, 250.0, 319.5, 239.5, "equidistant", (0.05, 0.01, 0.0, 0.0)
    )
    rig = around(7, 1.6, intrinsics=wide, lens=Lens(0.004, 0.8))
    plan, rig = planned(sphere(0.5), *rig.cameras, AWAY, shots=shots)
    assert np.isinf([shot.far_limit for c in plan.cameras for shot in c.shots]).any()
    markers_of(plan, rig)


def test_cameras_without_a_picture_are_grey_and_show_none():
    rig = around(7, 1.6)
    plan, rig = planned(sphere(0.5), *rig.cameras, AWAY, shots=2, images=5)
    idle = [camera.name for camera in plan.cameras if not camera.shots]
    assert 3 <= len(idle) < 8
    markers = markers_of(plan, rig)
    names = [marker.text for marker in markers if marker.ns == "names"]
    assert {name for name in names if "\n" not in name} >= set(idle)
    shown = by_namespace(markers)
    # Eight edges of a pyramid, two points each.
    assert len(shown["other_cameras"].points) == 16 * len(idle)
    assert len(shown["chosen_cameras"].points) == 16 * (8 - len(idle))
    assert len(shown["frusta"].points) == 16 * plan.pictures


def test_a_rig_that_sees_nothing_shows_its_cameras_only():
    plan, rig = planned(plane(0.5, 0.5, 1.0), A)
    nothing = replace(plan.cameras[0], status=CameraStatus.SEES_NOTHING, assigned_samples=0)
    shot = replace(nothing.shots[0], assigned_samples=0, in_focus_samples=0)
    plan = replace(plan, cameras=(replace(nothing, shots=(shot,)),))
    quality = sampled_quality(plan.fresh_problem, plan.focus_distances)
    quality = replace(quality, picture=np.full_like(quality.picture, -1))
    payload = markers_to_bytes(plan, rig, quality, STAMP)
    markers = deserialize_message(payload, MarkerArray).markers
    check_markers(markers, "stage", STAMP)
    assert [marker.ns for marker in markers] == ["", "other_cameras", "names"]
    assert markers[-1].text == "a"


# --- what they show ------------------------------------------------------------------------------


def test_chosen_cameras_are_small_pyramids_and_the_others_are_grey():
    plan, rig = planned(plane(0.5, 0.5, 1.0), A, AWAY)
    assert [c.status for c in plan.cameras] == [CameraStatus.PLANNED, CameraStatus.SEES_NOTHING]
    found = by_namespace(markers_of(plan, rig))
    length = 0.14 * plan.cameras[0].focus_distance
    half = length / 2
    corners = [(-half, -half), (half, -half), (half, half), (-half, half)]
    for name, x in (("chosen_cameras", 0.0), ("other_cameras", 50.0)):
        base = [tuple(np.round([x + u, v, length], 9).tolist()) for u, v in corners]
        assert edges_of(found[name]) == pyramid((x, 0.0, 0.0), base)
    assert not found["other_cameras"].colors
    grey = found["other_cameras"].color
    assert max(grey.r, grey.g, grey.b) - min(grey.r, grey.g, grey.b) < 0.05


def test_a_frustum_ends_in_the_plane_of_focus():
    camera = forward("a", (1.0, 2.0, 3.0), intrinsics=SQUARE, lens=LENS)
    plan, rig = planned(plane(9.0, 9.0, 4.0), camera)
    depth = plan.cameras[0].focus_distance
    half = depth / 2
    corners = [(-half, -half), (half, -half), (half, half), (-half, half)]
    base = [tuple(np.round([1.0 + u, 2.0 + v, 3.0 + depth], 9).tolist()) for u, v in corners]
    frusta = by_namespace(markers_of(plan, rig))["frusta"]
    assert edges_of(frusta) == pyramid((1.0, 2.0, 3.0), base)


def test_plane_and_slab_are_where_the_camera_images_the_surface_best():
    # The surface is a strip in the middle of the picture.
    plan, rig = planned(plane(0.6, 0.1, 1.0), A)
    (focus,) = plan.cameras
    found = by_namespace(markers_of(plan, rig))
    points = plan.fresh_problem.samples.points
    margin = 0.5 * np.sqrt(0.06 / 400)
    extent = [np.abs(points[:, axis]).max() + margin for axis in (0, 1)]
    for name, depths in (
        ("focal_planes", [focus.focus_distance]),
        ("depth_of_field", [focus.near_limit, focus.far_limit]),
    ):
        corners = points_of(found[name])
        assert sorted(set(corners[:, 2].round(9))) == pytest.approx(depths)
        for depth in depths:
            there = corners[np.isclose(corners[:, 2], depth)]
            flat = np.abs(there[:, :2]).max(axis=0) / depth
            np.testing.assert_allclose(flat, extent, rtol=2e-3)


def test_planes_and_slabs_are_turned_with_their_cameras():
    lens = Lens(0.085, 40.0)
    level = around(4, 2.2, intrinsics=SQUARE, lens=lens).cameras
    tilt = Rotation.from_rotvec([0.05, -0.08, 0.4])
    cameras = [
        replace(c, orientation=tuple((Rotation.from_quat(c.orientation) * tilt).as_quat()))
        for c in level
    ]
    plan, rig = planned(sphere(0.5), *cameras)
    quality = sampled_quality(plan.fresh_problem, plan.focus_distances)
    found = by_namespace(markers_of(plan, rig))
    planes = points_of(found["focal_planes"]).reshape(4, 6, 3)
    slabs = points_of(found["depth_of_field"]).reshape(4, 36, 3)
    for i, (focus, camera) in enumerate(zip(plan.cameras, cameras, strict=True)):
        turned = Rotation.from_quat(camera.orientation)
        plane_, slab, seen = (
            turned.inv().apply(points - np.array(camera.position))
            for points in (planes[i], slabs[i], quality.points[quality.picture == i])
        )
        np.testing.assert_allclose(plane_[:, 2], focus.focus_distance)
        depths = np.sort(slab[:, 2])[[0, -1]]
        np.testing.assert_allclose(depths, [focus.near_limit, focus.far_limit])
        # Cut to what is seen, and no wider than by the surface that a sample stands for.
        flat, low, high = (
            points[:, :2] / points[:, 2:] for points in (seen, plane_[[0]], plane_[[2]])
        )
        margin = 0.5 * quality.spacing / focus.focus_distance
        np.testing.assert_allclose(low[0], flat.min(axis=0) - margin)
        np.testing.assert_allclose(high[0], flat.max(axis=0) + margin)


def test_a_slab_is_closed():
    plan, rig = planned(plane(0.6, 0.1, 1.0), A)
    corners = points_of(by_namespace(markers_of(plan, rig))["depth_of_field"]).round(9)
    triangles = [tuple(map(tuple, each)) for each in corners.reshape(-1, 3, 3).tolist()]
    assert len(triangles) == 12
    edges = [frozenset((t[i], t[i - 1])) for t in triangles for i in range(3)]
    assert {edges.count(edge) for edge in edges} == {2}


def test_a_slab_without_an_end_is_drawn_to_twice_the_distance():
    camera = forward("a", intrinsics=SQUARE, lens=Lens(0.004, 0.5))
    plan, rig = planned(plane(0.5, 0.5, 1.0), camera)
    (focus,) = plan.cameras
    assert np.isinf(focus.far_limit)
    corners = points_of(by_namespace(markers_of(plan, rig))["depth_of_field"])
    assert corners[:, 2].max() == pytest.approx(2 * focus.focus_distance)


def test_colours_tell_how_much_of_its_part_each_camera_holds():
    plan, rig = planned(plane(0.5, 0.5, 1.0), A)
    found = by_namespace(markers_of(plan, rig))
    assert plan.cameras[0].in_focus_samples == plan.cameras[0].assigned_samples
    for name in ("chosen_cameras", "frusta", "focal_planes", "depth_of_field"):
        colours = colours_of(found[name])
        assert colours[0][:3].tolist() == colour_of(SHARP)
        assert (colours == colours[0]).all()
    (focus,) = plan.cameras
    half = focus.assigned_samples // 2
    shot = replace(focus.shots[0], in_focus_samples=half)
    blurred = replace(plan, cameras=(replace(focus, in_focus_samples=half, shots=(shot,)),))
    share = half / focus.assigned_samples
    mixed = share * np.array(SHARP) + (1 - share) * np.array(BLURRED)
    colours = colours_of(by_namespace(markers_of(blurred, rig))["chosen_cameras"])
    assert colours[0][:3].tolist() == colour_of(mixed)


def test_every_shot_that_is_taken_has_a_frustum_a_plane_and_a_slab():
    camera = forward("a", intrinsics=SQUARE, lens=LENS)
    near, far = plane(0.2, 0.2, 0.8), plane(2.0, 2.0, 1.6)
    surface = type(near)(
        np.concatenate([near.vertices, far.vertices]),
        np.concatenate([near.triangles, far.triangles + len(near.vertices)]),
    )
    plan, rig = planned(surface, camera, shots=2)
    (focus,) = plan.cameras
    assert all(shot.assigned_samples for shot in focus.shots)
    found = by_namespace(markers_of(plan, rig))
    assert len(found["chosen_cameras"].points) == 16
    assert len(found["frusta"].points) == 2 * 16
    assert len(found["focal_planes"].points) == 2 * 6
    assert len(found["depth_of_field"].points) == 2 * 36
    planes = sorted(set(points_of(found["focal_planes"])[:, 2].round(9)))
    assert planes == pytest.approx([shot.focus_distance for shot in focus.shots])


def test_names_are_behind_their_cameras_with_their_distances():
    plan, rig = planned(plane(0.5, 0.5, 1.0), A, AWAY)
    names = [marker for marker in markers_of(plan, rig) if marker.type == TEXT]
    assert [marker.id for marker in names] == [0, 1]
    assert names[0].text == f"a\n{plan.cameras[0].focus_distance:.3f} m"
    assert names[1].text == "away"
    assert names[0].pose.position.z < 0.0
    assert (names[1].pose.position.x, names[1].pose.position.y) == (50.0, 0.0)
