# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Checks that a surface and a rig fit each other, and what is probably wrong if they do not."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from focus_planner.core.arrays import FloatArray
from focus_planner.core.planning.suspicions import suspect_frames
from focus_planner.core.problem.problem import Problem
from focus_planner.core.rig.camera import CameraIntrinsics
from focus_planner.core.rig.geometry import camera_positions
from focus_planner.core.rig.optics import focus_interval
from focus_planner.core.rig.rig import Rig
from focus_planner.core.surface.scene import Scene
from focus_planner.core.surface.surface import Mesh, Samples, Surface
from focus_planner.core.surface.visibility import Visibility, visible_pairs
from focus_planner.core.validation import InputError

# Cameras stand within a few times the subject's size; in millimetres it would be hundreds.
_FARTHEST = 100.0
# Metres. What seems smaller than this is not given in millimetres: it would be under a centimetre.
_LARGE = 10.0
_DIRECTIONS = 64
_ENCLOSED = 0.8
_TELLING = 0.25  # of the directions: fewer tell nothing of all
_TRIAL_SAMPLES = 500
# With a wrong unit less of the surface than this would be seen, and with inverted normals less
# than that.
_SEEN_ENOUGH = 0.2
SEEN_MOSTLY = 0.5
# A suspected unit has to bring at least so much of the surface into view.
_SEEN_AT_ALL = 0.02
# The factor that would correct the surface's size relative to the rig, and the mistake.
_UNITS = (
    (1e-3, "the surface is", "millimetres: divide by 1000"),
    (1e-2, "the surface is", "centimetres: divide by 100"),
    (1e3, "the camera poses are", "millimetres: divide by 1000"),
    (1e2, "the camera poses are", "centimetres: divide by 100"),
)
# A subject is at most so many times larger or smaller than its distance.
_ODD = 20.0


def check_distance(scene: Scene, rig: Rig) -> None:
    """Raise if the cameras stand absurdly far from the surface.

    They would see it, very small, and the result would pass for a plan.

    Raises
    ------
    InputError
        Names the suspected unit.
    """
    away = _distances(scene, rig)
    far = np.flatnonzero(away > _FARTHEST * scene.diagonal)
    if len(far):
        raise InputError(
            "camera poses",
            f"cameras within {_FARTHEST:g} times the surface's size of it, in metres",
            f"{len(far)} of {len(rig)} beyond, {rig.cameras[far[0]].name}"
            f" {away[far[0]]:.4g} from the middle of a surface {scene.diagonal:.4g} across",
            "the camera poses are probably in millimetres (divide by 1000), or in another frame",
        )


def check_cameras_outside(scene: Scene, rig: Rig) -> None:
    """Raise if a camera stands inside the body.

    Raises
    ------
    InputError
        Names the cameras, or the suspected unit.
    """
    enclosed = _enclosed(scene, camera_positions(rig))
    inside = [rig.cameras[c].name for c in np.flatnonzero(enclosed)]
    if not inside:
        return
    samples = scene.sample(_TRIAL_SAMPLES, 0)
    seen = _share_seen(visible_pairs(scene, rig, samples), samples)
    if seen < _SEEN_ENOUGH:
        _suspect_units(scene, rig, seen)
    named = ", ".join(inside[:3]) + (", ..." if len(inside) > 3 else "")
    raise InputError(
        "camera poses",
        "cameras outside the body",
        f"{len(inside)} of {len(rig)} inside it ({named})",
        _explained(scene, rig, "check the frames and units of the poses and of the surface"),
    )


def explain_unseen(scene: Scene, rig: Rig, samples: Samples, visibility: Visibility) -> None:
    """Raise if nothing is seen, or next to nothing and a mistake would explain that.

    Raises
    ------
    InputError
        Names what is suspected: the unit, inverted normals, the importance, the images' regions
        of interest or distortion, or the frame.
    """
    seen = _share_seen(visibility, samples)
    if seen < _SEEN_ENOUGH:
        _suspect_units(scene, rig, seen)
    if seen < SEEN_MOSTLY and scene.oriented:
        _suspect_normals(scene, rig, samples, seen)
    if seen == 0:
        _suspect_importance(scene, rig)
        _suspect_images(scene, rig)
        raise InputError(
            "camera poses",
            "cameras that see the surface",
            "none that does",
            _explained(
                scene,
                rig,
                "check that the poses are of optical frames (z forward, x right, y down), in the"
                " surface's frame, in metres",
            ),
        )


def _explained(scene: Scene, rig: Rig, otherwise: str) -> str:
    """Return the remedy: for a mistake of axes or frames if one explains what is seen."""
    suspicion = suspect_frames(scene, rig)
    return str(suspicion) if suspicion else otherwise


