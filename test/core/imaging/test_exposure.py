# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

from contextlib import nullcontext
from dataclasses import replace

import cv2
import numpy as np
import pytest
from numba import set_num_threads

from focus_planner import Camera, CameraIntrinsics, Lens, Mesh, PointCloud, Scene
from focus_planner.core import kernels
from focus_planner.core.imaging.aims import aims, sets_of_aims
from focus_planner.core.imaging.blur import blur_diameters
from focus_planner.core.imaging.exposure import BACKGROUND, PictureCamera
from focus_planner.core.rig.optics import aperture_diameter, hyperfocal_distance
from focus_planner.core.surface.appearance import Texture, decode, encode

CIRCLE = 20e-6
LENS = Lens(0.05, hyperfocal_distance(0.05, 2.0, CIRCLE), circle_of_confusion=CIRCLE)
NOWHERE = decode(np.array(BACKGROUND, np.uint8))[0]


def camera_of(width, height, focal, **values):
    intrinsics = CameraIntrinsics(
        width, height, focal, focal, (width - 1) / 2, (height - 1) / 2, **values
    )
    return Camera("cam", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), intrinsics, LENS)


def quads(corners, colours=None):
    """Return a mesh of (n, 4, 3) squares, of one colour each, that face the camera."""
    corners = np.asarray(corners, dtype=np.float64).reshape(-1, 4, 3)
    first = 4 * np.arange(len(corners))[:, None]
    triangles = np.concatenate([first + [0, 2, 1], first + [0, 3, 2]])
    colours = np.zeros((len(corners), 3)) if colours is None else colours
    colours = np.repeat(np.asarray(colours, np.uint8), 4, axis=0)
    return Mesh(corners.reshape(-1, 3), triangles, vertex_colours=colours)


def rectangle(camera, depth, left, top, right, bottom):
    """Return the corners, at a depth, of what a pinhole images between these pixels."""
    image = camera.intrinsics
    u, v = np.array([left, right, right, left]), np.array([top, top, bottom, bottom])
    x, y = (u - image.cx) / image.fx, (v - image.cy) / image.fy
    return depth * np.column_stack([x, y, np.ones(4)])


def covered(exposure):
    """Return how much of each pixel a black surface covers."""
    return 1 - exposure[..., 0] / NOWHERE


@pytest.mark.parametrize("count", [8, 12, 40, 512])
def test_rays_have_the_moments_of_a_disc_and_of_a_pixel(count):
    rays = aims(count)
    np.testing.assert_allclose(rays.mean(axis=0), 0, atol=1e-12)
    np.testing.assert_allclose(
        rays.T @ rays / count, np.diag([1 / 16, 1 / 16, 1 / 12, 1 / 12]), atol=1e-12
    )
    assert np.hypot(*rays[:, :2].T).max() < 0.62


def test_sets_of_rays_follow_one_another():
    rays, starts = sets_of_aims()
    assert starts[0] == 0
    assert starts[-1] == len(rays)
    assert (np.diff(starts, 2) > 0).all()


@pytest.mark.parametrize("binning", [1, 2])
def test_blur_of_a_step_of_planes_agrees_with_the_formula(binning):
    depths, s = np.array([0.7, 0.85, 1.0, 1.15, 1.5, 3.0, 10.0]), 1.0
    tile = kernels.TILE * binning  # whose pixels have the same rays
    band = 3 * tile
    camera = camera_of(120, band * len(depths), 600.0)
    # The edges are slanted, by a pixel in the rows that are measured: so they fall on all parts of
    # a pixel.
    slope = binning / tile
    steps = []
    for i, depth in enumerate(depths):
        corners = rectangle(camera, depth, -60, band * i - 0.5, 60, band * (i + 1) - 0.5)
        corners[2, 0] += depth * slope * band / 600
        steps.append(corners)
    camera = replace(camera, intrinsics=replace(camera.intrinsics, binning=(binning, binning)))
    spread = covered(PictureCamera(Scene(quads(steps))).exposure(camera, s))
    for i, diameter in enumerate(blur_diameters(depths, camera, s)):
        rows = np.arange(band * i + tile, band * i + 2 * tile, binning) // binning
        falls = -np.diff(spread[rows], axis=1)
        np.testing.assert_allclose(falls.sum(axis=1), 1, atol=1e-6)
        # Between pixels, in pixels of the full resolution.
        places = binning * np.arange(1, falls.shape[1] + 1) - 0.5
        edge = 60 + slope * (binning * (rows + 0.5) - band * i)
        away = (places - edge[:, None]) / binning
        assert (falls * away).sum(axis=1).mean() == pytest.approx(0, abs=0.02)
        # Without the pixel's own variance, and that of the differences between pixels.
        variance = (falls * away**2).sum(axis=1).mean() - 2 / 12
        if diameter:
            assert 4 * np.sqrt(variance) == pytest.approx(diameter, abs=0.05)
        else:
            assert abs(variance) < 0.003
    assert blur_diameters(depths, camera, s).max() > 5 / binning


