# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Files of cameras as other programs write them, and where these say that a point is imaged.

Written from the programs' own descriptions, without the code that reads them: Metashape's manual
(appendix "Camera models"), Epic's "Camera Geometry in RealityScan", Kalibr's wiki ("YAML formats"),
nerfstudio's "Data conventions". Points are in the optical frame: x right, y down, z forward. Pixels
are counted from the corner of the first, whose centre is (0.5, 0.5); Kalibr counts from its centre.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np
import yaml

from focus_planner.core.rig.geometry import camera_positions, camera_rotations
from focus_planner.core.rig.rig import Rig

Size = tuple[int, int]
Pixel = tuple[float, float]


def _text(values: Any) -> str:
    return " ".join(repr(float(value)) for value in np.ravel(values))


# --- nerfstudio ----------------------------------------------------------------------------------


def nerfstudio_matrices(rig: Rig, unit: float = 1.0) -> list[list[list[float]]]:
    """Return transform_matrix of every camera: columns right, up, back, and place."""
    found = []
    for turn, place in zip(camera_rotations(rig), camera_positions(rig), strict=True):
        right, down, forward = turn.T
        matrix = np.eye(4)
        matrix[:3] = np.column_stack([right, -down, -forward, place / unit])
        found.append(matrix.tolist())
    return found


def write_nerfstudio(
    path: Path, rig: Rig, image: Mapping[str, Any], paths: Sequence[str], unit: float = 1.0
) -> None:
    """Write a transforms.json whose frames share an image."""
    frames = [
        {"file_path": name, "transform_matrix": matrix}
        for name, matrix in zip(paths, nerfstudio_matrices(rig, unit), strict=True)
    ]
    path.write_text(json.dumps({**image, "frames": frames}, indent=1))


def nerfstudio_pixel(image: Mapping[str, float], point: Sequence[float]) -> Pixel:
    """Return where nerfstudio's perspective or fisheye camera has a point of the optical frame."""
    x, y = point[0] / point[2], point[1] / point[2]
    if image.get("camera_model") == "OPENCV_FISHEYE":
        away = math.hypot(x, y)
        x, y = (math.atan(away) / away * value for value in (x, y))
    k1, k2, k3, k4, p1, p2 = (image.get(k, 0.0) for k in ("k1", "k2", "k3", "k4", "p1", "p2"))
    r = x * x + y * y
    d = 1 + k1 * r + k2 * r**2 + k3 * r**3 + k4 * r**4
    u = x * d + 2 * p1 * x * y + p2 * (r + 2 * x * x)
    v = y * d + 2 * p2 * x * y + p1 * (r + 2 * y * y)
    return image["fl_x"] * u + image["cx"], image["fl_y"] * v + image["cy"]


# --- Metashape -----------------------------------------------------------------------------------


def metashape_pixel(
    terms: Mapping[str, float], size: Size, point: Sequence[float], *, fisheye: bool = False
) -> Pixel:
    """Return where Metashape's frame or fisheye camera has a point."""
    t = {name: terms.get(name, 0.0) for name in ("cx", "cy", "b1", "b2", "p1", "p2", "p3", "p4")}
    k = [terms.get(f"k{i}", 0.0) for i in range(1, 5)]
    x, y = point[0] / point[2], point[1] / point[2]
    if fisheye:
        r0 = math.sqrt(x * x + y * y)
        x, y = x * math.atan(r0) / r0, y * math.atan(r0) / r0
    r = math.sqrt(x * x + y * y)
    radial = 1 + k[0] * r**2 + k[1] * r**4 + k[2] * r**6 + k[3] * r**8
    more = 1 + t["p3"] * r**2 + t["p4"] * r**4
    x_ = x * radial + (t["p1"] * (r * r + 2 * x * x) + 2 * t["p2"] * x * y) * more
    y_ = y * radial + (t["p2"] * (r * r + 2 * y * y) + 2 * t["p1"] * x * y) * more
    w, h = size
    u = w * 0.5 + t["cx"] + x_ * terms["f"] + x_ * t["b1"] + y_ * t["b2"]
    v = h * 0.5 + t["cy"] + y_ * terms["f"]
    return u, v


