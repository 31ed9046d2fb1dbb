# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""rig.yaml: the cameras of a rig, for people to write and programs to read."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import asdict, fields
from os import PathLike
from pathlib import Path
from typing import Any, NamedTuple

from focus_planner.core.notes import Note
from focus_planner.core.rig.camera import Camera, CameraIntrinsics, check_camera_name
from focus_planner.core.rig.circles import CIRCLE, AssumedCircle, assumed_circle, note_on_circles
from focus_planner.core.rig.defaults import (
    FOCAL_LENGTH,
    KINDS,
    assumed_values,
    keys_of,
    notes_on_defaults,
)
from focus_planner.core.rig.lens import Lens
from focus_planner.core.rig.optics import f_number_of, lens_of_aperture
from focus_planner.core.rig.rig import Grid, Rig
from focus_planner.core.text import did_you_mean
from focus_planner.core.validation import InputError
from focus_planner.io.files import atomic_write, read_text
from focus_planner.io.lens_tables import lens_table_from_values, lens_table_values
from focus_planner.io.quoting import abbreviated, key_name, kind_of
from focus_planner.io.rig_files.recognition import probable_kind
from focus_planner.io.yaml_values import (
    Values,
    errors_within,
    flow,
    mapping,
    number,
    numbers,
    read_yaml,
    scalar,
    vector,
)

_Reader = Callable[[str, Any], Any]

_WHAT = "a rig.yaml"
_RIG_KEYS = ("frame_id", "image", "lens", "defaults", "grid", "sequence", "cameras")
_DEFAULTS = {
    **{kind: keys_of(kind) for kind in KINDS},
    **{key: frozenset([key]) for kind in KINDS for key in sorted(keys_of(kind))},
}
_ASSUMED_CIRCLE = "; circle_of_confusion is assumed: add yours"
# What to do about values that a program wrote and somebody has checked.
_DELETE = ", or, if that is right, delete it under defaults there"
_CAMERA_KEYS = ("name", "position", "orientation", "image", "lens", "defaults")
_IMAGE_KEYS = tuple(field.name for field in fields(CameraIntrinsics))
_PINHOLE_KEYS = ("width", "height", "fx", "fy", "cx", "cy")
_GRID_KEYS = tuple(field.name for field in fields(Grid))
_LENS_KEYS = (*(field.name for field in fields(Lens)), "f_number")
# Keys that express the same property in different ways.
_ALTERNATIVES = (
    (("f_number",), ("hyperfocal_distance",)),
    (("focus_distances",), ("focus_steps",)),
)


class _Optics(NamedTuple):
    """The values that a file gives for a camera's image and lens, and the keys it doubts."""

    image: Values
    lens: Values
    doubted: frozenset[str]

    def assumed(self) -> frozenset[str]:
        """Return the keys that nothing tells."""
        keys = assumed_values(self.lens, self.image, self.doubted)
        f_number, circle = self.lens.get("f_number"), self.lens.get("circle_of_confusion")
        return keys | {CIRCLE} if f_number is not None and circle is None else keys

    def circle(self, camera: Camera) -> AssumedCircle:
        """Return the circle of confusion that was assumed for their camera."""
        told = FOCAL_LENGTH not in self.assumed()
        f = camera.lens.focal_length
        return assumed_circle(camera.intrinsics, f, focal_length_told=told)


