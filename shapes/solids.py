# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Solids, as Manifold makes them, and meshes of them that stand where rigs look."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from manifold3d import CrossSection, Manifold, OpType

from focus_planner import Mesh
from focus_planner.core.arrays import FloatArray

#: Metres: what the default rig takes.
HEIGHT = 1.6
#: No subject is wider than this share of the height asked for: 0.9 m at 1.6 m.
WIDTH = 0.5625
Vector = tuple[float, float, float]

_SEGMENTS = 72  # of circles that are turned
# Edges that Booleans have left shorter are collapsed, where that keeps the shape.
_SHORTEST = 1e-5  # of the height


def box(size: Vector, at: Vector = (0.0, 0.0, 0.0)) -> Manifold:
    """Return a box, its middle at ``at`` in x and y, its bottom in z."""
    return Manifold.cube((1.0, 1.0, 1.0)).translate((-0.5, -0.5, 0.0)).scale(size).translate(at)


def rod(
    radius: float, length: float, at: Vector = (0.0, 0.0, 0.0), *, top: float | None = None
) -> Manifold:
    """Return a cylinder along z from ``at`` on, or a cone whose upper radius is ``top``."""
    top = radius if top is None else top
    segments = 8 * int(np.clip(np.ceil(40 * max(radius, top)), 2, _SEGMENTS / 8))
    return Manifold.cylinder(length, radius, top, segments).translate(at)


def prism(outline: FloatArray, thickness: float) -> Manifold:
    """Return what an (n, 2) counter-clockwise outline in x and y sweeps along z."""
    return Manifold.extrude(CrossSection([outline]), thickness)


def turned(outline: FloatArray, segments: int = _SEGMENTS) -> Manifold:
    """Return what an (n, 2) counter-clockwise outline of radii and heights sweeps around z."""
    return Manifold.revolve(CrossSection([outline]), segments)


def ring(solid: Manifold, count: int) -> Manifold:
    """Return ``count`` copies, equally spaced around z."""
    return union(solid.rotate((0.0, 0.0, 360.0 * i / count)) for i in range(count))


def union(solids: Iterable[Manifold]) -> Manifold:
    """Return all solids as one."""
    return Manifold.batch_boolean(list(solids), OpType.Add)


def upright(solid: Manifold) -> Manifold:
    """Return a solid that lay on its back, facing +z, set up: facing +x, its y axis up."""
    return solid.transform(np.array([[0.0, 0, 1, 0], [1, 0, 0, 0], [0, 1, 0, 0]]))


def placed(solid: Manifold, height: float) -> Manifold:
    """Return a solid standing on z = 0, its bounding box centred on the z axis.

    Only its largest piece is kept: what touches nothing, and voids inside, are left out.

    Parameters
    ----------
    solid : Manifold
    height : float
        Metres. The solid is scaled to be as large as this and the ``WIDTH`` that goes with it let
        it be.
    """
    solid = max(solid.decompose(), key=Manifold.volume)
    x, y, z, right, back, top = solid.bounding_box()
    solid = solid.translate((-(x + right) / 2, -(y + back) / 2, -z))
    radius = np.hypot(*solid.to_mesh64().vert_properties.T[:2]).max()
    scale = min(height / (top - z), WIDTH * height / (2 * radius))
    return solid.scale((scale, scale, scale))


def split(solid: Manifold, height: float, pieces: int) -> Manifold:
    """Return a solid with edges split to about ``height / pieces``, metres."""
    return solid.simplify(_SHORTEST * height).refine_to_length(height / pieces)


def mesh(solid: Manifold) -> Mesh:
    """Return the surface of a solid, in the precision of the files that it is written to."""
    # Taken in again, it loses the triangles that rounding has left without area.
    surface = Manifold(solid.to_mesh()).to_mesh()
    return Mesh(surface.vert_properties.astype(np.float64), surface.tri_verts)
