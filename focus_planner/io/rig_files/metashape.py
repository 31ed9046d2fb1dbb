# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Rigs from Agisoft Metashape: File > Export > Export Cameras, as Agisoft XML.

The camera model is that of the appendix "Camera models" of Metashape's manual. Its p1 and p2 are
OpenCV's p2 and p1, and images are counted from the corner of the first pixel. A camera's transform
leads from its optical frame to the chunk, the chunk's or its component's to the world: local
coordinates, or geocentric ones where the chunk has a geographic reference.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import NamedTuple
from xml.etree.ElementTree import Element

import numpy as np

from focus_planner.core.notes import Note
from focus_planner.core.rig.camera import MAX_PIXELS
from focus_planner.core.rig.frames import Similarity, similarity_from_matrix
from focus_planner.core.rig.rig import Rig
from focus_planner.core.validation import InputError, check_number, check_whole
from focus_planner.io.files import read_text
from focus_planner.io.names import matches
from focus_planner.io.quoting import key_name, word
from focus_planner.io.rig_files.camera_models import (
    PIXEL_CENTRE,
    BrownCamera,
    Closest,
    closest_intrinsics,
)
from focus_planner.io.rig_files.found import (
    FoundCamera,
    ImportOptions,
    left_out,
    rig_of_found,
)
from focus_planner.io.xml_values import child, read_xml, text_number, text_numbers

_WHAT = "cameras exported by Metashape, as Agisoft XML"
# Whether it is a fisheye; versions 2.x name its projection, which is the one of 1.x.
_TYPES = {"frame": False, "fisheye": True, "equidistant_fisheye": True}
_EARTH = 6e6  # metres from the centre of the earth: nobody is nearer
_PARAMETERS = ("cx", "cy", "b1", "b2", "k1", "k2", "k3", "k4", "p1", "p2", "p3", "p4")


class _Sensor(NamedTuple):
    """What a sensor's element tells: its camera model, and its lens's focal length, metres."""

    image: Closest
    focal_length: float | None


class _Chunk:
    """A chunk of the file."""

    def __init__(self, where: str, element: Element) -> None:
        self.where = where
        self.sensors = {
            sensor.get("id", ""): (f"{where}: sensors[{i}]", sensor)
            for i, sensor in enumerate(element.iterfind("sensors/sensor"))
        }
        self.cameras = [
            (f"{where}: cameras[{i}]", camera)
            for i, camera in enumerate(_cameras_in(element.find("cameras")))
        ]
        self._read: dict[str, _Sensor] = {}
        own = element.find("transform")
        self._to_world = None if own is None else _placed(f"{where}: transform", own)
        self._components = {
            each.get("id", ""): _placed(f"{where}: components[{i}]", found)
            for i, each in enumerate(element.iterfind("components/component"))
            if (found := each.find("transform")) is not None
        }

    @property
    def is_placed(self) -> bool:
        """Whether anything tells where the chunk is in the world, and how large."""
        return self._to_world is not None or bool(self._components)

    def to_world(self, camera: Element) -> Similarity | None:
        """Return the transform from the frame of a camera's pose; None if nothing tells it."""
        component = camera.get("component_id")
        if component is None and len(self._components) == 1:
            (component,) = self._components
        return self._components.get(component or "", self._to_world)

    def sensor_of(self, where: str, camera: Element) -> _Sensor:
        """Return a camera's sensor, read once."""
        name = camera.get("sensor_id", "")
        if name not in self.sensors:
            got = word(name) if name else "none"
            raise InputError(f"{where}: sensor_id", "the id of a sensor", got)
        if name not in self._read:
            self._read[name] = _sensor(*self.sensors[name])
        return self._read[name]


def load_metashape(path: str | PathLike[str], options: ImportOptions) -> tuple[Rig, list[str]]:
    """Return a rig with a camera for every one that is aligned and enabled.

    Parameters
    ----------
    path : path
    options : ImportOptions
        The pattern of cameras is one for their labels.

    Returns
    -------
    rig : Rig
        Cameras in the order of the file, named by their labels; noted in it is what was left out.
    notes : list of str
        Assumptions that were made.

    Raises
    ------
    InputError
        If there is no camera, or one that cannot be represented.
    """
    path = Path(path)
    chunk = _chunk(str(path), read_xml(str(path), read_text(path, _WHAT), _WHAT))
    used, notes = _usable(chunk)
    if chunk.cameras and not used:
        got = f"{len(chunk.cameras)} that are not"
        remedy = "align them in Metashape, and export again"
        raise InputError(f"{chunk.where}: cameras", "cameras that are aligned", got, remedy)
    found = [_found(chunk, where, camera) for where, camera in used]
    _check_one_frame(chunk, used, options.cameras or "*")
    rig, told = rig_of_found(
        f"{chunk.where}: cameras",
        found,
        options,
        told_by="the focal_length of their sensors",
        without_unit="" if chunk.is_placed else "the chunk has no scale or reference",
        left_out=notes,
    )
    return rig, [*told, *_on_world(found)]