def load_rig(path: str | PathLike[str]) -> Rig:
    """Read rig.yaml.

    ``image`` and ``lens`` apply to all cameras; a camera may override any of their keys. Missing
    keys default to the paper's values. A lens has a ``hyperfocal_distance``, beside which a
    ``circle_of_confusion`` tells the aperture, or ``f_number`` and ``circle_of_confusion``, which
    is assumed where it is missing (:mod:`focus_planner.core.rig.circles`); a camera that gives
    either form overrides the shared one. ``fy`` defaults to ``fx``. The same goes for
    ``focus_distances`` and ``focus_steps``, where null stands for neither. ``table``
    converts distances to the driver's values
    (:class:`~focus_planner.core.rig.lens_table.LensTable`); null for none. ``grid`` describes the
    arrangement of the cameras for ``--tuples grid``; ``sequence: true`` says that they are in
    shooting order. ``defaults`` lists what a program filled in,
    ``image`` or ``lens`` or one value such as ``lens.focal_length``: of these, values that still
    are the default's count as said by nobody, unless a camera gives them itself. A camera may
    have ``defaults`` of its own instead. The rig has notes on cameras whose image or lens nothing
    tells, and on circles of confusion that were assumed.

    Raises
    ------
    InputError
        If the file is invalid; names the file, the camera, the key, and the key probably meant.
    """
    path = Path(path)
    text = read_text(path, _WHAT)
    if kind := probable_kind(text):
        remedy = f"make one of it with focus_planner rig {kind} {path}"
        raise InputError(str(path), _WHAT, "another program's cameras", remedy)
    data = read_yaml(str(path), text)
    top = mapping(str(path), data, _RIG_KEYS, prefix=f"{path}: ")
    entries = top.get("cameras")
    if not isinstance(entries, list):
        raise InputError(f"{path}: cameras", "a list of cameras", kind_of(entries))
    shared = _Optics(
        _values(f"{path}: image", top.get("image", {}), _IMAGE_KEYS),
        _values(f"{path}: lens", top.get("lens", {}), _LENS_KEYS),
        _doubted(f"{path}: defaults", top.get("defaults", [])),
    )
    with errors_within(str(path)):  # so that a shared error is not blamed on the first camera
        CameraIntrinsics(**shared.image)
        lens_from_values(f"{path}: lens", shared.lens)
    _check_names(f"{path}: cameras", entries)
    read = [_camera(str(path), i, each, shared) for i, each in enumerate(entries)]
    frame_id = top.get("frame_id", "world")
    if not isinstance(frame_id, str):
        raise InputError(f"{path}: frame_id", "a name", abbreviated(frame_id))
    assumed = {camera.name: optics.assumed() for camera, optics in read}
    notes = _notes(path, read)
    with errors_within(str(path)):
        cameras = tuple(camera for camera, _ in read)
        return Rig(
            *(cameras, frame_id, _grid(f"{path}: grid", top), notes, assumed),
            sequence=_sequence(f"{path}: sequence", top),
        )


def _notes(path: Path, read: Sequence[tuple[Camera, _Optics]]) -> tuple[Note, ...]:
    """Return the notes on what a file tells nothing of."""
    doubted = frozenset[str]().union(*(optics.doubted for _, optics in read))
    circles = [optics.circle(camera) for camera, optics in read if CIRCLE in optics.assumed()]
    return (
        *notes_on_defaults(
            (optics.assumed() for _, optics in read),
            f"give your own under lens in {path} (focal_length, and f_number with"
            " circle_of_confusion, or hyperfocal_distance)"
            + _DELETE
            * bool(doubted & keys_of("lens")),
            f"give your own under image in {path} (width, height, fx, fy, cx, cy)"
            + _DELETE * bool(doubted & keys_of("image")),
        ),
        *note_on_circles(
            circles, len(read), f"give your own as circle_of_confusion under lens in {path}"
        ),
    )


def rig_to_yaml(rig: Rig) -> str:
    """Return a rig as the text of rig.yaml; reading it back gives the same rig, bit for bit.

    The most common image and lens come first, then one line per camera.
    """
    intrinsics = Counter(camera.intrinsics for camera in rig.cameras).most_common(1)[0][0]
    lenses = [_lens_values(camera, rig.assumed.get(camera.name, ())) for camera in rig.cameras]
    lens = dict(Counter(tuple(values.items()) for values in lenses).most_common(1)[0][0])
    always = ("focal_length", "f_number" if "f_number" in lens else "hyperfocal_distance")
    optics = {name: lens[name] for name in always}
    lines = [
        f"frame_id: {scalar(rig.frame_id)}",
        f"image: {flow(_image_values(intrinsics))}   # pixels",
        f"lens: {flow(optics | _written(lens, vars(Lens()) | optics))}   # metres"
        + _ASSUMED_CIRCLE * ("f_number" in lens),
    ]
    assumed = [rig.assumed.get(camera.name, frozenset[str]()) - {CIRCLE} for camera in rig.cameras]
    doubted = Counter(assumed).most_common(1)[0][0]
    if doubted:
        lines.append(
            f"defaults: {flow(_names(doubted))}   # the paper's, as nothing told yours; delete what"
            " you have checked"
        )
    if rig.grid:
        lines.append(f"grid: {flow(asdict(rig.grid))}")
    if rig.sequence:
        lines.append("sequence: true   # the cameras are in shooting order")
    lines.append("cameras:   # position in metres; orientation x, y, z, w of the optical frame")
    for camera, own_lens, own in zip(rig.cameras, lenses, assumed, strict=True):
        values = _camera_values(camera, intrinsics, _written(own_lens, lens))
        if own != doubted - _given(values):
            values["defaults"] = _names(own)
        lines.append(f"  - {flow(values)}")
    return "\n".join(lines) + "\n"


