# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What the surfaces of a gltf file look like: colours of vertices, base colours, their textures.

See the glTF 2.0 specification: materials (3.9), textures (3.8). Colours of vertices and factors are
in proportion to light; images are sRGB.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any, NamedTuple
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from focus_planner.core.arrays import FloatArray
from focus_planner.core.notes import Note
from focus_planner.core.surface.appearance import Colours, Texture
from focus_planner.io.files import BrokenFileError
from focus_planner.io.formats.colours import colours_from_linear, linear_from_colours
from focus_planner.io.formats.gltf_buffers import Gltf, bytes_in_uri
from focus_planner.io.formats.textures import (
    Wrapped,
    image_beside,
    image_of,
    looks_or_note,
    texture_of,
)

_TRANSFORM = "KHR_texture_transform"
_CLAMPED, _MIRRORED = 33071, 33648
_WHITE = (1.0, 1.0, 1.0)


class Look(NamedTuple):
    """What a primitive looks like.

    Attributes
    ----------
    plain : (3,) array of uint8
        Its colour where nothing else is known.
    colours : (n, 3) array of uint8, optional
        Of its vertices.
    image : int
        Which of the images covers it; -1 for none.
    coordinates : (n, 2) array, optional
        Where in that image its vertices are, as :class:`Texture` has it.
    """

    plain: Colours
    colours: Colours | None = None
    image: int = -1
    coordinates: FloatArray | None = None


class Looks:
    """The images of a gltf file, each read once; and notes on those that cannot be.

    Parameters
    ----------
    gltf : Gltf
    """

    def __init__(self, gltf: Gltf) -> None:
        self._gltf = gltf
        self._numbers: dict[tuple[Any, ...], int] = {}
        self._images = list[Colours]()
        self.notes = list[Note]()

    def of(
        self, primitive: dict[str, Any], of_draco: Mapping[str, NDArray[Any]], count: int
    ) -> Look:
        """Return what a primitive of so many vertices looks like."""
        plain = Look(colours_from_linear(np.ones(3)))
        look: Look = looks_or_note(
            self._gltf.path,
            "the colours or the texture",
            lambda: self._look(primitive, of_draco, count),
            self.notes,
            plain,
        )
        return look

    def together(
        self, looks: Sequence[Look], triangles: Sequence[NDArray[np.int64]], counts: Sequence[int]
    ) -> tuple[Colours | None, Texture | None]:
        """Return the colours of vertices, or the texture, of several primitives as one mesh.

        Parameters
        ----------
        looks : sequence of Look
        triangles : sequence of (T, 3) arrays
            Of each, by its own vertices.
        counts : sequence of int
            How many vertices each has.
        """
        if any(look.image >= 0 for look in looks):
            parts = [_wrapped(*each) for each in zip(looks, triangles, strict=True)]
            images, places, plain = (np.concatenate(each) for each in zip(*parts, strict=True))
            return None, texture_of(self._images, Wrapped(images, places, plain))
        white = all(look.colours is None and (look.plain == 255).all() for look in looks)
        if white:
            return None, None
        colours = [
            np.tile(look.plain, (count, 1)) if look.colours is None else look.colours
            for look, count in zip(looks, counts, strict=True)
        ]
        return np.concatenate(colours), None

    def _look(
        self, primitive: dict[str, Any], of_draco: Mapping[str, NDArray[Any]], count: int
    ) -> Look:
        material: dict[str, Any] = {}
        if "material" in primitive:
            material = self._gltf.item("materials", primitive["material"])
        base = material.get("pbrMetallicRoughness", {})
        factor = tuple(float(x) for x in base.get("baseColorFactor", _WHITE)[:3])
        if len(factor) != len(_WHITE):
            raise BrokenFileError("a colour of less than three numbers")
        look = Look(colours_from_linear(np.array(factor)))
        if "COLOR_0" in primitive["attributes"]:
            values = _in_units(self._attribute("COLOR_0", primitive, of_draco, count))
            look = look._replace(colours=colours_from_linear(values[:, :3] * factor))
        if "baseColorTexture" not in base:
            return look
        covered: Look = looks_or_note(
            self._gltf.path,
            "the texture",
            lambda: self._covered(look, base["baseColorTexture"], factor, primitive, of_draco),
            self.notes,
            look,
        )
        return covered

    def _covered(
        self,
        look: Look,
        info: dict[str, Any],
        factor: tuple[float, ...],
        primitive: dict[str, Any],
        of_draco: Mapping[str, NDArray[Any]],
    ) -> Look:
        """Return the look with the image that covers the primitive."""
        transform = info.get("extensions", {}).get(_TRANSFORM, {})
        name = f"TEXCOORD_{transform.get('texCoord', info.get('texCoord', 0))}"
        count = self._gltf.item("accessors", primitive["attributes"]["POSITION"])["count"]
        places = _in_units(self._attribute(name, primitive, of_draco, count))[:, :2]
        texture = self._gltf.item("textures", info["index"])
        places = _transformed(places.astype(np.float64), transform)
        sampler = {}
        if "sampler" in texture:
            sampler = self._gltf.item("samplers", texture["sampler"])
        for axis, key in enumerate(("wrapS", "wrapT")):
            places[:, axis] = _wrapped_axis(places[:, axis], sampler.get(key))
        places[:, 1] = 1 - places[:, 1]  # from the bottom
        return look._replace(image=self._image(texture, factor), coordinates=places)

    def _attribute(
        self, name: str, primitive: dict[str, Any], of_draco: Mapping[str, NDArray[Any]], count: int
    ) -> NDArray[Any]:
        if name in of_draco:
            values = of_draco[name]
        else:
            values = self._gltf.accessor(primitive["attributes"][name])
        if len(values) != count or values.shape[1] < 2:
            raise BrokenFileError(f"{len(values)} rows of {name} for {count} vertices")
        return values

    def _image(self, texture: dict[str, Any], factor: tuple[float, ...]) -> int:
        """Return the number of a texture's image, times a factor."""
        extensions = texture.get("extensions", {})
        source = extensions.get("EXT_texture_webp", texture).get("source")
        if source is None:
            raise BrokenFileError("an image in a format that is not read")
        key = (int(source), factor)
        if key not in self._numbers:
            image = self._decoded(self._gltf.item("images", source))
            if factor != _WHITE:
                shades = linear_from_colours(np.arange(256, dtype=np.uint8))
                table = colours_from_linear(shades[:, None] * factor)
                image = np.stack([table[image[..., i], i] for i in range(3)], axis=-1)
            self._numbers[key] = len(self._images)
            self._images.append(image)
        return self._numbers[key]

    @cached_property
    def _covering(self) -> int:
        """How many images, times factors, the file's materials have."""
        bases = [each.get("pbrMetallicRoughness", {}) for each in self._gltf.items("materials")]
        return len(
            {
                repr((base["baseColorTexture"], base.get("baseColorFactor")))
                for base in bases
                if "baseColorTexture" in base
            }
        )

    def _decoded(self, image: dict[str, Any]) -> Colours:
        of = self._covering
        if "bufferView" in image:
            return image_of(self._gltf.view(image["bufferView"]), of)
        uri = str(image["uri"])
        if uri.startswith("data:"):
            return image_of(bytes_in_uri(uri, "an image"), of)
        return image_beside(self._gltf.path, unquote(uri), of)