# --- the elements ------------------------------------------------------------------------------


def _chunk(where: str, root: Element) -> _Chunk:
    """Return the only chunk with cameras of a document, or of one that is a chunk itself."""
    chunks = [root] if root.tag == "chunk" else root.findall("chunk")
    chunks = [each for each in chunks if each.find("cameras") is not None]
    if len(chunks) != 1:
        got = f"{len(chunks)} chunks" if chunks else "XML without cameras in a chunk"
        remedy = "choose File > Export > Export Cameras and the type Agisoft XML"
        raise InputError(where, _WHAT, got, remedy)
    return _Chunk(where, chunks[0])


def _cameras_in(element: Element | None) -> Iterator[Element]:
    """Yield the cameras of a list and of its groups."""
    for each in () if element is None else element:
        if each.tag == "camera":
            yield each
        elif each.tag == "group":
            yield from _cameras_in(each)


def _usable(chunk: _Chunk) -> tuple[list[tuple[str, Element]], list[Note]]:
    """Return the cameras that are enabled and have poses, and notes on the others."""
    used, disabled, unaligned, slaves = [], [], [], []
    for where, camera in chunk.cameras:
        if camera.get("enabled", "true").lower() in ("false", "0"):
            disabled.append(_label(where, camera))
        elif camera.find("transform") is not None:
            used.append((where, camera))
        elif camera.get("master_id") is not None:
            slaves.append(_label(where, camera))
        else:
            unaligned.append(_label(where, camera))
    total = len(chunk.cameras)
    notes = [
        *left_out("disabled", disabled, total, "enable them in Metashape, and export again"),
        *left_out("not aligned", unaligned, total, "align them in Metashape, and export again"),
        *left_out(
            "slaves of a multi-camera system, which have no poses of their own",
            slaves,
            total,
            "align them as single cameras, and export again",
        ),
    ]
    return used, notes


def _check_one_frame(chunk: _Chunk, used: list[tuple[str, Element]], pattern: str) -> None:
    """Raise if cameras that match are in frames of which nothing tells how they lie."""
    frames = {
        "" if chunk.to_world(camera) else camera.get("component_id", "none")
        for where, camera in used
        if matches(_label(where, camera), pattern)
    }
    if len(frames) > 1:
        raise InputError(
            f"{chunk.where}: cameras",
            "cameras of one component, or of components that are all placed",
            f"those of {len(frames)}, of which nothing tells how they lie",
            "merge the components in Metashape, or choose cameras of one with --cameras",
        )


def _label(where: str, camera: Element) -> str:
    label = camera.get("label", "")
    if not label.strip():
        raise InputError(f"{where}: label", "the camera's label", "none")
    return label.replace("\\", "/")


def _found(chunk: _Chunk, where: str, camera: Element) -> FoundCamera:
    at = f"{where}: transform"
    numbers = text_numbers(at, child(where, camera, "transform").text, 16)
    chunk_from_camera = similarity_from_matrix(at, [numbers[i : i + 4] for i in range(0, 16, 4)])
    return FoundCamera(
        where,
        _label(where, camera),
        (chunk.to_world(camera) or Similarity()) @ chunk_from_camera,
        lambda: chunk.sensor_of(where, camera).image,
        lambda: chunk.sensor_of(where, camera).focal_length,
    )


def _placed(where: str, element: Element) -> Similarity:
    """Return the transform that an element with rotation, translation and scale describes."""

    def values(name: str, default: Sequence[float]) -> list[float]:
        found = element.find(name)
        if found is None:
            return list(default)
        return text_numbers(f"{where}: {name}", found.text, len(default))

    r = values("rotation", (1, 0, 0, 0, 1, 0, 0, 0, 1))
    t = values("translation", (0, 0, 0))
    (s,) = values("scale", (1,))
    check_number(f"{where}: scale", s, above=0)
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = s * np.reshape(r, (3, 3)), t
    return similarity_from_matrix(where, matrix)


