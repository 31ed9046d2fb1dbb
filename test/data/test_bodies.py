# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The bodies of the evaluation, and what their page says of them."""

from __future__ import annotations

import re

import numpy as np
import pytest

from focus_planner import load_surface
from focus_planner.core.surface.scene import Scene
from focus_planner.io.bodies import bodies as bodies_of_the_package
from testing.pages import ROOT

FOLDER = ROOT / "data" / "bodies"
PAGE = (FOLDER / "README.md").read_text(encoding="utf-8")
ROW = re.compile(
    r"(?m)^\| `(?P<file>\w+\.ply)` \| (?P<top>[\d.]+) m \| (?P<reach>[\d.]+) m "
    r"\| (?P<area>[\d.]+) m² \|(?: `(?P<twin>\w+\.ply)`)? \|$"
)
ROWS = {row["file"]: row for row in ROW.finditer(PAGE)}
HALF_A_HUNDREDTH = 0.00501


@pytest.fixture(scope="module")
def surfaces():
    return {path.name: load_surface(path) for path in sorted(FOLDER.glob("*.ply"))}


@pytest.fixture(scope="module")
def areas(surfaces):
    return {name: Scene(surface).area for name, surface in surfaces.items()}


def test_the_page_names_twelve_bodies_and_no_others(surfaces):
    assert list(ROWS) == list(surfaces) == [f"body_{k:02}.ply" for k in range(12)]


def test_they_stand_in_the_middle_and_are_as_large_as_the_page_says(surfaces):
    for name, surface in surfaces.items():
        low, high = surface.vertices.min(0), surface.vertices.max(0)
        assert low[2] == 0, name
        assert low[:2] + high[:2] == pytest.approx(0, abs=1e-6), name
        assert high[2] == pytest.approx(float(ROWS[name]["top"]), abs=HALF_A_HUNDREDTH), name
        reach = np.hypot(*surface.vertices[:, :2].T).max()
        assert reach == pytest.approx(float(ROWS[name]["reach"]), abs=HALF_A_HUNDREDTH), name


def test_their_areas_are_those_of_the_page(areas):
    for name, area in areas.items():
        assert area == pytest.approx(float(ROWS[name]["area"]), abs=HALF_A_HUNDREDTH), name
    said = re.search(r"Surface area ([\d.]+) ± ([\d.]+) m²", PAGE)
    all_areas = list(areas.values())
    found = np.mean(all_areas), np.std(all_areas)
    assert found == pytest.approx((float(said[1]), float(said[2])), abs=HALF_A_HUNDREDTH)


def test_they_share_their_triangles_as_many_as_the_page_says(surfaces):
    first, *others = surfaces.values()
    assert all(np.array_equal(other.triangles, first.triangles) for other in others)
    said = re.search(r"([\d,]+) vertices and ([\d,]+) triangles\s+each", PAGE)
    counts = tuple(int(each.replace(",", "")) for each in said.groups())
    assert counts == (len(first.vertices), len(first.triangles))


def test_those_of_the_package_are_among_them():
    twins = {row["twin"]: FOLDER / name for name, row in ROWS.items() if row["twin"]}
    assert set(twins) == {path.name for path in bodies_of_the_package()}
    for path in bodies_of_the_package():
        assert path.read_bytes() == twins[path.name].read_bytes()


def test_the_page_says_whose_they_are():
    for word in ("Anny", "0.6.2", "Apache License 2.0", "MakeHuman", "CC0"):
        assert word in PAGE
