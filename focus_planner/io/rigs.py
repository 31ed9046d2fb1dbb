"""rig.yaml: the cameras of a rig, for people to write and programs to read."""

from __future__ import annotations

import difflib
import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import asdict, fields
from os import PathLike
from pathlib import Path
from typing import Any

import yaml

from focus_planner.core.checks import InputError
from focus_planner.core.optics import hyperfocal_distance
from focus_planner.core.types import Camera, Grid, Image, Lens, Rig
from focus_planner.io.files import whole_file
from focus_planner.io.yaml_values import load_yaml
from focus_planner.io.yaml_values import number as _number
from focus_planner.io.yaml_values import shown as _shown
from focus_planner.io.yaml_values import within as _within

_RIG_KEYS = ("frame_id", "image", "lens", "grid", "cameras")
_CAMERA_KEYS = ("name", "position", "orientation", "image", "lens")
_IMAGE_KEYS = tuple(field.name for field in fields(Image))
_PINHOLE_KEYS = ("width", "height", "fx", "fy", "cx", "cy")
_GRID_KEYS = tuple(field.name for field in fields(Grid))
_APERTURE_KEYS = ("f_number", "circle_of_confusion")
_LENS_KEYS = (*(field.name for field in fields(Lens)), *_APERTURE_KEYS)
# Keys that say the same in another form.
_FORMS = ((_APERTURE_KEYS, ("hyperfocal_distance",)), (("focus_distances",), ("focus_steps",)))

_Values = Mapping[str, Any]


def load_rig(path: str | PathLike[str]) -> Rig:
    """Read rig.yaml.

    ``image`` and ``lens`` hold for all cameras; a camera may override any of their keys. What is
    given nowhere is the paper's. A lens has a ``hyperfocal_distance``, or ``f_number`` and
    ``circle_of_confusion``; a camera that gives either replaces the shared one, and so with
    ``focus_distances`` and ``focus_steps``, of which null is neither. ``grid`` tells ``--tuples
    grid`` how the cameras stand.

    Raises
    ------
    InputError
        Names the file, the camera, the key, and a key that was probably meant.
    """
    path = Path(path)
    data = load_yaml(path, "a rig.yaml")
    top = _mapping(str(path), data, _RIG_KEYS, prefix=f"{path}: ")
    entries = top.get("cameras")
    if not isinstance(entries, list):
        raise InputError(f"{path}: cameras", "a list of cameras", _shown(entries))
    image = _values(f"{path}: image", top.get("image", {}), _IMAGE_KEYS)
    lens = _values(f"{path}: lens", top.get("lens", {}), _LENS_KEYS)
    with _within(str(path)):  # a fault that all cameras share is not the first one's
        Image(**image)
        lens_of(f"{path}: lens", lens)
    cameras = tuple(
        _camera(f"{path}: cameras[{i}]", entry, image, lens) for i, entry in enumerate(entries)
    )
    frame_id = top.get("frame_id", "world")
    if not isinstance(frame_id, str):
        raise InputError(f"{path}: frame_id", "a name", _shown(frame_id))
    with _within(str(path)):
        return Rig(cameras, frame_id, _grid(f"{path}: grid", top))


def rig_to_yaml(rig: Rig) -> str:
    """Return a rig as the text of rig.yaml; reading it back gives the same rig, bit for bit.

    What most cameras share stands at the top, one camera a line below.
    """
    image = Counter(camera.image for camera in rig.cameras).most_common(1)[0][0]
    lens = Counter(camera.lens for camera in rig.cameras).most_common(1)[0][0]
    told = {"focal_length": lens.focal_length, "hyperfocal_distance": lens.hyperfocal_distance}
    lines = [
        f"frame_id: {_scalar(rig.frame_id)}",
        f"image: {_flow(_image_values(image))}   # pixels",
        f"lens: {_flow(told | _beyond(lens, Lens()))}   # metres",
    ]
    if rig.grid:
        lines.append(f"grid: {_flow(asdict(rig.grid))}")
    lines.append("cameras:   # position in metres; orientation x, y, z, w of the optical frame")
    lines.extend(f"  - {_flow(_camera_values(camera, image, lens))}" for camera in rig.cameras)
    return "\n".join(lines) + "\n"


def save_rig(rig: Rig, path: Path) -> None:
    """Write rig.yaml, whole or not at all.

    Raises
    ------
    InputError
        If it cannot be written.
    """
    with whole_file(path) as file:
        file.write(rig_to_yaml(rig).encode())


def lens_of(where: str, values: _Values) -> Lens:
    """Return the lens that has these values; what is not among them is the paper's.

    Parameters
    ----------
    where : str
        What the values are called in errors.
    values : mapping
        Keys are Lens's, or ``f_number`` and ``circle_of_confusion`` for ``hyperfocal_distance``.

    Raises
    ------
    InputError
        If both forms of blur are there, or half of one, or a value is out of range.
    """
    aperture = [values[key] for key in _APERTURE_KEYS if key in values]
    if aperture and "hyperfocal_distance" in values:
        raise InputError(
            where, "hyperfocal_distance, or f_number and circle_of_confusion", "values of both"
        )
    if len(aperture) == 1:
        raise InputError(where, "f_number and circle_of_confusion together", "only one of them")
    own = {key: value for key, value in values.items() if key not in _APERTURE_KEYS}
    if aperture:
        focal_length = own.get("focal_length", Lens().focal_length)
        own["hyperfocal_distance"] = hyperfocal_distance(focal_length, *aperture)
    return Lens(**own)


