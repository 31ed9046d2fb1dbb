# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The noise that is found in clouds whose noise is known, and in clouds that have none."""

import numpy as np
import pytest

from focus_planner.core.surface.noise import estimate_scatter
from focus_planner.core.surface.sampling import sample_mesh
from testing.problems import body, box, merged, plane, sphere, torus


def cylinder(count, random, radius=0.15, height=1.0):
    turn = 2 * np.pi * random.random(count)
    z = height * random.random(count)
    return np.stack([radius * np.cos(turn), radius * np.sin(turn), z], axis=1)


def on(shape, count, random):
    if shape == "cylinder":
        return cylinder(count, random)
    mesh = {"sphere": sphere(0.3, subdivisions=4), "plane": plane(1, 1, 0)}[shape]
    return sample_mesh(mesh, count, 1).points


AREAS = {"sphere": 4 * np.pi * 0.09, "plane": 1.0, "cylinder": 2 * np.pi * 0.15}


@pytest.mark.parametrize("shape", ["sphere", "plane", "cylinder"])
@pytest.mark.parametrize("ratio", [0.4, 1.0, 2.0])
def test_noise_is_found_whatever_it_is_to_the_spacing(shape, ratio):
    random, count = np.random.default_rng(0), 40_000
    spacing = np.sqrt(AREAS[shape] / count)
    noise = ratio * spacing
    points = on(shape, count, random)
    scatter = estimate_scatter(points + noise * random.standard_normal(points.shape))
    assert scatter.noise == pytest.approx(noise, rel=0.1)
    assert scatter.spacing == pytest.approx(spacing, rel=0.1)


def test_noise_along_the_normals_is_the_same():
    random = np.random.default_rng(1)
    directions = random.standard_normal((30_000, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    points = (0.3 + 0.004 * random.standard_normal((len(directions), 1))) * directions
    assert estimate_scatter(points).noise == pytest.approx(0.004, rel=0.1)


def test_noise_is_that_of_most_of_the_surface_not_of_most_points():
    # Half of the plane is scanned nine times as densely as the other, and both scatter alike.
    random = np.random.default_rng(2)
    points = random.random((40_000, 3)) * [1, 1, 0]
    points = points[(points[:, 0] < 0.5) | (random.random(len(points)) < 1 / 9)]
    scatter = estimate_scatter(points + 0.01 * random.standard_normal(points.shape))
    assert scatter.noise == pytest.approx(0.01, rel=0.1)


@pytest.mark.parametrize("count", [50, 200, 1000, 5000, 20_000])
@pytest.mark.parametrize(
    "mesh",
    [
        sphere(subdivisions=4),
        torus(),
        torus(0.4, 0.05),
        box(),
        merged(plane(1, 1, 0), plane(1, 1, 0.01)),
        body(),
    ],
    ids=["sphere", "torus", "thin torus", "box", "two sheets", "body"],
)
def test_shape_is_no_noise(mesh, count):
    scatter = estimate_scatter(sample_mesh(mesh, count, 1).points)
    assert scatter.noise < 0.25 * scatter.spacing


@pytest.mark.parametrize("step", [1, 2, 5, 10, 30])
def test_fingers_and_ears_are_no_noise(step):
    # Most vertices of this mesh are on hands and head, where sheets are close.
    scatter = estimate_scatter(body("arms_out").vertices[::step])
    assert scatter.noise < 0.25 * scatter.spacing


def test_what_shows_no_surface_has_no_noise():
    random = np.random.default_rng(0)
    for points in (random.random((20_000, 3)), np.zeros((40, 3)), random.random((16, 3))):
        assert estimate_scatter(points).noise == 0