def test_at_depth_edges_the_near_covers_the_far_and_lets_it_shine_through_its_rim():
    camera = camera_of(40, 24, 150.0)
    near = rectangle(camera, 0.5, -40, -40, 17, 60)
    far = rectangle(camera, 2.0, -40, -40, 29, 60)
    white = [[255, 255, 255]]
    scene = Scene(quads([near, far], [[0, 0, 0], *white]))
    picture = PictureCamera(scene).exposure(camera, 1.0)
    alone = PictureCamera(Scene(quads([far], white))).exposure(camera, 1.0)
    lit = alone[:, :10, 0].mean()  # nearly the same all over
    expected = by_rays(scene, camera, 1.0, lit)
    off = picture[..., 0] - expected
    assert np.abs(off).max() < 0.12 * lit
    assert np.abs(off[6:18].mean(axis=0)).mean() < 0.015 * lit
    rim = (picture[12, 8:28, 0] > 0.05 * lit) & (picture[12, 8:28, 0] < 0.95 * lit)
    assert rim.sum() >= 3


def by_rays(scene, camera, s, lit):
    """Return the picture of a black surface, before 1 m, and a lit one, by casting many rays."""
    random = np.random.default_rng(0)
    intrinsics, count = camera.intrinsics, 4000
    v, u = np.mgrid[: intrinsics.height, : intrinsics.width]
    expected = np.empty(u.shape)
    angle, radius = 2 * np.pi * random.random(count), np.sqrt(random.random(count)) / 2
    lens = np.stack([radius * np.cos(angle), radius * np.sin(angle), np.zeros(count)], axis=1)
    lens *= aperture_diameter(camera)
    for pixel in np.ndindex(u.shape):
        across, down = u[pixel] + random.random(count) - 0.5, v[pixel] + random.random(count) - 0.5
        x, y = (across - intrinsics.cx) / intrinsics.fx, (down - intrinsics.cy) / intrinsics.fy
        focused = s * np.stack([x, y, np.ones(count)], axis=1)
        depth, _ = scene.first_hits(lens, (focused - lens) / s)
        expected[pixel] = np.where(np.isinf(depth), NOWHERE, np.where(depth < 1, 0, lit)).mean()
    return expected


@pytest.mark.parametrize("s", [1.0, 3.0])
def test_points_are_imaged_where_opencv_images_them(s):
    k = (-0.25, 0.06, 2e-3, -1e-3)
    camera = camera_of(160, 120, 130.0, distortion_model="plumb_bob", distortion=k)
    intrinsics = camera.intrinsics
    u, v = (axis.ravel() for axis in np.meshgrid([25.3, 80.1, 134.4], [18.7, 60.0, 99.2]))
    depths = np.linspace(1.0, 2.0, len(u))
    places = [
        rectangle(camera, d, x - 2, y - 2, x + 2, y + 2)
        for d, x, y in zip(depths, u, v, strict=True)
    ]
    matrix = np.array(
        [[intrinsics.fx, 0, intrinsics.cx], [0, intrinsics.fy, intrinsics.cy], [0, 0, 1]]
    )
    points = np.mean(places, axis=1)[:, None]
    imaged, _ = cv2.projectPoints(points, np.zeros(3), np.zeros(3), matrix, np.array(k))
    lens = replace(LENS, hyperfocal_distance=LENS.hyperfocal_distance / 2)
    spread = covered(PictureCamera(Scene(quads(places))).exposure(replace(camera, lens=lens), s))
    rows, columns = np.indices(spread.shape)
    for x, y in imaged[:, 0]:
        near = spread * (np.hypot(columns - x, rows - y) < 12)
        # A single edge is off by up to half a ray's share of a pixel.
        assert (near * columns).sum() / near.sum() == pytest.approx(x, abs=0.15)
        assert (near * rows).sum() / near.sum() == pytest.approx(y, abs=0.15)


def test_the_first_row_of_a_texture_is_at_its_top():
    colours = np.array([[[255, 0, 0], [0, 255, 0]], [[0, 0, 255], [255, 255, 255]]], np.uint8)
    image = colours.repeat(32, axis=0).repeat(32, axis=1)
    camera = camera_of(80, 80, 100.0)
    mesh = quads([rectangle(camera, 1.0, 8, 8, 72, 72)])
    # Corners: top left, top right, bottom right, bottom left; v is from the bottom.
    uv = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], np.float32)
    coordinates = uv[mesh.triangles % 4]
    mesh = replace(mesh, vertex_colours=None, texture=Texture(image, coordinates))
    picture = PictureCamera(Scene(mesh)).picture(camera, 1.0)
    seen = picture[[24, 24, 56, 56], [24, 56, 24, 56]] > 100
    assert seen.tolist() == [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]]


