# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Small surfaces, rigs and problems for the tests of the core."""

from __future__ import annotations

import dataclasses
import functools
import math
from pathlib import Path

import numpy as np
import open3d as o3d
from numba import config, get_num_threads, set_num_threads
from scipy.spatial.transform import Rotation

import focus_planner
from focus_planner import Camera, CameraIntrinsics, Lens, LensTable, Mesh, Rig, cylinder_rig
from focus_planner.core.problem.problem import Problem, build_problem
from focus_planner.core.problem.shots import with_shots
from focus_planner.core.rig.optics import focus_interval
from focus_planner.core.surface.scene import Scene
from focus_planner.core.surface.surface import Samples
from focus_planner.core.surface.visibility import visible_pairs
from testing import reference

BODIES = Path(focus_planner.__file__).parent / "bodies"
WIDE_ANGLE = CameraIntrinsics(640, 480, 300.0, 300.0, 319.5, 239.5)


STRAIGHT = (0.0, 0.0, 0.0, 1.0)


def camera(name="a", **changes):
    """A camera at the origin that looks along z; ``changes`` are attributes."""
    return Camera(**{"name": name, "position": (0, 0, 0), "orientation": STRAIGHT} | changes)


def mesh_of(shape, centre=(0.0, 0.0, 0.0)):
    return Mesh(np.asarray(shape.vertices) + np.array(centre), np.asarray(shape.triangles))


def sphere(radius=1.0, centre=(0.0, 0.0, 0.0), subdivisions=2):
    """An icosphere, 20 · 4^subdivisions triangles."""
    shape = o3d.geometry.TriangleMesh.create_icosahedron()
    vertices, triangles = np.asarray(shape.vertices), np.asarray(shape.triangles)
    for _ in range(subdivisions):
        a, b, c = (vertices[triangles[:, i]] for i in range(3))
        corners = [a, (a + b) / 2, (a + c) / 2, b, (b + c) / 2, c]
        vertices = np.concatenate(corners)
        index = np.arange(len(triangles))[:, None] + len(triangles) * np.arange(6)
        triangles = np.concatenate(
            [index[:, t] for t in ([0, 1, 2], [1, 3, 4], [2, 4, 5], [1, 4, 2])]
        )
    vertices = vertices / np.linalg.norm(vertices, axis=1)[:, None]
    return Mesh(radius * vertices + np.array(centre), triangles)


def box(size=(1.0, 1.0, 1.0), centre=(0.0, 0.0, 0.0)):
    shape = o3d.geometry.TriangleMesh.create_box(*size)
    return mesh_of(shape, np.array(centre) - np.array(size) / 2)


def torus(radius=1.0, tube=0.35):
    return mesh_of(o3d.geometry.TriangleMesh.create_torus(radius, tube, 24, 12))


def plane(width, height, depth):
    """A rectangle at z = depth that faces -z, centred on the z axis."""
    x, y = width / 2, height / 2
    vertices = [[-x, -y, depth], [x, -y, depth], [x, y, depth], [-x, y, depth]]
    return Mesh(vertices, [[0, 2, 1], [0, 3, 2]])


def merged(*meshes):
    offsets = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes[:-1]])
    return Mesh(
        np.concatenate([mesh.vertices for mesh in meshes]),
        np.concatenate([m.triangles + o for m, o in zip(meshes, offsets, strict=True)]),
    )


def body(name="arms_down"):
    """One of the shipped bodies."""
    return mesh_of(o3d.io.read_triangle_mesh(str(BODIES / f"{name}.ply")))


def looking_at(name, position, target, *, up=(0.0, 0.0, 1.0), intrinsics=WIDE_ANGLE, lens=None):
    """A camera at ``position`` with ``target`` on its optical axis and ``up`` upwards."""
    z = np.array(target, dtype=float) - np.array(position)
    z /= np.linalg.norm(z)
    x = np.cross(z, up)
    x /= np.linalg.norm(x)
    matrix = np.stack([x, np.cross(z, x), z], axis=1)
    quaternion = Rotation.from_matrix(matrix).as_quat()
    return Camera(name, tuple(position), tuple(quaternion), intrinsics, lens or Lens())


