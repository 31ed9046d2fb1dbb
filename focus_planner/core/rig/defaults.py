# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Notes on cameras whose lens or image nothing tells."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from typing import Any

from focus_planner.core.notes import Note
from focus_planner.core.rig.camera import CameraIntrinsics
from focus_planner.core.rig.lens import Lens
from focus_planner.core.text import how_many

_DEFAULTS = {"lens": Lens(), "image": CameraIntrinsics()}
# What has to be told, by the key that tells it.
_VALUES = {
    "lens.focal_length": f"focal length {1e3 * Lens().focal_length:g} mm",
    "lens.hyperfocal_distance": f"hyperfocal distance {Lens().hyperfocal_distance:g} m",
    **{
        f"image.{name}": f"{name} {getattr(CameraIntrinsics(), name):g} pixels"
        for name in ("width", "height", "fx", "fy", "cx", "cy")
    },
}
_OTHER_FORMS = {"lens.f_number": "lens.hyperfocal_distance"}
#: The key of the focal length.
FOCAL_LENGTH = "lens.focal_length"
#: What of a camera has to be told.
KINDS = tuple(_DEFAULTS)


def keys_of(kind: str) -> frozenset[str]:
    """Return the keys that have to be told of a ``lens`` or an ``image``, as in ``image.fx``."""
    return frozenset(key for key in _VALUES if key.startswith(f"{kind}."))


def told_by(names: Iterable[str]) -> frozenset[str]:
    """Return the keys that values of these names tell, as in ``lens.f_number``."""
    return frozenset(_OTHER_FORMS.get(name, name) for name in names) & _VALUES.keys()


def assumed_values(
    lens: Mapping[str, Any], image: Mapping[str, Any], doubted: Collection[str] = ()
) -> frozenset[str]:
    """Return the keys of a camera that nothing tells.

    Parameters
    ----------
    lens, image : mapping
        Values by name; those of a lens may include its ``f_number``.
    doubted : collection of str
        The keys of which a value that equals the default says nothing.
    """
    given = {
        f"{kind}.{name}": value
        for kind, values in (("lens", lens), ("image", image))
        for name, value in values.items()
    }
    said = {
        _OTHER_FORMS.get(key, key)
        for key, value in given.items()
        if key not in doubted or value != _default(key)
    }
    return frozenset(_VALUES.keys() - said)


def _default(key: str) -> Any:
    kind, name = key.split(".")
    return getattr(_DEFAULTS[kind], name)


def notes_on_defaults(
    assumed: Iterable[Collection[str]], lens: str, image: str
) -> tuple[Note, ...]:
    """Return the notes ``default_lens`` and ``default_image``, as far as they apply.

    Parameters
    ----------
    assumed : iterable of collections of str
        For every camera of a rig the keys that nothing tells.
    lens, image : str
        What to do to describe them, as a clause.
    """
    cameras = tuple(assumed)
    return (*_note("lens", cameras, lens), *_note("image", cameras, image))


def _note(kind: str, assumed: tuple[Collection[str], ...], remedy: str) -> Iterator[Note]:
    keys = keys_of(kind)
    count = sum(not keys.isdisjoint(each) for each in assumed)
    if not count:
        return
    some = frozenset[str]().union(*assumed)
    *values, last = (text for key, text in _VALUES.items() if key in keys & some)
    told = f"{', '.join(values)} and {last} are" if values else f"{last} is"
    yield Note(
        f"default_{kind}",
        f"nothing tells the {kind} of {how_many(count, len(assumed))}: {told} assumed, as in"
        f" the paper, and the plan holds for nothing else; {remedy}",
    )
