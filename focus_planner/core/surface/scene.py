# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A surface prepared for planning: sampling and occlusion queries.

A scene builds a ray-casting structure and, for a cloud, finds the surface around its points. It is
built once per surface and used for every plan.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import get_args

import numpy as np
from numpy.typing import NDArray

from focus_planner.core.arrays import FloatArray, IntArray
from focus_planner.core.notes import Note
from focus_planner.core.surface.appearance import Colours
from focus_planner.core.surface.cloud_shape import surfels
from focus_planner.core.surface.preparation import PreparedCloud, prepare_cloud
from focus_planner.core.surface.ray_casting import ray_caster
from focus_planner.core.surface.sampling import (
    Density,
    fresh_seed,
    sample_around_cloud,
    sample_cloud,
    sample_mesh,
)
from focus_planner.core.surface.surface import Mesh, PointCloud, Samples, Surface
from focus_planner.core.validation import InputError, check_choice, check_whole

# A ray ends this far before its target, so that the target's own triangle does not block it: well
# above float32's error in a recentred scene (1e-7 of its size), well below any detail that
# matters.
_STOP_SHORT_OF_MESH = 1e-4  # of the scene's diagonal
# Surfels overlap their neighbours and stand off a curved surface, so a ray must end before its
# target's neighbourhood.
_STOP_SHORT_OF_CLOUD = 2.5  # spacings
_SURFEL_RADIUS = 1.5  # spacings; leaves hardly any holes between random points
# Points of a cloud that tell its outer sides, and the least of each patch, if it has as many.
_VOTERS = 2048
_VOTERS_OF_PATCH = 16


