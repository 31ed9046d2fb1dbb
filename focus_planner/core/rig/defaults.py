"""Notes on cameras whose lens or image nothing tells."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from focus_planner.core.notes import Note
from focus_planner.core.rig.camera import CameraIntrinsics
from focus_planner.core.rig.lens import Lens

_LENS, _IMAGE = Lens(), CameraIntrinsics()
# What has to be told, each with the keys of which one tells it.
_LENS_VALUES = (
    (f"focal length {1e3 * _LENS.focal_length:g} mm", ("focal_length",)),
    (
        f"hyperfocal distance {_LENS.hyperfocal_distance:g} m",
        ("hyperfocal_distance", "f_number"),
    ),
)
_IMAGE_VALUES = tuple(
    (f"{name} {getattr(_IMAGE, name):g} pixels", (name,))
    for name in ("width", "height", "fx", "fy", "cx", "cy")
)


@dataclass(frozen=True)
class Described:
    """What is said of one camera: the names of the values that somebody has given."""

    lens: Collection[str]
    image: Collection[str]


def described(
    lens: Mapping[str, Any], image: Mapping[str, Any], doubted: Collection[str]
) -> Described:
    """Return what the values given for a camera say.

    Parameters
    ----------
    lens, image : mapping
        Values by name; those of a lens may include its ``f_number``.
    doubted : collection of {"lens", "image"}
        Of which a value that equals the default says nothing.
    """

    def said(values: Mapping[str, Any], default: Any, kind: str) -> set[str]:
        return {
            name
            for name, value in values.items()
            if kind not in doubted or value != getattr(default, name, None)
        }

    return Described(said(lens, _LENS, "lens"), said(image, _IMAGE, "image"))


def notes_on_defaults(cameras: Iterable[Described], lens: str, image: str) -> tuple[Note, ...]:
    """Return the notes ``default_lens`` and ``default_image``, as far as they apply.

    Parameters
    ----------
    cameras : iterable of Described
        All cameras of a rig.
    lens, image : str
        What to do to describe them, as a clause.
    """
    cameras = tuple(cameras)
    lenses = (tuple(_lacking(_LENS_VALUES, camera.lens)) for camera in cameras)
    images = (tuple(_lacking(_IMAGE_VALUES, camera.image)) for camera in cameras)
    return (*_note("lens", tuple(lenses), lens), *_note("image", tuple(images), image))


def _lacking(
    values: tuple[tuple[str, tuple[str, ...]], ...], said: Collection[str]
) -> Iterator[str]:
    return (text for text, names in values if not any(name in said for name in names))


def _note(kind: str, lacking: tuple[tuple[str, ...], ...], remedy: str) -> Iterator[Note]:
    count = sum(map(bool, lacking))
    if not count:
        return
    *values, last = dict.fromkeys(text for texts in lacking for text in texts)
    assumed = f"{', '.join(values)} and {last} are" if values else f"{last} is"
    yield Note(
        f"default_{kind}",
        f"nothing tells the {kind} of {count} of {len(lacking)} cameras: {assumed} assumed, as in"
        f" the paper, and the plan holds for nothing else; {remedy}",
    )