def forward(name="cam", position=(0.0, 0.0, 0.0), *, intrinsics=WIDE_ANGLE, lens=None):
    """A camera with the world's orientation: it looks along +z."""
    return Camera(name, tuple(position), (0.0, 0.0, 0.0, 1.0), intrinsics, lens or Lens())


def around(count, radius, *, height=0.3, target=(0.0, 0.0, 0.0), intrinsics=WIDE_ANGLE, lens=None):
    """Cameras on a circle about the z axis, alternately above and below, looking at ``target``."""
    cameras = []
    for i in range(count):
        angle = 2 * np.pi * (i + 0.3) / count
        position = (radius * np.cos(angle), radius * np.sin(angle), height * (-1) ** i)
        cameras.append(looking_at(f"c{i}", position, target, intrinsics=intrinsics, lens=lens))
    return Rig(tuple(cameras))


def mixed_lenses(rig):
    """The same rig with three kinds of lenses, one of them with limits."""
    lenses = (Lens(), Lens(0.035, 4.0, 0.4, 1.3), Lens(0.085, 30.0))
    return Rig(
        tuple(
            Camera(c.name, c.position, c.orientation, c.intrinsics, lenses[i % len(lenses)])
            for i, c in enumerate(rig.cameras)
        )
    )


def stepped_lenses(rig):
    """The same rig with a lens for any distance, one with a list of them, and two with steps."""
    lenses = (
        Lens(),
        Lens(focus_distances=(0.6, 0.75, 0.8, 0.93, 1.2)),
        Lens(min_focus=0.4, focus_steps=50),
        Lens(0.035, 4.0, 0.3, 2.0, focus_steps=8),
    )
    return Rig(
        tuple(
            dataclasses.replace(c, lens=lenses[i % len(lenses)]) for i, c in enumerate(rig.cameras)
        )
    )


def problem_of(surface, rig, count, seed=0, model=None, tolerance=0.0):
    scene = Scene(surface)
    samples = scene.sample(count, seed)
    return build_problem(samples, visible_pairs(scene, rig, samples), rig, model, tolerance)


def random_problem(
    seed,
    samples=30,
    cameras=4,
    *,
    share=0.5,
    visible=None,
    ties=False,
    equal=False,
    lens=None,
    weight=1 / 3,
    tolerance=0.0,
    views=1,
    shots=1,
):
    """A problem with random visibility, depths and costs, without a surface.

    Each camera sees each sample with probability ``share``, or as in the mask ``visible``. With
    ``ties`` depths and costs are drawn from a few values; with ``equal`` all weights are equal.
    Each camera takes so many ``shots``, each sample needs so many ``views``.
    """
    random = np.random.default_rng(seed)
    lens = lens or Lens()
    drawn = random.random((samples, cameras)) < share
    visible = drawn if visible is None else visible
    sample_index, camera_index = (a.astype(np.int32) for a in np.nonzero(visible))
    pairs = len(sample_index)
    if ties:
        depth = random.choice([0.5, 0.55, 0.6, 0.8, 11.0], pairs)
        base = random.choice([0.0, 0.1, 0.2, 0.5], pairs)
    else:
        depth = random.uniform(0.5, 0.8, pairs)
        base = random.uniform(0.05, 2 / 3, pairs)
    near, far = focus_interval(depth, lens, tolerance)
    points = random.random((samples, 3))
    weights = np.ones(samples) if equal else random.uniform(0.5, 1.5, samples)
    problem = Problem(
        samples=Samples(points, np.tile([0.0, 0.0, 1.0], (samples, 1)), np.ones(samples), weights),
        names=tuple(f"c{i}" for i in range(cameras)),
        lenses=(lens,) * cameras,
        sample_offsets=np.concatenate([[0], np.cumsum(visible.sum(axis=1))]),
        sample_index=sample_index,
        camera_index=camera_index,
        depth=depth,
        base_cost=base,
        focus_near=near,
        focus_far=far,
        focus_weight=weight,
    )
    return dataclasses.replace(with_shots(problem, shots), views=views)