def metashape_sensor(
    terms: Mapping[str, float],
    size: Size,
    *,
    number: int = 0,
    kind: str = "frame",
    focal_length: float | None = None,
    pixel: float | None = None,
) -> str:
    """Return a sensor's element; its focal length and pixel in millimetres."""
    resolution = f'<resolution width="{size[0]}" height="{size[1]}"/>'
    properties = {"pixel_width": pixel, "pixel_height": pixel, "focal_length": focal_length}
    listed = "".join(
        f'<property name="{name}" value="{value!r}"/>'
        for name, value in properties.items()
        if value is not None
    )
    values = "".join(f"<{name}>{value!r}</{name}>" for name, value in terms.items())
    calibration = f'<calibration type="{kind}" class="adjusted">{resolution}{values}</calibration>'
    return (
        f'<sensor id="{number}" label="camera" type="{kind}">{resolution}{listed}'
        f"<bands><band/></bands>{calibration if terms else ''}</sensor>"
    )


def metashape_camera(
    number: int,
    label: str,
    matrix: np.ndarray | None,
    *,
    sensor: int = 0,
    more: str = "",
) -> str:
    """Return a camera's element."""
    inside = "" if matrix is None else f"<transform>{_text(matrix)}</transform>"
    return (
        f'<camera id="{number}" sensor_id="{sensor}" label={quoteattr(label)} {more}>{inside}'
        "<orientation>1</orientation></camera>"
    )


def metashape_matrices(
    rig: Rig, turn: np.ndarray, place: np.ndarray, scale: float
) -> list[np.ndarray]:
    """Return the transforms of cameras in a chunk whose own is turn, place and scale."""
    found = []
    for rotation, position in zip(camera_rotations(rig), camera_positions(rig), strict=True):
        matrix = np.eye(4)
        matrix[:3, :3] = turn.T @ rotation
        matrix[:3, 3] = turn.T @ (position - place) / scale
        found.append(matrix)
    return found


def metashape_transform(turn: np.ndarray, place: np.ndarray, scale: float) -> str:
    """Return the element of a chunk's or component's transform."""
    return (
        f'<transform><rotation locked="true">{_text(turn)}</rotation><translation locked="true">'
        f'{_text(place)}</translation><scale locked="true">{scale!r}</scale></transform>'
    )


def metashape_document(
    sensors: Sequence[str], cameras: Sequence[str], transform: str = "", version: str = "2.0.0"
) -> str:
    """Return the XML of a chunk: 1.x has the transform in the chunk, 2.x in a component."""
    in_component = (
        f'<components next_id="1" active_id="0"><component id="0" label="Component 1">{transform}'
        "</component></components>"
        if version >= "2"
        else ""
    )
    own = "" if in_component else transform
    return (
        f'<?xml version="1.0" encoding="UTF-8"?>\n<document version="{version}">'
        f'<chunk label="Chunk 1" enabled="true"><sensors next_id="1">{"".join(sensors)}</sensors>'
        f'{in_component}<cameras next_id="9" next_group_id="0">{"".join(cameras)}</cameras>{own}'
        "<reference>LOCAL_CS[&quot;Local Coordinates (m)&quot;]</reference></chunk></document>\n"
    )


# --- RealityScan ---------------------------------------------------------------------------------

_SWAP = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])


def yaw_pitch_roll(rotation: np.ndarray) -> tuple[float, float, float]:
    """Return the angles, degrees, of an aircraft whose camera's optical frame is turned so.

    The aircraft's axes are nose, right wing and ground, turned in a frame north, east, down by
    Rz(yaw) Ry(pitch) Rx(roll). Its camera, x right, y up, z back, has x along the wing and y along
    the nose.
    """
    world_from_camera = rotation @ np.diag([1.0, -1.0, -1.0])
    ned_from_body = _SWAP @ world_from_camera @ _SWAP.T
    (r00, *_), (r10, *_), (r20, r21, r22) = ned_from_body
    yaw, pitch, roll = math.atan2(r10, r00), -math.asin(r20), math.atan2(r21, r22)
    return math.degrees(yaw), math.degrees(pitch), math.degrees(roll)