def _suspect_normals(scene: Scene, rig: Rig, samples: Samples, seen: float) -> None:
    """Raise if the rig would see much more of the surface if its normals were inverted."""
    few = slice(None, None, max(1, len(samples) // _TRIAL_SAMPLES))
    turned = Samples(
        samples.points[few], -samples.normals[few], samples.areas[few], samples.weights[few]
    )
    seen_turned = _share_seen(visible_pairs(scene, rig, turned), turned)
    if seen_turned > max(_SEEN_ENOUGH, 2 * seen):
        raise InputError(
            "surface normals",
            "outward normals (triangles counter-clockwise seen from outside)",
            f"{seen_turned:.0%} of the surface seen from behind and {seen:.0%} from the front",
            "the normals are probably inverted: flip the triangles' order or the normals",
        )


def _suspect_importance(scene: Scene, rig: Rig) -> None:
    """Raise if the surface has an importance, and it is 0 on all that the rig sees."""
    surface = scene.surface
    if isinstance(surface, Mesh):
        name, importance = "mesh vertex_importance", surface.vertex_importance
    else:
        name, importance = "cloud importance", surface.importance
    if importance is None:
        return
    samples = scene.sample(_TRIAL_SAMPLES, 0, by="area")
    if len(visible_pairs(scene, rig, samples).sample_index):
        raise InputError(
            name, "some above 0 where a camera sees the surface", "0 on all that any camera sees"
        )


def _suspect_images(scene: Scene, rig: Rig) -> None:
    """Raise if the rig would see the surface in full images without distortion."""
    cameras = tuple(replace(camera, intrinsics=_plain(camera.intrinsics)) for camera in rig.cameras)
    samples = scene.sample(_TRIAL_SAMPLES, 0)
    seen = _share_seen(visible_pairs(scene, replace(rig, cameras=cameras), samples), samples)
    if seen > 0:
        raise InputError(
            "image.region, image.distortion",
            "images with some of the surface in them",
            f"none ({seen:.0%} of it would be seen in whole images, without distortion)",
            "check the regions of interest, and the order of the coefficients of distortion",
        )


def _plain(intrinsics: CameraIntrinsics) -> CameraIntrinsics:
    return CameraIntrinsics(
        intrinsics.width,
        intrinsics.height,
        intrinsics.fx,
        intrinsics.fy,
        intrinsics.cx,
        intrinsics.cy,
    )


def check_resolution(lengths: FloatArray, most: float) -> None:
    """Raise if no camera images the surface as finely as asked.

    Parameters
    ----------
    lengths : (P,) array
        Of every pair of a sample and a camera that sees it, millimetres per pixel.
    most : float
        The request's limit, millimetres per pixel.

    Raises
    ------
    InputError
        Tells the finest.
    """
    if not len(lengths) or (lengths <= most).any():
        return
    finest = float(lengths.min())
    raise InputError(
        "max_mm_per_pixel",
        f"at least {round_up(finest)}, the finest that any camera images the surface",
        f"{most:g}",
        "it is in millimetres per pixel, along the surface; else bring the cameras closer, or give"
        " them longer lenses or more pixels",
    )


def round_up(length: float) -> str:
    """Return a length, above 0, with three digits that is not less."""
    if math.isinf(length):
        return "inf"
    step: float = 10.0 ** (math.floor(math.log10(length)) - 2)
    return f"{math.ceil(length / step) * step:.3g}"


def check_depths(scene: Scene, problem: Problem, tolerance: float = 0.0) -> None:
    """Raise if nothing can be brought into focus, or everything is in focus at infinity.

    Raises
    ------
    InputError
        Names what is suspected: the depth tolerance, the lens's limits or distances, or the unit.
    """
    if not len(problem.depth):
        return
    if not _some_in_focus(problem):
        depths = f"at depths from {problem.depth.min():.4g} to {problem.depth.max():.4g} m"
        if tolerance and _within_reach(problem):
            raise InputError(
                "depth_tolerance",
                "metres that some camera's depth of field leaves room for",
                f"{tolerance:g}, with which nothing counts as in focus {depths}",
                "it is probably not in metres; else stop the lenses down",
            )
        names = "lens.min_focus, lens.max_focus"
        listed = any(lens.focus_distances or lens.focus_steps for lens in problem.lenses)
        if listed:
            names = f"lens.focus_distances, lens.focus_steps, {names}"
        if any(lens.table for lens in problem.lenses):
            names = f"lens.table, {names}"
        raise InputError(
            names,
            "distances at which some of the surface comes into focus",
            f"none of it, {depths}",
            "they are probably not in metres",
        )
    if scene.diagonal >= _LARGE and _all_beyond_hyperfocal(problem):
        raise InputError(
            "surface and camera poses",
            "metres",
            f"a surface {scene.diagonal:.4g} across, all of it beyond the hyperfocal distance",
            "both are probably in millimetres (divide by 1000); if they are not, focus at"
            " infinity holds everything",
        )


def _some_in_focus(problem: Problem) -> bool:
    """Return whether some pair can be in focus: one of the first, as a rule."""
    near, far = problem.focus_near, problem.focus_far
    few = slice(_TRIAL_SAMPLES)
    return bool((near[few] <= far[few]).any() or (near <= far).any())


def _all_beyond_hyperfocal(problem: Problem) -> bool:
    hyperfocal = np.array([lens.hyperfocal_distance for lens in problem.lenses])
    return bool((problem.depth >= hyperfocal[problem.camera_index]).all())


def _within_reach(problem: Problem) -> bool:
    """Return whether some camera could bring some sample into focus without a tolerance."""
    for c, lens in enumerate(problem.lenses):
        pairs = problem.camera_pairs[problem.camera_offsets[c] : problem.camera_offsets[c + 1]]
        near, far = focus_interval(problem.depth[pairs], lens)
        if (near <= far).any():
            return True
    return False


def _suspect_units(scene: Scene, rig: Rig, seen: float) -> None:
    """Raise if the rig would see much more of the surface if one of them had another unit."""
    suspects = []
    for factor, what, size in _UNITS:
        if (scene.diagonal if factor < 1 else float(np.median(_distances(scene, rig)))) < _LARGE:
            continue
        scaled = Scene(_scaled(scene.surface, factor))
        # That all cameras see a dot explains nothing.
        odds = abs(np.log(scaled.diagonal / np.median(_distances(scaled, rig))))
        if odds < np.log(_ODD):
            suspects.append((odds, factor, f"{what} probably in {size}", scaled))
    for _, factor, suspicion, scaled in sorted(suspects, key=lambda suspect: suspect[0]):
        samples = scaled.sample(_TRIAL_SAMPLES, 0)
        seen_scaled = _share_seen(visible_pairs(scaled, rig, samples), samples)
        if seen_scaled > max(_SEEN_AT_ALL, 4 * seen):
            raise InputError(
                "surface and camera poses",
                "metres for both",
                f"a surface {scene.diagonal:.4g} across of which {seen:.0%} can be seen"
                f" ({seen_scaled:.0%} if the surface were {factor:g} times the size)",
                suspicion,
            )


def _distances(scene: Scene, rig: Rig) -> FloatArray:
    """Return (C,) the cameras' distances from the middle of the surface, metres."""
    away: FloatArray = np.sqrt(((camera_positions(rig) - scene.centre) ** 2).sum(axis=1))
    return away


def _share_seen(visibility: Visibility, samples: Samples) -> float:
    """Return the share of the surface, by importance, that some camera sees."""
    seen = np.zeros(len(samples), dtype=np.bool_)
    seen[visibility.sample_index] = True
    return float(samples.weights[seen].sum() / samples.weights.sum())


def _scaled(surface: Surface, factor: float) -> Surface:
    if isinstance(surface, Mesh):
        return replace(surface, vertices=surface.vertices * factor)
    return replace(surface, points=surface.points * factor)


def _enclosed(scene: Scene, positions: FloatArray) -> NDArray[np.bool_]:
    """Return per position whether nearly every ray from it hits the inside of the surface."""
    enclosed = scene.may_enclose(positions)
    if enclosed.any():
        enclosed[enclosed] = _surrounded(scene, positions[enclosed])
    return enclosed


def _surrounded(scene: Scene, positions: FloatArray) -> NDArray[np.bool_]:
    """Return the same of positions where it takes rays to know.

    Of a sparse cloud, a camera may stand among what stands in for the surface around its points:
    rays that end there tell nothing.
    """
    directions = _sphere(_DIRECTIONS)
    distance, outer = scene.first_hits(
        np.repeat(positions, len(directions), axis=0), np.tile(directions, (len(positions), 1))
    )
    telling = (distance >= scene.overhang).reshape(len(positions), -1)
    hit = np.isfinite(distance)
    inner = (hit & ~outer if scene.oriented else hit).reshape(len(positions), -1)
    count = telling.sum(axis=1)
    enclosed: NDArray[np.bool_] = (inner & telling).sum(axis=1) > _ENCLOSED * count
    return enclosed & (count >= _TELLING * len(directions))


def _sphere(count: int) -> FloatArray:
    """Return (count, 3) directions spread evenly (a Fibonacci spiral)."""
    z = 1 - (2 * np.arange(count) + 1) / count
    angle = np.pi * (3 - np.sqrt(5)) * np.arange(count)
    radius = np.sqrt(1 - z**2)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), z], axis=1)