#: A lens whose table and own limit leave a range, and one that takes whole values only.
TABLE_LENSES = (
    Lens(max_focus=0.7, table=LensTable("steps", False, (0.57, 0.6, 2.0), (9, 7, 1))),
    Lens(min_focus=0.53, table=LensTable("steps", True, (0.45, 0.6, math.inf), (30.5, 17, -20))),
)
TINY_LENSES = (
    Lens(),
    Lens(min_focus=0.58, max_focus=0.7),
    Lens(focus_distances=(0.52, 0.58, 0.6, 0.63, 0.67, 0.72, 0.78)),
    Lens(min_focus=0.5, max_focus=3.0, focus_steps=30),
    Lens(0.05, 40.0),  # such a shallow depth of field that there are many cells
)


def tiny_problem(seed, most_choices=600):
    """A random problem of any kind that is small enough to enumerate.

    It has at most ``most_choices`` choices of cells; its first sample has a positive weight.
    """
    random = np.random.default_rng([seed, 77])
    while True:
        problem = random_problem(
            int(random.integers(2**32)),
            int(random.integers(1, 16)),
            int(random.integers(1, 6)),
            share=random.choice([0.0, 0.3, 0.6, 1.0], p=[0.02, 0.18, 0.3, 0.5]),
            ties=random.random() < 0.3,
            equal=random.random() < 0.4,
            lens=TINY_LENSES[random.choice(5, p=[0.2, 0.1, 0.1, 0.1, 0.5])],
            weight=random.choice([1 / 3, 0.1, 0.9, 0.0], p=[0.6, 0.2, 0.15, 0.05]),
            tolerance=random.choice([0.0, 0.012], p=[0.8, 0.2]),
        )
        if random.random() < 0.1:  # equal depths
            problem.focus_near[:], problem.focus_far[:], problem.depth[:] = 0.62, 0.65, 0.635
        if random.random() < 0.1:  # equal cameras
            problem.base_cost[:] = 0.2
        if random.random() < 0.1:  # a camera that cannot focus on anything
            blind = problem.camera_index == random.integers(problem.camera_count)
            problem.focus_near[blind], problem.focus_far[blind] = np.inf, -np.inf
        if random.random() < 0.2:
            problem.samples.weights[1:] *= random.random(problem.sample_count - 1) < 0.6
        if random.random() < 0.15:
            problem = with_shots(problem, int(random.integers(2, 4)))
        if np.prod(np.maximum(np.diff(problem.cells.offsets), 1.0)) <= most_choices:
            return problem


def ring_mask(samples, cameras, reach=2):
    """A mask for ``random_problem``: cameras in a ring, each sample seen by ``2·reach + 1``."""
    place = np.arange(samples) * cameras // samples
    away = np.abs(place[:, None] - np.arange(cameras)[None, :])
    return np.minimum(away, cameras - away) <= reach


@functools.cache
def body_optimum(name):
    """A body's problem of 1000 samples, and what HiGHS finds of it: best cost and lower bound."""
    problem = problem_of(body(name), cylinder_rig(), 1000)
    return problem, *reference.optimum(reference.table(problem))


def with_threads(count, function):
    """Call the function with this many threads for kernels, or as many as the machine has."""
    before = get_num_threads()
    set_num_threads(min(count, config.NUMBA_NUM_THREADS))
    try:
        return function()
    finally:
        set_num_threads(before)


def pairs_of(visibility):
    """The set of (sample, camera) of a ``Visibility``."""
    cameras = np.repeat(
        np.arange(len(visibility.camera_offsets) - 1), np.diff(visibility.camera_offsets)
    )
    return set(zip(visibility.sample_index.tolist(), cameras.tolist(), strict=True))
