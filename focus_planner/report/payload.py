# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What a report's program reads: JSON and arrays, compressed, as text that fits into HTML.

The payload is base64 of a zlib stream of

- 4 bytes, little-endian: the length of the JSON;
- the JSON, in UTF-8: ``facts`` (see :func:`encoded_payload`) and ``arrays``, a list of
  ``[name, type, count]`` in the order in which they follow;
- the arrays. ``u8`` are bytes. ``u16`` and ``u32`` are split into all lowest bytes, then all next
  ones, and so on, which compress better apart. ``bits`` are packed, the first in a byte's lowest
  bit.
"""

from __future__ import annotations

import base64
import json
import zlib
from collections.abc import Iterable
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from focus_planner.core import kernels
from focus_planner.core.arrays import FloatArray
from focus_planner.core.planning.plan import CameraFocus
from focus_planner.core.rig.camera import CameraIntrinsics
from focus_planner.core.rig.distortion import corner_rays, frustum_and_projection
from focus_planner.core.rig.geometry import camera_rotations
from focus_planner.core.rig.lens import Lens
from focus_planner.palette import BLURRED, SHARP, UNSEEN
from focus_planner.report.content import ReportContent, ReportedPlan, SampledSurface

_LEVELS = 65535
_MOST_SETTINGS = 4096  # of a lens, told to the page

Array = tuple[str, str, int, bytes]
Json = dict[str, Any]


def encoded_payload(content: ReportContent) -> str:
    """Return what the program of the page draws from, as text of the base64 alphabet.

    Numbers are rounded to what can be seen: positions to 1/65535 of the surface's extent, depths
    of their range, costs to 1/65535. Which plan holds which pair in focus is exact.
    """
    surface = content.surface
    scale = _Scale(surface)
    facts = {
        "origin": scale.low.tolist(),
        "extent": scale.extent,
        "depth": [scale.nearest, scale.depths],
        "samples": len(surface.points),
        "pairs": len(surface.pair_camera),
        "spacing": surface.spacing,
        "area": float(surface.areas.sum()),
        "areaUnit": scale.area_unit,
        "focusWeight": surface.focus_weight,
        "tolerance": surface.depth_tolerance,
        "mostMmPerPixel": _finite(surface.max_mm_per_pixel),
        "views": surface.views,
        "model": _model(surface),
        "importance": surface.importance is not None,
        "colours": {"sharp": SHARP, "blurred": BLURRED, "unseen": UNSEEN},
        "decimals": content.decimals,
        **_rig(content),
        "histograms": [
            {"edges": _rounded(each.edges), "areas": _rounded(each.areas)}
            for each in content.histograms
        ],
    }
    arrays = [*_surface_arrays(surface, scale)]
    for k, plan in enumerate(content.plans):
        arrays += _plan_arrays(k, plan)
    return _packed(facts, arrays)


class _Scale:
    """How positions, depths and areas become whole numbers."""

    def __init__(self, surface: SampledSurface) -> None:
        self.low = surface.points.min(axis=0)
        self.extent = float((surface.points.max(axis=0) - self.low).max()) or 1.0
        depth = surface.pair_depth
        self.nearest = float(depth.min()) if len(depth) else 0.0
        self.depths = (float(depth.max()) - self.nearest if len(depth) else 0.0) or 1.0
        self.area_unit = (float(surface.areas.max()) if len(surface.areas) else 0.0) or 1.0


def _surface_arrays(surface: SampledSurface, scale: _Scale) -> Iterable[Array]:
    yield _u16("points", ((surface.points - scale.low) / scale.extent).T.ravel())
    yield _u16("normals", (_octahedral(surface.normals).T.ravel() + 1) / 2)
    yield _u16("areas", surface.areas / scale.area_unit)
    if surface.importance is not None:
        yield _u16("importance", surface.importance)
    counts = np.diff(surface.pair_offsets)
    yield _whole("counts", counts)
    yield _whole("cameras", _steps(surface.pair_camera, surface.pair_offsets))
    yield _u16("depths", (surface.pair_depth - scale.nearest) / scale.depths)
    yield _u16("costs", surface.pair_cost)


def _plan_arrays(number: int, plan: ReportedPlan) -> Iterable[Array]:
    yield _u16(f"cost{number}", plan.cost)
    yield _whole(f"camera{number}", plan.camera.astype(np.int64) + 1)  # 0 where none sees it
    yield _bits(f"sharp{number}", plan.in_focus)
    yield _whole(f"views{number}", plan.sharp_views)
    yield _bits(f"held{number}", plan.pair_in_focus)
    for c, picture in enumerate(plan.pictures):
        yield f"picture{number}.{c}", "u8", len(picture), picture


def _octahedral(normals: FloatArray) -> FloatArray:
    """Return (N, 2) the normals on the square, from -1 to 1: an octahedron, unfolded.

    Cigolle et al., A Survey of Efficient Representations for Independent Unit Vectors, 2014.
    """
    flat = normals / np.maximum(np.abs(normals).sum(axis=1), 1e-30)[:, None]
    folded = (1 - np.abs(flat[:, [1, 0]])) * np.where(flat[:, :2] >= 0, 1.0, -1.0)
    square: FloatArray = np.where(flat[:, 2:] >= 0, flat[:, :2], folded)
    return square


def _steps(cameras: NDArray[np.int32], offsets: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return each pair's camera less the one before of the same sample, which is lower."""
    steps = cameras.astype(np.int64)
    steps[1:] -= cameras[:-1]
    first = offsets[:-1][np.diff(offsets) > 0]
    steps[first] = cameras[first]
    return steps


