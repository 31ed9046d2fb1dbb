# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from focus_planner import PointCloud, Scene, cylinder_rig
from focus_planner.evaluation.measuring.wrong_geometry import (
    leaning,
    moved,
    noisy,
    smooth_noise,
    with_holes,
    with_position_error,
    with_rotation_error,
)
from testing.problems import sphere


def drawn(seed=0):
    return np.random.default_rng(seed)


def test_noise_is_standard_normal_everywhere_and_alike_nearby():
    points = np.array([[0, 0, 0], [0.013, 0.02, 0.037], [0.015, 0.02, 0.037], [0.2, 0.3, 0.1]])
    noise = np.array([smooth_noise(points, 0.05, drawn(seed)) for seed in range(3000)])
    assert noise.mean(axis=0) == pytest.approx(np.zeros(4), abs=0.08)
    assert noise.std(axis=0) == pytest.approx(np.ones(4), abs=0.05)
    correlation = np.corrcoef(noise.T)
    assert correlation[1, 2] > 0.98
    assert abs(correlation[1, 3]) < 0.08


def test_a_noisy_mesh_is_displaced_along_its_normals():
    ball = sphere(1.0, subdivisions=3)
    small, large = (noisy(Scene(ball), sigma, drawn()) for sigma in (0.001, 0.01))
    shift = large.vertices - ball.vertices
    outward = (shift * ball.vertices).sum(axis=1)
    along = np.abs(shift - outward[:, None] * ball.vertices).max(axis=1)
    assert (along <= 0.05 * np.abs(outward) + 1e-12).all()
    assert outward.std() == pytest.approx(0.01, rel=0.15)
    # Vertices at the same place stay together.
    assert len(np.unique(ball.vertices, axis=0)) == len(np.unique(large.vertices, axis=0))
    # The same pattern at any size.
    assert 10 * (small.vertices - ball.vertices) == pytest.approx(shift, abs=1e-12)


@pytest.mark.parametrize("with_normals", [True, False])
def test_a_noisy_cloud_is_displaced_along_its_normals(with_normals):
    points = sphere(1.0, subdivisions=4).vertices
    cloud = PointCloud(points, points if with_normals else None)
    shifted = noisy(Scene(cloud), 0.01, drawn())
    shift = np.sqrt((shifted.points**2).sum(axis=1)) - 1
    assert shift.std() == pytest.approx(0.01, rel=0.15)
    assert (shifted.normals is not None) == with_normals


@pytest.mark.parametrize("kind", ["mesh", "cloud"])
def test_holes_take_their_share_and_those_of_less(kind):
    surface = sphere(1.0, subdivisions=4)
    if kind == "cloud":
        surface = PointCloud(surface.vertices, surface.vertices)
    scene = Scene(surface)
    left = {share: with_holes(scene, share, drawn(5)) for share in (0.05, 0.4)}
    for share, holed in left.items():
        if kind == "mesh":
            assert Scene(holed).area == pytest.approx((1 - share) * scene.area, rel=2e-3)
        else:
            assert len(holed.points) == pytest.approx((1 - share) * len(surface.points), rel=0.02)
    parts = [
        set(map(tuple, (each.triangles if kind == "mesh" else each.points).tolist()))
        for each in left.values()
    ]
    assert parts[1] < parts[0]


def test_a_hole_is_round():
    holed = with_holes(Scene(sphere(1.0, subdivisions=4)), 0.01, drawn(1))
    ball = sphere(1.0, subdivisions=4)
    kept = set(map(tuple, holed.triangles.tolist()))
    gone = [each for each in ball.triangles.tolist() if tuple(each) not in kept]
    missing = ball.vertices[np.ravel(gone)]
    # A cap of 1 % of a unit ball has a radius of 2 √0.01.
    centre = missing.mean(axis=0)
    farthest = np.sqrt(((missing - centre) ** 2).sum(axis=1)).max()
    assert 0.19 < farthest < 0.26


def test_a_moved_subject_is_moved_horizontally():
    ball = sphere(0.5)
    shift = moved(ball, 0.02, drawn()).vertices - ball.vertices
    assert shift == pytest.approx(np.broadcast_to(shift[0], shift.shape), abs=1e-15)
    assert shift[0, 2] == 0
    assert np.hypot(*shift[0, :2]) == pytest.approx(0.02)
    cloud = PointCloud(ball.vertices, ball.vertices)
    assert moved(cloud, 0.02, drawn()).points - ball.vertices == pytest.approx(shift)


def test_a_leaning_subject_turns_around_its_foot():
    ball = sphere(0.5, centre=(0.1, 0.0, 0.5))
    cloud = PointCloud(ball.vertices, ball.vertices - np.array([0.1, 0.0, 0.5]))
    leant = leaning(cloud, 0.05, drawn())
    foot = np.array([0.1, 0.0, 0.0])
    turn, rest = Rotation.align_vectors(leant.points - foot, cloud.points - foot)
    assert rest == pytest.approx(0, abs=1e-6)
    diagonal = np.sqrt(3.0)
    assert np.tan(turn.magnitude()) == pytest.approx(0.05 / diagonal, rel=1e-3)
    assert turn.as_rotvec()[2] == pytest.approx(0, abs=1e-9)
    assert leant.normals == pytest.approx(turn.apply(cloud.normals), abs=1e-9)
    above = foot + turn.apply([0.0, 0.0, diagonal]) - [0.1, 0.0, diagonal]
    assert np.hypot(*above[:2]) == pytest.approx(0.05, rel=1e-3)


def test_positions_err_by_sigma():
    rig = cylinder_rig(20, 30)
    wrong = with_position_error(rig, 0.004, drawn())
    shift = np.subtract(
        [each.position for each in wrong.cameras], [each.position for each in rig.cameras]
    )
    assert shift.std(axis=0) == pytest.approx([0.004] * 3, rel=0.1)
    assert [each.orientation for each in wrong.cameras] == [
        each.orientation for each in rig.cameras
    ]


def test_rotations_err_by_sigma_about_each_axis():
    rig = cylinder_rig(20, 30)
    wrong = with_rotation_error(rig, 1.5, drawn())
    before, after = (
        Rotation.from_quat([each.orientation for each in one.cameras]) for one in (rig, wrong)
    )
    turned = np.degrees((before.inv() * after).as_rotvec())
    assert turned.std(axis=0) == pytest.approx([1.5] * 3, rel=0.1)
    assert turned == pytest.approx(1.5 * drawn().standard_normal((600, 3)), rel=2e-3, abs=1e-6)