def test_a_texture_that_is_too_fine_to_see_is_averaged():
    checks = np.indices((256, 256)).sum(axis=0) % 2 * 255
    image = np.repeat(checks[..., None], 3, axis=2).astype(np.uint8)
    camera = camera_of(40, 40, 100.0)
    mesh = quads([rectangle(camera, 1.0, 4, 4, 36, 36)])
    uv = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], np.float32)
    fine = replace(mesh, texture=Texture(image, uv[mesh.triangles % 4]))
    grey = replace(mesh, vertex_colours=np.full((4, 3), 188, np.uint8))  # half of the light
    shown = [
        PictureCamera(Scene(each)).exposure(camera, 1.0)[10:30, 10:30] for each in (fine, grey)
    ]
    np.testing.assert_allclose(*shown, rtol=0.03)


def test_vertex_colours_are_interpolated_in_linear_light():
    camera = camera_of(60, 60, 100.0)
    mesh = quads([rectangle(camera, 1.0, -5, -5, 65, 65)])
    colours = np.array([[255, 0, 0], [0, 0, 255], [0, 0, 255], [255, 0, 0]], np.uint8)
    shown = PictureCamera(Scene(replace(mesh, vertex_colours=colours))).exposure(camera, 1.0)
    share = shown[30, :, 2] / shown[30].sum(axis=1)
    np.testing.assert_allclose(share[5:55], ((np.arange(60) + 5) / 70)[5:55], atol=0.02)
    assert shown[..., 1].max() < 1e-6


def test_a_clouds_colours_are_its_points():
    random = np.random.default_rng(1)
    directions = random.standard_normal((3000, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    colours = np.where(directions[:, :1] > 0, [[255, 0, 0]], [[0, 255, 0]]).astype(np.uint8)
    cloud = PointCloud(directions + [0, 0, 3], directions, colours=colours)
    shown = PictureCamera(Scene(cloud)).picture(camera_of(60, 60, 60.0), 2.0)
    assert (shown[30, 38:44].argmax(axis=1) == 0).all()
    assert (shown[30, 16:22].argmax(axis=1) == 1).all()


def test_where_nothing_is_the_background_shows():
    camera = camera_of(30, 20, 100.0)
    behind = quads([rectangle(camera, -1.0, 0, 0, 30, 20)])
    assert (PictureCamera(Scene(behind)).picture(camera, 1.0) == BACKGROUND).all()


def test_a_picture_is_the_same_whatever_the_number_of_threads(monkeypatch):
    random = np.random.default_rng(3)
    points = random.uniform(-1, 1, (60, 1, 3)) + 0.4 * random.standard_normal((60, 3, 3))
    scene = Scene(Mesh((points + [0, 0, 3]).reshape(-1, 3), np.arange(180).reshape(-1, 3)))
    view, camera = PictureCamera(scene), camera_of(300, 300, 250.0)
    picture, depths = view.exposure(camera, 2.0), view.depths(camera)
    assert np.isfinite(depths).mean() > 0.3
    monkeypatch.setattr(kernels, "threads_for", lambda _: nullcontext(set_num_threads(1)))
    np.testing.assert_array_equal(view.exposure(camera, 2.0), picture)
    np.testing.assert_array_equal(view.depths(camera), depths)


def test_colours_survive_linear_light():
    every = np.arange(256, dtype=np.uint8)
    np.testing.assert_array_equal(encode(decode(every)), every)


def test_every_kind_of_surface_and_camera_is_drawn_by_the_same_machine_code():
    camera = camera_of(40, 40, 100.0)
    mesh = quads([rectangle(camera, 1.0, 4, 4, 36, 36)])
    uv = np.zeros((len(mesh.triangles), 3, 2), np.float32)
    points = np.random.default_rng(0).uniform(-0.2, 0.2, (300, 3)) * [1, 1, 0] + [0, 0, 1]
    normals = np.broadcast_to([0.0, 0.0, -1.0], points.shape)
    barrel = replace(
        camera.intrinsics, distortion_model="plumb_bob", distortion=(-0.1, 0.0, 0.0, 0.0)
    )

    def compiled():
        drawn = kernels.expose, kernels.depths, kernels.bound_triangles, kernels.light_corners
        return [kernel.signatures for kernel in drawn]

    first = None
    for surface in (
        mesh,
        replace(mesh, vertex_colours=None),
        replace(mesh, texture=Texture(np.zeros((4, 4, 3), np.uint8), uv)),
        PointCloud(points, normals),
    ):
        view = PictureCamera(Scene(surface))
        for seen_by in (camera, replace(camera, intrinsics=barrel)):
            view.picture(seen_by, 1.0)
            view.depths(seen_by)
            first = first or compiled()
            assert compiled() == first
