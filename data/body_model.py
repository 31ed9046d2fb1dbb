# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""People of the Anny body model, posed and placed for the rig."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import trimesh
from body_poses import Array, Joints, Rotations, draw_pose, rotations
from numpy.typing import NDArray

AGES = (18.0, 75.0)  # years
REACH = 0.62  # m from the axis, well before the cameras of the paper's rig at 0.75 m
TOP = 1.95  # m, up to where that rig's highest cameras, at 1.7 m, see a body
POSES = 100  # tried for a person before another comes


@dataclass(frozen=True)
class Body:
    """A body in its place.

    (V, 3) vertices, m, and (F, 3) triangles; the kind of its pose; how tall the person is, m.
    """

    vertices: Array
    triangles: NDArray[np.int64]
    pose: str
    stature: float

    @property
    def area(self) -> float:
        """Surface area, m²."""
        return float(self._mesh().area)

    def ply(self) -> bytes:
        """Return the body as a binary PLY file in single precision."""
        data = self._mesh().export(file_type="ply")
        assert isinstance(data, bytes)
        return data

    def _mesh(self) -> trimesh.Trimesh:
        return trimesh.Trimesh(self.vertices, self.triangles, process=False)


def generator(seed: int, number: int) -> np.random.Generator:
    """Return the generator of a body, the same however many there are."""
    return np.random.default_rng([seed, number])


def place(vertices: Array) -> Array:
    """Return (V, 3) vertices with the feet at z = 0, the bounding box centred on the z axis."""
    low, high = vertices.min(0), vertices.max(0)
    x, y, _ = (low + high) / 2
    placed: Array = vertices - [x, y, low[2]]
    return placed


def fits(vertices: Array) -> bool:
    """Tell whether a placed body is far enough from the cameras, and where they see it."""
    reach = np.hypot(vertices[:, 0], vertices[:, 1]).max()
    return bool(reach <= REACH and vertices[:, 2].max() <= TOP)


class Model:
    """The body model, and its own distribution of adults, half women and half men."""

    def __init__(self) -> None:
        import warp

        warp.config.log_level = warp.LOG_ERROR
        import anny
        import torch
        from anny.shape_distribution import SimpleShapeDistribution
        from anny.utils.collision import SelfInterpenetrationModule

        self._torch = torch
        self._anny = anny.Anny().to(dtype=torch.float64)
        ages = torch.distributions.Uniform(*torch.tensor(AGES, dtype=torch.float64))
        sexes = torch.distributions.Bernoulli(torch.tensor(0.5, dtype=torch.float64))
        self._people = SimpleShapeDistribution(self._anny, ages, sexes)
        self._collisions = SelfInterpenetrationModule(self._anny)
        self._joints = self._reference_joints()

    def draw(self, generator: np.random.Generator) -> Body:
        """Draw a person in a pose that fits the rig and in which no part enters another."""
        while True:
            self._torch.manual_seed(int(generator.integers(2**63)))
            _, person = self._people.sample(1)
            for _ in range(POSES):
                pose = draw_pose(generator)
                stature, vertices = self._posed(person, rotations(pose, self._joints))
                if fits(vertices) and not self._collide(vertices):
                    return Body(vertices, self._anny.faces.numpy(), pose.kind, stature)

    def _reference_joints(self) -> Joints:
        """Return where the bones of an average adult begin in the reference pose."""
        adult = dict.fromkeys(self._anny.phenotype_labels, 0.5) | {"age": 0.8}
        heads = self._anny(phenotype_kwargs=adult)["bone_poses"][0, :, :3, 3].numpy()
        return dict(zip(self._anny.bone_labels, heads, strict=True))

    def _posed(self, person: dict[str, Any], turned: Rotations) -> tuple[float, Array]:
        """Return how tall a person is, and the vertices in a pose, in their place."""
        pose = {}
        for bone, rotation in turned.items():
            pose[bone] = self._torch.eye(4, dtype=self._torch.float64)[None]
            pose[bone][0, :3, :3] = self._torch.as_tensor(rotation)
        made = self._anny(pose, person)
        stature = np.ptp(made["rest_vertices"][0, :, 2].numpy())
        return float(stature), place(made["vertices"][0].numpy())

    def _collide(self, vertices: Array) -> bool:
        found = self._collisions.detect_self_intersections(self._torch.as_tensor(vertices))
        return bool((found >= 0).any())