def _on_world(found: Sequence[FoundCamera]) -> Iterator[str]:
    """Yield a note if the poses are on the globe."""
    farthest = max(float(np.linalg.norm(each.pose.translation)) for each in found)
    if farthest > _EARTH:
        yield (
            "the chunk has a geographic reference: poses are geocentric (ECEF, metres from the"
            " centre of the earth; z is not up); export the surface as WGS 84 geocentric,"
            " EPSG::4978, or move both with --transform"
        )


# --- sensors -----------------------------------------------------------------------------------


def _sensor(where: str, sensor: Element) -> _Sensor:
    calibration = _calibration(sensor)
    kind = (sensor if calibration is None else calibration).get("type") or sensor.get("type", "")
    if kind not in _TYPES:
        raise InputError(
            f"{where}: type",
            f"one of {', '.join(_TYPES)}",
            key_name(kind),
            "calibrate the sensor as Equidistant Fisheye, and export again"
            if kind == "equisolid_fisheye"
            else "a picture has to have one optical axis, along which it is focused",
        )
    width, height = _resolution(where, sensor, calibration)
    properties = {
        each.get("name", ""): each.get("value", "") for each in sensor.iterfind("property")
    }
    focal_length, pitch = (
        _length(f"{where}: {name}", properties.get(name))
        for name in ("focal_length", "pixel_width")
    )
    if calibration is None:
        if focal_length is None or pitch is None:
            raise InputError(where, "a calibration", "none", "align the cameras, and export again")
        terms = {"f": focal_length / pitch}
    else:
        terms = _terms(where, calibration)
    camera = _camera(where, width, height, terms, is_fisheye=_TYPES[kind])
    return _Sensor(closest_intrinsics(where, camera), focal_length)


def _calibration(sensor: Element) -> Element | None:
    """Return the calibration that was adjusted, or else the first, as it was at the start."""
    found = sensor.findall("calibration")
    adjusted = [each for each in found if each.get("class") == "adjusted"]
    return next(iter([*adjusted, *found]), None)


def _resolution(where: str, sensor: Element, calibration: Element | None) -> tuple[int, int]:
    own = None if calibration is None else calibration.find("resolution")
    found = child(where, sensor, "resolution") if own is None else own
    width, height = (
        text_number(f"{where}: resolution: {name}", found.get(name, ""))
        for name in ("width", "height")
    )
    return (
        check_whole(f"{where}: resolution: width", _whole(width), 1, MAX_PIXELS),
        check_whole(f"{where}: resolution: height", _whole(height), 1, MAX_PIXELS),
    )


def _whole(value: float) -> float | int:
    return int(value) if value.is_integer() else value


def _length(where: str, text: str | None) -> float | None:
    """Return a length in metres that a property tells in millimetres; None if it is not known."""
    if text is None or not text.strip():
        return None
    value = check_number(where, text_number(where, text), at_least=0)
    return value / 1000 or None


def _terms(where: str, calibration: Element) -> dict[str, float]:
    """Return the parameters of a calibration; PhotoScan's had fx and fy, and cx, cy as they are."""
    if calibration.find("f") is None and calibration.find("fx") is not None:
        raise InputError(
            where,
            "a calibration with f, as Metashape and PhotoScan 1.3 and later write it",
            "one with fx and fy of an older version",
            "open the project in a newer one, and export again",
        )
    return {
        "f": _term(where, child(where, calibration, "f")),
        **{
            name: _term(where, found)
            for name in _PARAMETERS
            if (found := calibration.find(name)) is not None
        },
    }


def _term(where: str, element: Element) -> float:
    (value,) = text_numbers(f"{where}: {element.tag}", element.text, 1)
    return check_number(f"{where}: {element.tag}", value)


def _camera(
    where: str, width: int, height: int, terms: Mapping[str, float], *, is_fisheye: bool
) -> BrownCamera:
    f = check_number(f"{where}: f", terms["f"], above=0)
    others = {name: terms.get(name, 0.0) for name in _PARAMETERS}
    return BrownCamera(
        width,
        height,
        fx=check_number(f"{where}: f + b1", f + others["b1"], above=0),
        fy=f,
        cx=width / 2 + others["cx"] - PIXEL_CENTRE,
        cy=height / 2 + others["cy"] - PIXEL_CENTRE,
        skew=others["b2"],
        radial=(others["k1"], others["k2"], others["k3"], others["k4"]),
        tangential=(others["p2"], others["p1"], others["p3"], others["p4"]),
        is_fisheye=is_fisheye,
    )
