# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""YAML files with the lens tables of a studio's cameras."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from itertools import islice
from os import PathLike
from pathlib import Path
from typing import Any

from focus_planner.core.brief import brief_repr
from focus_planner.core.rig.camera import Camera
from focus_planner.core.rig.lens_table import LensTable
from focus_planner.core.rig.rig import Rig
from focus_planner.core.text import did_you_mean
from focus_planner.core.validation import InputError, first_few
from focus_planner.io.files import read_text
from focus_planner.io.quoting import abbreviated, kind_of
from focus_planner.io.yaml_values import (
    Values,
    errors_within,
    mapping,
    numbers,
    read_yaml,
)

# Cameras of 20,000 with a table of a few entries each.
_MAX_BYTES, _MAX_NODES = 8 << 20, 400_000
# Names among which the one that was meant is looked for: it takes a while for every pair.
_MAX_SIMILAR = 50
_FILE_KEYS = ("default", "cameras")
_TABLE_KEYS = tuple(field.name for field in fields(LensTable))


@dataclass(frozen=True)
class LensTables:
    """Lens tables by camera name.

    Attributes
    ----------
    cameras : mapping of str to LensTable
    default : LensTable or None
        For all other cameras.
    text : str
        The text of the file.
    where : str
        The file's name in errors.
    """

    cameras: Mapping[str, LensTable]
    default: LensTable | None = None
    text: str = field(default="", compare=False)
    where: str = field(default="lens tables", compare=False)

    __repr__ = brief_repr

    def apply(self, rig: Rig) -> Rig:
        """Return the rig with these tables for the cameras that have none of their own.

        Names that the rig does not have are ignored, so that one file serves all rigs of a
        studio.

        Raises
        ------
        InputError
            If the file names cameras but the rig has none of them, or a table contradicts its
            camera's lens.
        """
        self._check_names([camera.name for camera in rig.cameras])
        return replace(rig, cameras=tuple(map(self._with_table, rig.cameras)))

    def table_of(self, camera: str) -> LensTable | None:
        """Return a camera's table, by name; None if it has none."""
        return self.cameras.get(camera, self.default)

    def _with_table(self, camera: Camera) -> Camera:
        table = self.table_of(camera.name)
        if table is None or camera.lens.table is not None:
            return camera
        with errors_within(f"{self.where}: camera {camera.name}"):
            return replace(camera, lens=replace(camera.lens, table=table))

    def _check_names(self, names: list[str]) -> None:
        if not self.cameras or not self.cameras.keys().isdisjoint(names):
            return
        listed = islice(self.cameras, _MAX_SIMILAR)
        remedies = (did_you_mean(name, names[:_MAX_SIMILAR]) for name in listed)
        raise InputError(
            f"{self.where}: cameras",
            f"some of the rig's {len(names)}: {first_few(names, 3)}",
            first_few(self.cameras, 3),
            next(filter(None, remedies), ""),
        )


def load_lens_tables(path: str | PathLike[str]) -> LensTables:
    """Read lens tables from a file; see :func:`lens_tables_from_yaml`.

    Raises
    ------
    InputError
        If the file is invalid; names the file, the camera, the key, and the key probably meant.
    """
    text = read_text(Path(path), "lens tables (YAML)", _MAX_BYTES)
    return lens_tables_from_yaml(text, str(path))


def lens_tables_from_yaml(text: str, where: str) -> LensTables:
    """Return the lens tables in a YAML text: ``cameras`` by name, and a ``default`` for others.

    A table has the keys of :class:`~focus_planner.core.rig.lens_table.LensTable`::

        default: {unit: dioptres}
        cameras:
          cam_0_00: {unit: focus_absolute, whole: true, distances: [0.3, 3], values: [250, 20]}

    Parameters
    ----------
    text : str
    where : str
        The text's name in errors.

    Raises
    ------
    InputError
        As :func:`load_lens_tables`.
    """
    top = mapping(where, read_yaml(where, text, _MAX_NODES), _FILE_KEYS, prefix=f"{where}: ")
    cameras = top.get("cameras", {})
    if not isinstance(cameras, dict):
        raise InputError(f"{where}: cameras", "a table for each camera's name", kind_of(cameras))
    default = top.get("default")
    if not cameras and default is None:
        raise InputError(where, "tables of cameras, or a default", "neither")
    for name in cameras:
        if not isinstance(name, str):
            raise InputError(f"{where}: cameras", "names", abbreviated(name), "put it in quotes")
    return LensTables(
        {
            name: lens_table_from_values(f"{where}: cameras.{name}", table)
            for name, table in cameras.items()
        },
        None if default is None else lens_table_from_values(f"{where}: default", default),
        text,
        where,
    )


def lens_table_from_values(where: str, data: Any) -> LensTable:
    """Return the lens table in a YAML mapping.

    Parameters
    ----------
    where : str
        The mapping's name in errors.
    data : object

    Raises
    ------
    InputError
        If a key is unknown, or the values do not form a table.
    """
    values = dict(mapping(where, data, _TABLE_KEYS))
    if "unit" not in values:
        raise InputError(f"{where}.unit", "a value", "none")
    for key in ("distances", "values"):
        if key in values:
            values[key] = numbers(f"{where}.{key}", values[key])
    with errors_within(where):
        return LensTable(**values)


def lens_table_values(table: LensTable) -> Values:
    """Return the values that :func:`lens_table_from_values` reads."""
    values = {key: getattr(table, key) for key in _TABLE_KEYS}
    return {key: value for key, value in values.items() if value}