def _camera(where: str, entry: Any, image: _Values, shared: _Values) -> Camera:
    data = _mapping(where, entry, _CAMERA_KEYS)
    for key in ("name", "position", "orientation"):
        if key not in data:
            raise InputError(f"{where}.{key}", "a value", "none")
    own_image = _values(f"{where}.image", data.get("image", {}), _IMAGE_KEYS)
    own_lens = _values(f"{where}.lens", data.get("lens", {}), _LENS_KEYS)
    with _within(where):
        x, y, z = _vector(f"{where}.position", data["position"], 3)
        qx, qy, qz, qw = _vector(f"{where}.orientation", data["orientation"], 4)
        return Camera(
            name=data["name"],
            position=(x, y, z),
            orientation=(qx, qy, qz, qw),
            image=Image(**{**image, **own_image}),
            lens=lens_of(f"{where}.lens", {**_not_replaced(shared, own_lens), **own_lens}),
        )


def _not_replaced(shared: _Values, own: _Values) -> _Values:
    """Return the shared values without those that the camera says in another form."""
    replaced: set[str] = set()
    for one, other in _FORMS:
        for form, instead in ((one, other), (other, one)):
            if any(own.get(key) is not None for key in instead):
                replaced |= set(form)
    return {key: value for key, value in shared.items() if key not in replaced}


def _grid(where: str, top: _Values) -> Grid | None:
    if top.get("grid") is None:
        return None
    values = _values(where, top["grid"], _GRID_KEYS)
    for key in _GRID_KEYS:
        if key not in values:
            raise InputError(f"{where}.{key}", "a value", "none")
    return Grid(**values)


def _values(where: str, data: Any, keys: tuple[str, ...]) -> _Values:
    return {
        key: _READERS.get(key, _number)(f"{where}.{key}", value)
        for key, value in _mapping(where, data, keys).items()
    }


def _mapping(where: str, data: Any, keys: tuple[str, ...], prefix: str = "") -> _Values:
    if not isinstance(data, dict):
        raise InputError(where, "keys and values: " + ", ".join(keys), _shown(data))
    for key in data:
        if key not in keys:
            close = difflib.get_close_matches(str(key), keys, n=1)
            raise InputError(
                f"{prefix or where + '.'}{key}",
                "one of the keys " + ", ".join(keys),
                "an unknown one",
                f"did you mean {close[0]}?" if close else "",
            )
    return data


def _vector(where: str, data: Any, length: int) -> list[float]:
    if not isinstance(data, list) or len(data) != length:
        raise InputError(where, f"a list of {length} numbers", _shown(data))
    return [_number(f"{where}[{i}]", value) for i, value in enumerate(data)]


def _numbers(where: str, value: Any) -> tuple[Any, ...] | None:
    if value is None:
        return None
    if not isinstance(value, list):
        raise InputError(where, "a list of numbers", _shown(value))
    return tuple(_number(f"{where}[{i}]", number) for i, number in enumerate(value))


def _text(where: str, value: Any) -> str:
    if not isinstance(value, str):
        raise InputError(where, "a name", _shown(value))
    return value


def _number_or_none(where: str, value: Any) -> Any:
    return None if value is None else _number(where, value)


_READERS = {
    "focus_distances": _numbers,
    "focus_steps": _number_or_none,
    "distortion_model": _text,
    "distortion": _numbers,
    "binning": _numbers,
    "region": _numbers,
}


def _camera_values(camera: Camera, image: Image, lens: Lens) -> dict[str, Any]:
    values = {
        "name": camera.name,
        "position": camera.position,
        "orientation": camera.orientation,
        "image": _beyond(camera.image, image),
        "lens": _beyond(camera.lens, lens),
    }
    return {key: value for key, value in values.items() if value}


def _image_values(image: Image) -> dict[str, Any]:
    """Return size and intrinsics, and what else is not as in a plain image."""
    plain = Image(image.width, image.height, image.fx, image.fy, image.cx, image.cy)
    pinhole = {key: value for key, value in asdict(image).items() if key in _PINHOLE_KEYS}
    return pinhole | _beyond(image, plain)


def _beyond(own: Image | Lens, shared: Image | Lens) -> dict[str, Any]:
    """Return the values that are not the shared ones."""
    others = asdict(shared)
    return {key: value for key, value in asdict(own).items() if value != others[key]}


def _flow(value: Any) -> str:
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key}: {_flow(item)}" for key, item in value.items()) + "}"
    if isinstance(value, tuple):
        return "[" + ", ".join(map(_flow, value)) + "]"
    return _scalar(value)


def _scalar(value: str | float | None) -> str:
    """Return a scalar as YAML, quoted or pointed where it would be read as something else."""
    if isinstance(value, float) and math.isfinite(value):
        text = repr(value)
        return text if "." in text else text.replace("e", ".0e")
    return yaml.safe_dump(value, width=1_000_000).removesuffix("...\n").rstrip("\n")