def _model(surface: SampledSurface) -> Json:
    model = surface.model
    return {
        "area": model.projected_area_weight,
        "axis": model.axis_deviation_weight,
        "areaScale": model.projected_area_scale,
        "axisLimit": model.axis_deviation_limit,
    }


def _rig(content: ReportContent) -> Json:
    """Return cameras and plans; what many of them share, images and lenses, once."""
    rig = content.rig
    images: dict[CameraIntrinsics, int] = {}
    lenses: dict[Lens, int] = {}
    cameras = [
        {
            "name": camera.name,
            "position": list(camera.position),
            "rotation": rotation,
            "image": images.setdefault(camera.intrinsics, len(images)),
            "lens": lenses.setdefault(camera.lens, len(lenses)),
        }
        for camera, rotation in zip(
            rig.cameras, camera_rotations(rig).reshape(-1, 9).tolist(), strict=True
        )
    ]
    plans = [_plan(plan, lenses) for plan in content.plans]
    return {
        "frame": rig.frame_id,
        "cameras": cameras,
        "plans": plans,
        "images": [_image(each) for each in images],
        "lenses": [_lens(each) for each in lenses],
    }


def _image(intrinsics: CameraIntrinsics) -> Json:
    """Return where a ray is imaged, relative to the first pixel that is read out."""
    x, y, width, height = intrinsics.pixels_read
    kind, reach = "pinhole", None
    coefficients: list[float] = []
    if intrinsics.distortion_model:
        _, projection = frustum_and_projection(intrinsics)
        kind = "fisheye" if projection[0] == kernels.FISHEYE else "polynomial"
        reach = _finite(projection[1])
        coefficients = list(projection[kernels.PROJECTION :])
    return {
        "kind": kind,
        "reach": reach,
        "f": [intrinsics.fx, intrinsics.fy],
        "c": [intrinsics.cx - x, intrinsics.cy - y],
        "size": [width, height],
        "bin": list(intrinsics.binning),
        "k": coefficients,
        "corners": [list(corner) for corner in corner_rays(intrinsics)],
    }


def _lens(lens: Lens) -> Json:
    nearest, farthest = lens.focus_limits
    settable = lens.settable_distances
    # Of very many settings, some at equal intervals are as good as all.
    every = 1 if settable is None else -(-len(settable) // _MOST_SETTINGS)
    return {
        "focal": lens.focal_length,
        "hyperfocal": lens.hyperfocal_distance,
        "limits": [nearest, _finite(farthest)],
        "distances": None if settable is None else settable[::every].tolist(),
    }


def _plan(reported: ReportedPlan, lenses: dict[Lens, int]) -> Json:
    """Return a plan; lenses that no other has are added to those of all."""
    plan = reported.plan
    own = [lenses.setdefault(lens, len(lenses)) for lens in reported.lenses]
    return {
        "title": reported.title,
        "method": plan.method,
        "samples": plan.samples,
        "held": _rounded(reported.held_area),
        "pictures": bool(reported.pictures),
        "shares": None if reported.shares is None else asdict(reported.shares),
        "lenses": own or None,
        "seesTheSame": reported.sees_the_same,
        "cameras": [_focus(camera) for camera in plan.cameras],
    }


def _focus(camera: CameraFocus) -> Json:
    return {
        "status": int(camera.status),
        "unit": camera.device_unit,
        "assigned": camera.assigned_samples,
        "inFocus": camera.in_focus_samples,
        # That its focus distance, and its picture, are of.
        "main": _main_shot(camera),
        "shots": [
            {
                "focus": shot.focus_distance,
                "near": shot.near_limit,
                "far": _finite(shot.far_limit),
                "assigned": shot.assigned_samples,
                "inFocus": shot.in_focus_samples,
                "device": shot.device_value,
                "fromSensor": shot.from_sensor,
            }
            for shot in camera.shots
        ],
    }


def _main_shot(camera: CameraFocus) -> int:
    """Return which shot the camera's focus distance is that of; 0 without any."""
    distances = [shot.focus_distance for shot in camera.shots]
    return distances.index(camera.focus_distance) if distances else 0


def _rounded(values: FloatArray) -> list[float]:
    return [float(f"{value:.6g}") for value in values.tolist()]


def _finite(value: float) -> float | None:
    """Return a number that JSON has; None for infinity."""
    return value if np.isfinite(value) else None


# --- bytes -------------------------------------------------------------------------------------


def _u16(name: str, shares: FloatArray) -> Array:
    levels = np.rint(np.clip(np.nan_to_num(shares), 0, 1) * _LEVELS).astype("<u2")
    return name, "u16", len(levels), _by_significance(levels)


def _whole(name: str, values: NDArray[Any]) -> Array:
    """Return whole numbers from 0 on in as few bytes each as the greatest takes."""
    most = int(values.max(initial=0))
    kind = "u8" if most < 1 << 8 else "u16" if most < 1 << 16 else "u32"
    words = values.astype(f"<u{int(kind[1:]) // 8}")
    return name, kind, len(words), _by_significance(words)


def _by_significance(words: NDArray[Any]) -> bytes:
    return words.view(np.uint8).reshape(-1, words.itemsize).T.tobytes()


def _bits(name: str, flags: NDArray[np.bool_]) -> Array:
    return name, "bits", len(flags), np.packbits(flags, bitorder="little").tobytes()


def _packed(facts: Json, arrays: list[Array]) -> str:
    index = [[name, kind, count] for name, kind, count, _ in arrays]
    head = json.dumps(
        {"facts": facts, "arrays": index}, separators=(",", ":"), allow_nan=False
    ).encode()
    parts = [len(head).to_bytes(4, "little"), head, *(data for *_, data in arrays)]
    return base64.b64encode(zlib.compress(b"".join(parts), 9)).decode("ascii")
