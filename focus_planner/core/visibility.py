"""Which camera sees which sample: field of view, facing, occlusion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from focus_planner.core import kernels
from focus_planner.core.geometry import camera_positions, camera_rotations
from focus_planner.core.scene import Scene
from focus_planner.core.types import FloatArray, IntArray, Rig, Samples

# Rays are cast in blocks: they need 24 bytes each and as much again in between.
_RAYS_AT_ONCE = 4_000_000


@dataclass(frozen=True, eq=False)
class Visibility:
    """The pairs of a camera and a sample that it sees, camera by camera, samples ascending.

    Attributes
    ----------
    camera_offsets : (C + 1,) array of int64
        Camera c's pairs are ``camera_offsets[c]`` to ``camera_offsets[c + 1]``.
    sample_index : (P,) array of int32
    normals : (N, 3) array
        The samples' normals, outward.
    """

    camera_offsets: np.ndarray[tuple[int], np.dtype[np.int64]]
    sample_index: IntArray
    normals: FloatArray


def visible_pairs(scene: Scene, rig: Rig, samples: Samples) -> Visibility:
    """Return the pairs of a camera and a sample that it sees.

    A camera sees a sample that lies in its image, farther than its focal length, whose normal
    points to the camera's side of the surface, with nothing of the surface in between.

    Normals of unknown sign (a cloud's that were estimated) are turned towards the cameras with
    an unobstructed view, by majority weighted with the cosine of incidence: what hides a sample
    does not depend on the sign of any normal.
    """
    positions = camera_positions(rig)
    offsets, sample_index = _in_view(rig, positions, samples, scene.oriented)
    camera_index = np.repeat(np.arange(len(rig)), np.diff(offsets))
    seen = np.empty(len(sample_index), dtype=np.bool_)
    for start in range(0, len(seen), _RAYS_AT_ONCE):
        block = slice(start, start + _RAYS_AT_ONCE)
        seen[block] = ~scene.occluded(
            positions[camera_index[block]], samples.points[sample_index[block]]
        )
    camera_index, sample_index = camera_index[seen], sample_index[seen]
    normals = samples.normals
    if not scene.oriented:
        towards = positions[camera_index] - samples.points[sample_index]
        towards /= np.sqrt((towards**2).sum(axis=1))[:, None]
        cosine = (normals[sample_index] * towards).sum(axis=1)
        votes = np.bincount(sample_index, weights=cosine, minlength=len(samples))
        normals = np.where(votes < 0, -1.0, 1.0)[:, None] * normals
        facing = (normals[sample_index] * towards).sum(axis=1) > 0
        camera_index, sample_index = camera_index[facing], sample_index[facing]
    counts = np.bincount(camera_index, minlength=len(rig))
    return Visibility(np.concatenate([[0], np.cumsum(counts)]), sample_index, normals)


def _in_view(
    rig: Rig, positions: FloatArray, samples: Samples, facing: bool
) -> tuple[np.ndarray[tuple[int], np.dtype[np.int64]], IntArray]:
    """Return the candidate pairs, before occlusion."""
    frustum = np.array(
        [
            (
                c.image.fx,
                c.image.fy,
                c.image.cx,
                c.image.cy,
                c.image.width,
                c.image.height,
                c.lens.focal_length,
            )
            for c in rig.cameras
        ],
        dtype=np.float64,
    )
    arguments = (
        samples.points,
        samples.normals,
        positions,
        np.ascontiguousarray(camera_rotations(rig)),
        frustum,
        facing,
    )
    offsets = np.zeros(len(rig) + 1, dtype=np.int64)
    offsets[1:] = np.cumsum(kernels.count_in_view(*arguments))
    sample_index = np.empty(offsets[-1], dtype=np.int32)
    kernels.list_in_view(*arguments, offsets, sample_index)
    return offsets, sample_index
