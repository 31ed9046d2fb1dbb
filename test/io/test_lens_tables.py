# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

from __future__ import annotations

import math
from pathlib import Path

import pytest
from hypothesis import given

from focus_planner.core.rig.layouts import cylinder_rig
from focus_planner.core.rig.lens import Lens
from focus_planner.core.rig.lens_table import LensTable
from focus_planner.core.rig.rig import Rig
from focus_planner.core.validation import InputError
from focus_planner.io.lens_tables import (
    LensTables,
    lens_table_values,
    lens_tables_from_yaml,
    load_lens_tables,
)
from focus_planner.io.yaml_values import flow
from testing.messages import lens_tables

STUDIO = """
default: {unit: dioptres}
cameras:
  cam_0_00: {unit: focus_absolute, whole: true, distances: [0.3, 0.5, 1.0, 3.0],
             values: [250, 180, 90, 20], step: 5}
  cam_1_02: {unit: steps, distances: [5e-1, 1, .inf], values: [0, 1e3, 1500]}
  of_another_rig: {unit: m}
"""
COUNTED = LensTable("focus_absolute", True, (0.3, 0.5, 1.0, 3.0), (250, 180, 90, 20), 5)
STEPS = LensTable("steps", False, (0.5, 1.0, math.inf), (0, 1000, 1500))
RIG = cylinder_rig(2, 3)


def tables_of(rig: Rig) -> dict[str, LensTable | None]:
    return {camera.name: camera.lens.table for camera in rig.cameras}


def test_a_studios_file(tmp_path: Path) -> None:
    path = tmp_path / "lenses.yaml"
    path.write_text(STUDIO)
    tables = load_lens_tables(path)
    assert tables.cameras == {
        "cam_0_00": COUNTED,
        "cam_1_02": STEPS,
        "of_another_rig": LensTable("m"),
    }
    assert tables.default == LensTable("dioptres")
    assert (tables.text, tables.where) == (STUDIO, str(path))
    assert lens_tables_from_yaml(STUDIO, "elsewhere") == tables


def test_it_is_applied_to_the_cameras_of_a_rig() -> None:
    tables = lens_tables_from_yaml(STUDIO, "lenses.yaml")
    given_ = tables_of(tables.apply(RIG))
    assert (given_.pop("cam_0_00"), given_.pop("cam_1_02")) == (COUNTED, STEPS)
    assert set(given_.values()) == {LensTable("dioptres")}
    # All else stays as it was.
    assert {camera.lens.hyperfocal_distance for camera in tables.apply(RIG).cameras} == {10.0}
    assert tables.apply(RIG).grid == RIG.grid


def test_without_a_default_the_others_have_none() -> None:
    tables = LensTables({"cam_0_00": COUNTED})
    given_ = tables_of(tables.apply(RIG))
    assert given_.pop("cam_0_00") == COUNTED
    assert set(given_.values()) == {None}


def test_a_cameras_own_table_stays() -> None:
    own = LensTable("m")
    rig = cylinder_rig(2, 3, lens=Lens(table=own))
    assert lens_tables_from_yaml(STUDIO, "lenses.yaml").apply(rig) == rig


def test_a_file_of_another_rig_is_told() -> None:
    tables = LensTables({"cam_7_00": COUNTED, "x": STEPS}, LensTable("m"), where="lenses.yaml")
    with pytest.raises(
        InputError,
        match=r"^lenses.yaml: cameras: expected some of the rig's 6: cam_0_00, cam_0_01, cam_0_02"
        r" and 3 more, got cam_7_00, x; did you mean cam_\d_00\?$",
    ):
        tables.apply(RIG)
    with pytest.raises(InputError, match=r"cameras: .* more, got left$"):
        LensTables({"left": STEPS}).apply(RIG)
    assert tables_of(LensTables({}, STEPS).apply(RIG)) == {c.name: STEPS for c in RIG.cameras}


def test_a_table_that_contradicts_its_lens_is_told_with_the_camera() -> None:
    rig = cylinder_rig(2, 3, lens=Lens(min_focus=4.0))
    with pytest.raises(
        InputError, match=r"^lenses.yaml: camera cam_0_00: lens.table: expected distances from"
    ):
        lens_tables_from_yaml(STUDIO, "lenses.yaml").apply(rig)


@given(table=lens_tables())
def test_what_is_written_is_read(table: LensTable) -> None:
    text = f"cameras: {{a: {flow(lens_table_values(table))}}}"
    assert lens_tables_from_yaml(text, "a text").cameras == {"a": table}


def test_a_short_table_is_written_short() -> None:
    assert lens_table_values(LensTable("dioptres")) == {"unit": "dioptres"}
    assert list(lens_table_values(STEPS)) == ["unit", "distances", "values"]


@pytest.mark.parametrize(
    ("text", "telling"),
    [
        ("", "expected keys and values: default, cameras, got nothing"),
        ("- 1", "expected keys and values: default, cameras"),
        ("cameras: {{", r"expected YAML, got line \d"),
        ("{}", "expected tables of cameras, or a default, got neither"),
        ("cameras: {}", "expected tables of cameras, or a default, got neither"),
        ("camera: {a: {unit: m}}", "camera: expected one of .*did you mean cameras"),
        ("cameras: [a]", r"cameras: expected a table for each camera's name, got a list of 1"),
        ("cameras: {yes: {unit: m}}", "cameras: expected names, got True; put it in quotes"),
        ("cameras: {a: m}", "cameras.a: expected keys and values: unit, whole, .* got text"),
        ("cameras: {a: {units: m}}", r"cameras\.a\.units: .*did you mean unit\?"),
        ("cameras: {a: {whole: true}}", r"cameras\.a\.unit: expected a value, got none"),
        ("cameras: {a: {unit: 3}}", r"cameras\.a: table\.unit: expected a name .* got 3"),
        ("cameras: {a: {unit: m, whole: 1}}", r"cameras\.a: table\.whole: expected true or"),
        (
            "cameras: {a: {unit: s, distances: 3}}",
            r"cameras\.a\.distances: expected a list of numbers, got a number",
        ),
        (
            "cameras: {a: {unit: s, distances: [1, x], values: [1, 2]}}",
            r"cameras\.a\.distances\[1\]: expected a number, got 'x'",
        ),
        (
            "cameras: {a: {unit: s, distances: [1, 2], values: [1, 1]}}",
            r"cameras\.a: table\.values: expected strictly rising or strictly falling",
        ),
        ("default: {unit: s}", "default: table.distances: expected at least 2 with the unit s"),
        ("cameras: {a: {unit: m}, b: {unit: m},\n a: {unit: m}}", "line 2, .* duplicate key a"),
    ],
)
def test_a_bad_file_is_refused_where_it_is_bad(tmp_path: Path, text: str, telling: str) -> None:
    with pytest.raises(InputError, match=telling) as caught:
        lens_tables_from_yaml(text, "lenses.yaml")
    assert str(caught.value).startswith("lenses.yaml: ")
    assert "\n" not in str(caught.value)


def test_a_missing_file_is_told(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"none.yaml: expected lens tables \(YAML\), got no such"):
        load_lens_tables(tmp_path / "none.yaml")
