# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Which camera sees which sample: field of view, orientation, occlusion."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from focus_planner.core import kernels
from focus_planner.core.arrays import FloatArray, IntArray
from focus_planner.core.brief import brief_repr
from focus_planner.core.rig.camera import CameraIntrinsics
from focus_planner.core.rig.distortion import frustum_and_projection
from focus_planner.core.rig.geometry import camera_positions, camera_rotations
from focus_planner.core.rig.remembered import remembered
from focus_planner.core.rig.rig import Rig
from focus_planner.core.surface.scene import Scene
from focus_planner.core.surface.surface import Samples

# Rays are cast in blocks to bound memory: 24 bytes per ray, 4 per sample near the view.
_RAYS_AT_ONCE = 2_000_000
# Work between two calls of ``keep_going``: a few samples at first, then about 20 ms.
_FIRST_SAMPLES = 512
_MIN_SAMPLES = 64
_RAYS_BETWEEN_CHECKS = 60_000
# Roughly one in so many pairs of a camera and a sample is visible.
_PAIRS_PER_VISIBLE = 16
# Of so many cameras one is tried first, to know what some camera sees.
_FIRST_OF = 8


@dataclass(frozen=True, eq=False)
class Visibility:
    """All pairs of a camera and a sample that it sees, by camera and ascending sample.

    Attributes
    ----------
    camera_offsets : (C + 1,) array of int64
        Camera c's pairs are ``camera_offsets[c]`` to ``camera_offsets[c + 1]``.
    sample_index : (P,) array of int32
        Index into ``taken``.
    normals : (N, 3) array
        The normals of the samples in ``taken``, outward.
    taken : (N,) array of int64
        The samples that were tested, ascending: all of them unless the search was stopped.
    """

    camera_offsets: NDArray[np.int64]
    sample_index: IntArray
    normals: FloatArray
    taken: NDArray[np.int64]

    __repr__ = brief_repr


@dataclass(frozen=True, eq=False)
class _Views:
    """The cameras' poses and fields of view, as the kernels take them.

    The frustum of a distorted image contains more than the image shows; ``projections`` then
    decide. They are None if no image is distorted.
    """

    views: kernels.Views
    projections: FloatArray | None

    def part(self, cameras: slice) -> kernels.Views:
        return kernels.Views(*(np.ascontiguousarray(array[cameras]) for array in self.views))

    def some(self, cameras: slice) -> _Views:
        projections = self.projections
        kept = None if projections is None else np.ascontiguousarray(projections[cameras])
        return _Views(self.part(cameras), kept)