def realityscan_pixel(values: Mapping[str, float], size: Size, point: Sequence[float]) -> Pixel:
    """Return where RealityScan has a point, by what it exports, "division" among it."""
    x, y = point[0] / point[2], point[1] / point[2]
    k1, k2, k3, k4, t1, t2 = (values.get(k, 0.0) for k in ("k1", "k2", "k3", "k4", "t1", "t2"))
    r = math.sqrt(x * x + y * y)
    if values.get("division"):
        xd, yd = x / (1 + k1 * r**2), y / (1 + k1 * r**2)
    else:
        radial = k1 * r**2 + k2 * r**4 + k3 * r**6 + k4 * r**8
        xd = x + x * radial + t2 * (2 * x * y) + t1 * (r**2 + 2 * x**2)
        yd = y + y * radial + t1 * (2 * x * y) + t2 * (r**2 + 2 * y**2)
    scale = max(size)
    f = scale * values["f"] / 36
    u = f * xd + scale * values.get("px", 0.0) + 0.5 * size[0]
    v = f * yd + scale * values.get("py", 0.0) + 0.5 * size[1]
    return u, v


_CSV = ("f", "px", "py", "k1", "k2", "k3", "k4", "t1", "t2")


def realityscan_csv(rig: Rig, values: Mapping[str, float], names: Sequence[str]) -> str:
    """Return "Internal/External camera parameters"; without f only the external ones."""
    titles = ["#name", "x", "y", "alt", "heading", "pitch", "roll", *(_CSV if values else ())]
    lines = [",".join(titles)]
    for name, turn, place in zip(names, camera_rotations(rig), camera_positions(rig), strict=True):
        inner = [values.get(key, 0.0) for key in _CSV] if values else []
        numbers = (*place, *yaw_pitch_roll(turn), *inner)
        lines.append(",".join([name, *(repr(float(number)) for number in numbers)]))
    return "\n".join(lines) + "\n"


def realityscan_xmp(
    rotation: np.ndarray, place: np.ndarray, values: Mapping[str, float], model: str
) -> str:
    """Return the XMP file of an image."""
    coefficients = [values.get(key, 0.0) for key in ("k1", "k2", "k3", "k4", "t1", "t2")]
    return (
        '<x:xmpmeta xmlns:x="adobe:ns:meta/">\n'
        ' <rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#">\n'
        '  <rdf:Description xcr:Version="3" xcr:PosePrior="initial" xcr:Coordinates="absolute"'
        f' xcr:DistortionModel="{model}" xcr:FocalLength35mm="{values["f"]!r}" xcr:Skew="0"'
        f' xcr:AspectRatio="1" xcr:PrincipalPointU="{values.get("px", 0.0)!r}"'
        f' xcr:PrincipalPointV="{values.get("py", 0.0)!r}" xcr:CalibrationPrior="initial"'
        ' xmlns:xcr="http://www.capturingreality.com/ns/xcr/1.1#">\n'
        f"   <xcr:Rotation>{_text(rotation.T)}</xcr:Rotation>\n"
        f"   <xcr:Position>{_text(place)}</xcr:Position>\n"
        f"   <xcr:DistortionCoeficients>{_text(coefficients)}</xcr:DistortionCoeficients>\n"
        "  </rdf:Description>\n </rdf:RDF>\n</x:xmpmeta>\n"
    )


# --- Kalibr --------------------------------------------------------------------------------------


def kalibr_chain(rig: Rig, image: Mapping[str, Any], topics: Sequence[str]) -> str:
    """Return a camchain: T_cn_cnm1 takes points of a camera's frame to that of the next."""
    world_from = []
    for turn, place in zip(camera_rotations(rig), camera_positions(rig), strict=True):
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = turn, place
        world_from.append(matrix)
    chain: dict[str, Any] = {}
    for i, topic in enumerate(topics):
        chain[f"cam{i}"] = {"cam_overlaps": [], **image, "rostopic": topic}
        if i:
            previous = np.linalg.inv(world_from[i]) @ world_from[i - 1]
            chain[f"cam{i}"]["T_cn_cnm1"] = previous.tolist()
    return yaml.safe_dump(chain, default_flow_style=None)