def save_rig(rig: Rig, path: Path) -> None:
    """Write rig.yaml atomically.

    Raises
    ------
    InputError
        If it cannot be written.
    """
    with atomic_write(path) as file:
        file.write(rig_to_yaml(rig).encode())


def lens_from_values(
    where: str,
    values: Values,
    intrinsics: CameraIntrinsics | None = None,
    doubted: Collection[str] = (),
) -> Lens:
    """Return the lens with these values, the paper's where they are missing.

    Parameters
    ----------
    where : str
        The values' name in errors.
    values : mapping
        Lens's attributes; ``f_number`` may replace ``hyperfocal_distance``. If it has no
        ``circle_of_confusion``, that is assumed: see :mod:`focus_planner.core.rig.circles`.
    intrinsics : CameraIntrinsics, optional
        Of its camera; the default if they are not known yet.
    doubted : collection of str
        As for :func:`~focus_planner.core.rig.defaults.assumed_values`.

    Raises
    ------
    InputError
        If ``f_number`` and ``hyperfocal_distance`` are given, ``circle_of_confusion`` has neither
        beside it, or a value is out of range.
    """
    f_number, circle = values.get("f_number"), values.get("circle_of_confusion")
    if f_number is not None and "hyperfocal_distance" in values:
        raise InputError(where, "either hyperfocal_distance or f_number", "both")
    if circle is not None and f_number is None and "hyperfocal_distance" not in values:
        raise InputError(
            where, "f_number or hyperfocal_distance with circle_of_confusion", "neither"
        )
    lens = Lens(**{key: value for key, value in values.items() if key != "f_number"})
    if f_number is None:
        return lens
    told = FOCAL_LENGTH not in assumed_values(values, {}, doubted)
    image = intrinsics or CameraIntrinsics()
    return lens_of_aperture(lens, f_number, circle, image, focal_length_told=told)


def _check_names(where: str, entries: list[Any]) -> None:
    """Raise if a camera cannot be called what it is, with a name that no other has."""
    named = [(i, each["name"]) for i, each in enumerate(entries) if _has_name(each)]
    taken = {name for _, name in named if isinstance(name, str)}
    for i, name in named:
        with errors_within(f"{where}[{i}]"):
            check_camera_name(name, taken)


def _has_name(entry: Any) -> bool:
    return isinstance(entry, dict) and "name" in entry


def _camera(path: str, index: int, entry: Any, shared: _Optics) -> tuple[Camera, _Optics]:
    """Return a camera, and the values given for its image and lens."""
    where = f"{path}: cameras[{index}]"
    data = mapping(where, entry, _CAMERA_KEYS)
    for key in ("name", "position", "orientation"):
        if key not in data:
            raise InputError(f"{where}.{key}", "a value", "none")
    own_image = _values(f"{where}.image", data.get("image", {}), _IMAGE_KEYS)
    own_lens = _values(f"{where}.lens", data.get("lens", {}), _LENS_KEYS)
    image = {**shared.image, **own_image}
    if "fx" in image:
        image.setdefault("fy", image["fx"])  # square pixels, unless it says otherwise
    own = {"image": own_image, "lens": own_lens}
    doubted = (
        _doubted(f"{where}.defaults", data["defaults"])
        if "defaults" in data
        else shared.doubted - _given(own)
    )
    lens = {**_without_replaced(shared.lens, own_lens), **own_lens}
    optics = _Optics(image, lens, doubted)
    name = data["name"]
    with errors_within(where):
        x, y, z = vector(f"{where}.position", data["position"], 3)
        qx, qy, qz, qw = vector(f"{where}.orientation", data["orientation"], 4)
    with errors_within(path), errors_within(f"camera {name}"):
        intrinsics = CameraIntrinsics(**optics.image)
        camera = Camera(
            name=name,
            position=(x, y, z),
            orientation=(qx, qy, qz, qw),
            intrinsics=intrinsics,
            lens=lens_from_values(f"camera {name}: lens", lens, intrinsics, doubted),
        )
    return camera, optics


def _without_replaced(shared: Values, own: Values) -> Values:
    """Return the shared values without those that the camera's own replace in another form."""
    replaced: set[str] = set()
    for one, other in _ALTERNATIVES:
        for form, instead in ((one, other), (other, one)):
            if any(own.get(key) is not None for key in instead):
                replaced |= set(form)
    return {key: value for key, value in shared.items() if key not in replaced}