def visible_pairs(
    scene: Scene,
    rig: Rig,
    samples: Samples,
    keep_going: Callable[[float], bool] | None = None,
    order: NDArray[np.int64] | None = None,
    enough: Callable[[], float] = lambda: np.inf,
) -> Visibility:
    """Return all pairs of a camera and a sample that it sees.

    A camera sees a sample that is imaged on a pixel that is read out, at a depth greater than the
    focal length, whose outer side faces the camera, and that no part of the surface hides. See
    :mod:`focus_planner.core.rig.distortion` for how far off its axis a camera with distortion
    sees.

    Normals of unknown sign (those estimated for a cloud) are turned, patch by patch, towards the
    cameras that have an unobstructed view of the patch's points, by a majority weighted with the
    cosine of incidence. Occlusion does not depend on the signs of normals.

    Parameters
    ----------
    scene : Scene
    rig : Rig
    samples : Samples
    keep_going : callable, optional
        Called between parts of the samples with the share that is done; return False to stop. The
        result then covers only the samples tested so far, a fair selection if their order is
        random.
    order : (N,) array of int64, optional
        The order in which to test the samples; as given by default.
    enough : callable, optional
        Called when the search is stopped: the number of samples that suffice. Parts beyond that
        number are dropped.

    Returns
    -------
    Visibility
    """
    views = _views(rig)
    samples = _turned(scene, views, samples)
    in_order = order is None
    order = np.arange(len(samples)) if order is None else order
    parts = []
    low, size = 0, len(samples) if keep_going is None else _FIRST_SAMPLES
    while True:
        taken = order[low : low + size]
        with kernels.threads_for(len(taken) * len(rig) // _PAIRS_PER_VISIBLE):
            whole = len(taken) == len(samples) and in_order
            those = samples if whole else samples.take(taken)
            part, rays = _find_visible(scene, views, those, taken, facing=True)
        parts.append(part)
        low += size
        if low >= len(samples) or (keep_going is not None and not keep_going(low / len(samples))):
            break
        size = min(2 * size, size * _RAYS_BETWEEN_CHECKS // max(rays, 1))
        size = max(size, _MIN_SAMPLES)
    if low < len(samples):
        parts = _leading_parts(parts, enough())
    with kernels.threads_for(len(samples) * len(rig) // _PAIRS_PER_VISIBLE):
        return _sorted_by_sample(parts[0] if len(parts) == 1 else _concatenated(parts))


def seen_by_any(scene: Scene, rig: Rig, samples: Samples) -> NDArray[np.bool_]:
    """Return (N,) whether some camera sees each sample, as :func:`visible_pairs` tells.

    Most are seen by some of the cameras, and need not be tried by the others.
    """
    views = _views(rig)
    samples = _turned(scene, views, samples)
    seen = np.zeros(len(samples), dtype=np.bool_)
    for cameras in (slice(None, None, _FIRST_OF), slice(None)):
        left = np.flatnonzero(~seen)
        if len(left):
            with kernels.threads_for(len(left) * len(rig) // _PAIRS_PER_VISIBLE):
                part = samples.take(left)
                found, _ = _find_visible(scene, views.some(cameras), part, left, facing=True)
            seen[left[found.sample_index]] = True
    return seen


def _leading_parts(parts: list[Visibility], enough: float) -> list[Visibility]:
    """Return the fewest leading parts that have ``enough`` samples."""
    before = np.cumsum([0] + [len(part.taken) for part in parts[:-1]])
    return [part for part, count in zip(parts, before, strict=True) if count < enough]


@remembered
def _views(rig: Rig) -> _Views:
    frustums = [(*_frustum(camera.intrinsics), camera.lens.focal_length) for camera in rig.cameras]
    views = kernels.Views(
        camera_positions(rig),
        camera_rotations(rig),
        np.array(frustums, dtype=np.float64),
    )
    return _Views(views, _projections(rig))


def _frustum(intrinsics: CameraIntrinsics) -> tuple[float, ...]:
    """Return fx, fy, cx, cy, width, height of a pinhole that sees all that the camera does."""
    if intrinsics.distortion_model:
        frustum, _ = frustum_and_projection(intrinsics)
        return frustum
    x, y, width, height = intrinsics.pixels_read
    return intrinsics.fx, intrinsics.fy, intrinsics.cx - x, intrinsics.cy - y, width, height


def _projections(rig: Rig) -> FloatArray | None:
    """Return a projection per camera, zeros for pinholes; None if all are pinholes."""
    distorted = [c for c, camera in enumerate(rig.cameras) if camera.intrinsics.distortion_model]
    if not distorted:
        return None
    projections = np.zeros((len(rig), kernels.PROJECTION + kernels.COEFFICIENTS))
    for c in distorted:
        _, projections[c] = frustum_and_projection(rig.cameras[c].intrinsics)
    return projections


def _find_visible(
    scene: Scene, views: _Views, samples: Samples, taken: NDArray[np.int64], *, facing: bool
) -> tuple[Visibility, int]:
    """Return the visible pairs of samples, those ``taken`` of all, and how many rays were cast.

    Samples are sorted into blocks of neighbours; each block is tested as a whole before its
    samples are tested one by one.
    """
    order = spatial_order(samples, facing=facing)
    blocks = kernels.blocks_of(samples.points, samples.normals, order)
    may = kernels.near_view(blocks, views.views, facing)
    most = np.count_nonzero(may, axis=1) * kernels.PER_BLOCK
    counts, found, cast = [], [], 0
    for cameras in _camera_blocks(most):
        view = views.part(cameras)
        room = _offsets(most[cameras])
        listed = np.empty(room[-1], dtype=np.int32)
        in_view = kernels.list_in_view(blocks, may[cameras], view, facing, room, listed)
        if views.projections is not None:
            in_view = kernels.keep_imaged(
                samples.points[order],
                view.positions,
                view.rotations,
                views.projections[cameras],
                room,
                listed,
                in_view,
            )
        offsets = _offsets(in_view)
        rays = np.empty((offsets[-1], 6), dtype=np.float32)
        kernels.fill_rays(
            blocks, view.positions, room, listed, offsets, scene.centre, scene.stop_short, rays
        )
        hidden = scene.occluded(rays)
        counts.append(kernels.count_seen(offsets, hidden))
        seen_offsets = _offsets(counts[-1])
        found.append(np.empty(seen_offsets[-1], dtype=np.int32))
        kernels.list_seen(room, listed, offsets, hidden, order, seen_offsets, found[-1])
        cast += len(rays)
    seen_from = _offsets(np.concatenate(counts))
    visibility = Visibility(seen_from, np.concatenate(found), samples.normals, taken)
    return visibility, cast


def spatial_order(samples: Samples, *, facing: bool = False) -> NDArray[np.int64]:
    """Return (N,) an order that puts neighbouring samples next to one another.

    If ``facing``, those whose normals are in the same octant.
    """
    keys = kernels.block_keys(samples.points, samples.normals, facing)
    order: NDArray[np.int64] = kernels.ascending(keys)
    return order


def _camera_blocks(most: NDArray[np.int64]) -> Iterator[slice]:
    """Yield runs of cameras, each with at most as many candidate rays as are cast at once."""
    low, total = 0, 0
    for c, count in enumerate(most.tolist()):
        if c > low and total + count > _RAYS_AT_ONCE:
            yield slice(low, c)
            low, total = c, 0
        total += count
    yield slice(low, len(most))


def _turned(scene: Scene, views: _Views, samples: Samples) -> Samples:
    """Return samples of a scene of unknown sign with the normals of whole patches turned outward.

    Outward is towards the cameras that have an unobstructed view, by a majority of a patch's
    points weighted with the cosine of incidence. A ray that meets another patch just before its
    point passes through something thin, and the point is on the far side of it: it counts against.
    """
    if scene.oriented:
        return samples
    assert samples.patches is not None
    voters = scene.voters
    assert voters.patches is not None
    with kernels.threads_for(len(voters) * len(views.views.positions) // _PAIRS_PER_VISIBLE):
        seen, _ = _find_visible(scene, views, voters, np.arange(len(voters)), facing=False)
    camera = np.repeat(np.arange(len(views.views.positions)), np.diff(seen.camera_offsets))
    towards = views.views.positions[camera] - voters.points[seen.sample_index]
    towards /= np.sqrt((towards**2).sum(axis=1))[:, None]
    cosine = (voters.normals[seen.sample_index] * towards).sum(axis=1)
    rays = np.empty((len(towards), 6), dtype=np.float32)
    rays[:, :3] = views.views.positions[camera] - scene.centre
    rays[:, 3:] = voters.points[seen.sample_index] - views.views.positions[camera]
    through = scene.patches_hit(rays) != voters.patches[seen.sample_index]
    cosine = np.where(through, -cosine, cosine)
    patches = int(samples.patches.max(initial=voters.patches.max())) + 1
    votes = np.bincount(voters.patches[seen.sample_index], weights=cosine, minlength=patches)
    inward = votes[samples.patches] < 0
    return replace(samples, normals=np.where(inward[:, None], -samples.normals, samples.normals))


def _concatenated(parts: list[Visibility]) -> Visibility:
    """Return the visibility of all parts' samples, part by part."""
    pairs = np.array([0, *(len(part.sample_index) for part in parts)])
    samples = np.array([0, *(len(part.taken) for part in parts)])
    offsets = np.array([part.camera_offsets for part in parts])
    return Visibility(
        offsets.sum(axis=0),
        _gather(
            offsets[:, :-1] + np.cumsum(pairs)[:-1, None],
            np.diff(offsets, axis=1),
            np.concatenate([part.sample_index for part in parts]),
            np.cumsum(samples)[:-1],
        ),
        np.concatenate([part.normals for part in parts]),
        np.concatenate([part.taken for part in parts]),
    )


def _sorted_by_sample(visibility: Visibility) -> Visibility:
    """Return the same visibility with ``taken`` ascending."""
    taken = visibility.taken
    if (taken[:-1] <= taken[1:]).all():
        return visibility
    order = np.argsort(taken)
    place = np.empty(len(taken), dtype=np.int32)
    place[order] = np.arange(len(taken))
    sample_index = place[visibility.sample_index]
    for low, high in pairwise(visibility.camera_offsets):
        sample_index[low:high].sort()
    return Visibility(
        visibility.camera_offsets, sample_index, visibility.normals[order], taken[order]
    )


def _gather(
    starts: NDArray[np.int64],
    counts: NDArray[np.int64],
    source: IntArray,
    shifts: NDArray[np.int64],
) -> IntArray:
    """Return each camera's K runs of ``source`` in sequence, run k shifted by ``shifts[k]``.

    ``starts`` and ``counts`` are (K, C), ``shifts`` is (K,).
    """
    offsets = _offsets(counts.sum(axis=0))
    gathered = np.empty(offsets[-1], dtype=np.int32)
    kernels.gather(starts, counts, shifts, offsets, source, gathered)
    return gathered


def _offsets(counts: NDArray[np.int64]) -> NDArray[np.int64]:
    return np.concatenate([np.zeros(1, dtype=np.int64), np.cumsum(counts)])