def _wrapped(look: Look, triangles: NDArray[np.int64]) -> Wrapped:
    count = len(triangles)
    plain = np.tile(look.plain, (count, 1))
    if look.colours is not None:
        plain = np.rint(look.colours[triangles].mean(axis=1)).astype(np.uint8)
    if look.coordinates is None:
        return Wrapped(np.full(count, -1), np.zeros((count, 3, 2)), plain)
    return Wrapped(np.full(count, look.image), look.coordinates[triangles], plain)


def _in_units(values: NDArray[Any]) -> NDArray[Any]:
    """Return numbers of which whole ones should have been marked as normalized."""
    return values / np.iinfo(values.dtype).max if values.dtype.kind in "iu" else values


def _transformed(places: FloatArray, transform: dict[str, Any]) -> FloatArray:
    turn = float(transform.get("rotation", 0.0))
    scaled = places * np.array(transform.get("scale", (1.0, 1.0)), dtype=np.float64)
    cos, sin = math.cos(turn), math.sin(turn)
    turned = scaled @ np.array([[cos, -sin], [sin, cos]])
    moved: FloatArray = turned + np.array(transform.get("offset", (0.0, 0.0)), dtype=np.float64)
    return moved


def _wrapped_axis(values: FloatArray, mode: int | None) -> FloatArray:
    """Return coordinates in an image that repeats, for one that ends at its edge or is mirrored."""
    if mode == _CLAMPED:
        return np.clip(values, 0.0, 1.0)
    if mode == _MIRRORED:
        return 1 - np.abs(values % 2 - 1)
    return values