def _given(values: Values) -> frozenset[str]:
    """Return the keys of what a camera gives of its image and lens."""
    return frozenset(f"{kind}.{name}" for kind in KINDS for name in values.get(kind, ()))


def _doubted(where: str, listed: Any) -> frozenset[str]:
    names = listed if isinstance(listed, list) else ()
    unknown = [name for name in names if not (isinstance(name, str) and name in _DEFAULTS)]
    if unknown or not isinstance(listed, list):
        remedy = did_you_mean(key_name(unknown[0]), _DEFAULTS) if unknown else ""
        raise InputError(where, "a list of " + ", ".join(_DEFAULTS), kind_of(listed), remedy)
    return frozenset[str]().union(*(_DEFAULTS[name] for name in listed))


def _names(keys: frozenset[str]) -> tuple[str, ...]:
    """Return the shortest list that names the keys under ``defaults``."""
    whole = [kind for kind in KINDS if keys_of(kind) <= keys]
    single = keys.difference(*(keys_of(kind) for kind in whole))
    return tuple(sorted([*whole, *single]))


def _grid(where: str, top: Values) -> Grid | None:
    if top.get("grid") is None:
        return None
    values = _values(where, top["grid"], _GRID_KEYS)
    for key in _GRID_KEYS:
        if key not in values:
            raise InputError(f"{where}.{key}", "a value", "none")
    return Grid(**values)


def _sequence(where: str, top: Values) -> bool:
    given = top.get("sequence", False)
    if not isinstance(given, bool):
        raise InputError(where, "true or false", abbreviated(given))
    return given


def _values(where: str, data: Any, keys: tuple[str, ...]) -> Values:
    return {
        key: _READERS.get(key, number)(f"{where}.{key}", value)
        for key, value in mapping(where, data, keys).items()
    }


def _optional(read: _Reader) -> _Reader:
    return lambda where, value: None if value is None else read(where, value)


def _text(where: str, value: Any) -> str:
    if not isinstance(value, str):
        raise InputError(where, "a name", abbreviated(value))
    return value


_READERS = {
    "circle_of_confusion": _optional(number),
    "focus_distances": _optional(numbers),
    "focus_steps": _optional(number),
    "table": _optional(lens_table_from_values),
    "distortion_model": _text,
    "distortion": _optional(numbers),
    "binning": _optional(numbers),
    "region": _optional(numbers),
}


def _camera_values(
    camera: Camera, intrinsics: CameraIntrinsics, lens: Mapping[str, Any]
) -> dict[str, Any]:
    values = {
        "name": camera.name,
        "position": camera.position,
        "orientation": camera.orientation,
        "image": _differing(camera.intrinsics, intrinsics),
        "lens": lens,
    }
    return {key: value for key, value in values.items() if value}


def _lens_values(camera: Camera, assumed: Collection[str]) -> dict[str, Any]:
    """Return the values of a camera's lens: with its f-number if its circle was assumed.

    Reading them, the circle is assumed again, and so stays one that nobody told.
    """
    lens = camera.lens
    values = {field.name: getattr(lens, field.name) for field in fields(lens)}
    if CIRCLE not in assumed:
        return values
    told = FOCAL_LENGTH not in assumed
    circle = assumed_circle(camera.intrinsics, lens.focal_length, focal_length_told=told).metres
    f_number = f_number_of(lens)
    if lens.circle_of_confusion != circle or f_number is None:
        return values
    del values["hyperfocal_distance"]
    return values | {"f_number": f_number, "circle_of_confusion": None}


def _written(values: Mapping[str, Any], shared: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values of a lens that differ from the shared ones, as rig.yaml has them."""
    differing = {
        key: value for key, value in values.items() if key not in shared or value != shared[key]
    }
    if differing.get("table") is not None:
        differing["table"] = lens_table_values(differing["table"])
    return differing


def _image_values(intrinsics: CameraIntrinsics) -> dict[str, Any]:
    """Return size and pinhole parameters, and any other values that are not the defaults."""
    plain = CameraIntrinsics(
        intrinsics.width,
        intrinsics.height,
        intrinsics.fx,
        intrinsics.fy,
        intrinsics.cx,
        intrinsics.cy,
    )
    pinhole = {key: value for key, value in asdict(intrinsics).items() if key in _PINHOLE_KEYS}
    return pinhole | _differing(intrinsics, plain)


def _differing(own: CameraIntrinsics, shared: CameraIntrinsics) -> dict[str, Any]:
    """Return the values that differ from the shared ones."""
    return {
        field.name: getattr(own, field.name)
        for field in fields(own)
        if getattr(own, field.name) != getattr(shared, field.name)
    }