class Scene:
    """A surface with its ray-casting structure.

    Parameters
    ----------
    surface : Mesh or PointCloud
    on_progress : callable, optional
        Called with the share of the preparation that is done, from 0 to 1.

    Raises
    ------
    InputError
        If a cloud's points tell no surface.

    Attributes
    ----------
    surface : Mesh or PointCloud
        As given. A cloud that scatters is averaged before it is used: see ``notes``.
    area : float
        Square metres; for a cloud, estimated from the points' spacing.
    diagonal : float
        Of the surface's bounding box, metres.
    stop_short : float
        How far before its target a ray must end so as not to be blocked by the target itself,
        metres.
    overhang : float
        How far what rays hit reaches beyond the surface, metres: 0 for a mesh. Nearer to it than
        this, no place can be told to be on one side or the other.
    """

    def __init__(
        self, surface: Surface, on_progress: Callable[[float], object] = lambda _: None
    ) -> None:
        self.surface = surface
        self._prepared: PreparedCloud | None = None
        if isinstance(surface, Mesh):
            self._centre, self._size = _extent(surface)
            self.diagonal = _length(self._size)
            self.area = float(surface.areas.sum())
            self.stop_short = _STOP_SHORT_OF_MESH * self.diagonal
            self.overhang = 0.0
        else:
            self._prepared = prepare_cloud(surface, lambda share: on_progress(0.9 * share))
            cloud, shape = self._prepared.cloud, self._prepared.shape
            self._centre, self._size = _extent(cloud)
            self.diagonal = _length(self._size)
            self.area = float(shape.areas.sum())
            self.stop_short = _STOP_SHORT_OF_CLOUD * shape.spacing
            self.overhang = _SURFEL_RADIUS * shape.spacing
        vertices, triangles = self.opaque
        self._rays = ray_caster(vertices - self._centre, triangles)
        on_progress(1.0)

    def __repr__(self) -> str:
        return f"<Scene: {self.surface!r}, {self.area:.3g} m², {self.diagonal:.3g} m across>"

    @property
    def notes(self) -> tuple[Note, ...]:
        """What was noticed when the surface was read and prepared."""
        return self.surface.notes + (self._prepared.notes if self._prepared else ())

    @property
    def oriented(self) -> bool:
        """Whether samples' normals point outward; else their sign is unknown."""
        return self._prepared is None or self._prepared.shape.oriented

    @property
    def opaque(self) -> tuple[FloatArray, IntArray]:
        """(V, 3) vertices and (T, 3) triangles of what rays hit: of a cloud, two per point.

        The first half of a cloud's triangles are in the order of the points, as is the second.
        """
        if self._prepared is None:
            assert isinstance(self.surface, Mesh)
            return self.surface.vertices, self.surface.triangles
        return surfels(self._prepared.cloud, self._prepared.shape, _SURFEL_RADIUS)

    @property
    def colours(self) -> Colours | None:
        """(V, 3) those of the vertices of ``opaque``; None if the surface has none."""
        if isinstance(self.surface, Mesh):
            return self.surface.vertex_colours
        assert self._prepared is not None
        colours = self._prepared.cloud.colours
        return None if colours is None else np.repeat(colours, 4, axis=0)

    @cached_property
    def voters(self) -> Samples:
        """Some of a cloud's own points, several of each patch, to tell its outer side by.

        Evenly spaced in the cloud's order within each patch; none if the scene is oriented.
        """
        if self._prepared is None or self._prepared.shape.patches is None:
            return self.sample(1, 0).take(slice(0))
        labels = self._prepared.shape.patches
        order = np.argsort(labels, kind="stable")
        sizes = np.bincount(labels)
        voters = np.minimum(np.maximum(_VOTERS * sizes // len(labels), _VOTERS_OF_PATCH), sizes)
        patch = np.repeat(np.arange(len(sizes)), voters)
        rank = np.arange(len(patch)) - np.repeat(np.cumsum(voters) - voters, voters)
        first = np.cumsum(sizes) - sizes
        chosen = order[first[patch] + rank * sizes[patch] // voters[patch]]
        return self.sample(0, 0, "area").take(chosen)

    @property
    def centre(self) -> FloatArray:
        """(3,) the centre of the surface's bounding box, metres."""
        return self._centre

    def sample(self, count: int, seed: int, by: Density = "importance") -> Samples:
        """Return random samples of the surface; with a count of 0, a cloud's points themselves.

        They are those of the averaged cloud if the cloud was averaged.

        Parameters
        ----------
        count, seed : int
        by : {"importance", "area"}
            What the samples' density is proportional to. By importance, all have the same weight,
            and their areas sum to that of the surface with any importance. By area, all represent
            the same area, and some may have weight 0. The same thing without importance.

        Raises
        ------
        InputError
            If ``count`` or ``seed`` is negative, ``count`` is 0 on a mesh, or ``by`` is neither.
        """
        check_whole("samples", count, 0)
        check_whole("seed", seed, 0)
        check_choice("by", by, get_args(Density))
        if isinstance(self.surface, PointCloud):
            assert self._prepared is not None
            return sample_cloud(self._prepared.cloud, self._prepared.shape, count, seed, by)
        if count == 0:
            raise InputError(
                "samples",
                "at least 1 on a mesh",
                "0",
                "0 takes the points themselves, which only a cloud has",
            )
        return sample_mesh(self.surface, count, seed, by)

    def fresh_samples(self, count: int, seed: int, by: Density = "importance") -> Samples:
        """Return samples to estimate a plan's quality on, independent of :meth:`sample`'s.

        They are distributed like those of :meth:`sample` and independent of them, whatever the
        seeds. A cloud's lie around its points: see :func:`sample_around_cloud`.

        Raises
        ------
        InputError
            If ``count`` is less than 2 (there would be no standard error), ``seed`` is negative,
            or ``by`` is neither.
        """
        check_whole("fresh_samples", count, 2)
        check_choice("by", by, get_args(Density))
        stream = fresh_seed(check_whole("seed", seed, 0))
        if isinstance(self.surface, PointCloud):
            assert self._prepared is not None
            cloud, shape = self._prepared.cloud, self._prepared.shape
            return sample_around_cloud(cloud, shape, count, stream, by)
        return sample_mesh(self.surface, count, stream, by)

    def occluded(self, rays: NDArray[np.float32]) -> NDArray[np.bool_]:
        """Return whether the surface blocks each ray between its origin and its end.

        A ray to a point on the surface must end ``stop_short`` before it.

        Parameters
        ----------
        rays : (n, 6) array of float32
            Origin relative to ``centre``, and the vector from there to the end, metres.

        Returns
        -------
        (n,) array of bool
        """
        return self._rays.occluded(rays)

    def patches_hit(self, rays: NDArray[np.float32]) -> IntArray:
        """Return (n,) the patch that each ray first hits, of a cloud that is not oriented.

        It may be hit beyond the ray's end; -1 if nothing is.

        Parameters
        ----------
        rays : (n, 6) array of float32
            Origin relative to ``centre``, and a vector of any length.
        """
        assert self._prepared is not None
        labels = self._prepared.shape.patches
        assert labels is not None
        _, triangle, _ = self._rays.first_hits(rays)
        # Two triangles per point: the first of all points, then the second.
        patch = labels[triangle % len(labels)]
        patches: IntArray = np.where(triangle >= 0, patch, -1).astype(np.int32)
        return patches

    def may_enclose(self, points: FloatArray) -> NDArray[np.bool_]:
        """Return (n,) whether each of (n, 3) points is within the box around what rays hit.

        From any other, half of all rays meet nothing.
        """
        reach = self._size / 2 + 2 * self.overhang + self.stop_short
        within: NDArray[np.bool_] = (np.abs(points - self._centre) <= reach).all(axis=1)
        return within

    def first_hits(
        self, origins: FloatArray, directions: FloatArray
    ) -> tuple[FloatArray, NDArray[np.bool_]]:
        """Return where each ray first hits the surface, and whether that is its outer side.

        The latter is meaningless for a cloud without oriented normals.

        Parameters
        ----------
        origins, directions : (n, 3) arrays
            Metres, in the surface's frame.

        Returns
        -------
        distance : (n,) array
            In lengths of the direction; infinite if there is no hit.
        outer : (n,) array of bool
        """
        rays = np.empty((len(directions), 6), dtype=np.float32)
        rays[:, :3] = origins - self._centre
        rays[:, 3:] = directions
        length, _, normals = self._rays.first_hits(rays)
        distance: FloatArray = length.astype(np.float64)
        return distance, np.isfinite(distance) & ((normals * directions).sum(axis=1) < 0)


def _extent(surface: Surface) -> tuple[FloatArray, FloatArray]:
    """Return the centre and the size of the bounding box."""
    if isinstance(surface, Mesh):
        used = np.zeros(len(surface.vertices), dtype=np.bool_)
        used[surface.triangles.ravel()] = True
        points = surface.vertices if used.all() else surface.vertices[used]
    else:
        points = surface.points
    coordinates = points.T.copy()  # NumPy is slow on short rows
    low, high = coordinates.min(axis=1), coordinates.max(axis=1)
    return (low + high) / 2, high - low


def _length(vector: FloatArray) -> float:
    return float(np.sqrt((vector**2).sum()))
