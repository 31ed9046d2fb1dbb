# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Where bodies stand, and how they are written, without the body model."""

from __future__ import annotations

import re

import numpy as np
import pytest
import trimesh
from body_model import AGES, REACH, TOP, Body, fits, generator, place

from focus_planner import load_surface
from testing.pages import ROOT

PAGE = (ROOT / "data" / "README.md").read_text(encoding="utf-8")


def test_a_placed_body_stands_in_the_middle_and_is_not_turned():
    vertices = np.random.default_rng(0).normal(size=(50, 3)) * [0.2, 0.1, 1] + [3, -2, 5]
    placed = place(vertices)
    low, high = placed.min(0), placed.max(0)
    assert low[2] == 0
    assert low[:2] + high[:2] == pytest.approx(0, abs=1e-12)
    assert placed - placed[0] == pytest.approx(vertices - vertices[0])


@pytest.mark.parametrize(
    ("vertex", "expected"),
    [
        ((REACH - 0.001, 0, 1), True),
        ((0, -REACH - 0.001, 1), False),
        ((REACH * 0.75, REACH * 0.75, 1), False),
        ((0, 0, TOP - 0.001), True),
        ((0, 0, TOP + 0.001), False),
    ],
)
def test_a_body_fits_within_a_cylinder(vertex, expected):
    assert fits(np.array([[0, 0, 0], vertex], float)) is expected


def test_a_body_is_written_as_the_twelve_are(tmp_path):
    sphere = trimesh.creation.icosphere()
    body = Body(place(sphere.vertices), sphere.faces, "down", 2.0)
    path = tmp_path / "body.ply"
    path.write_bytes(body.ply())
    twelve = (ROOT / "data/bodies/body_00.ply").read_bytes()
    assert shape_of(path.read_bytes()) == shape_of(twelve)
    surface = load_surface(path)
    assert surface.vertices == pytest.approx(body.vertices, abs=1e-6)
    assert np.array_equal(surface.triangles, body.triangles)
    assert body.area == pytest.approx(sphere.area)


def shape_of(file):
    """Return the lines of a file's header that say what follows, without numbers and comments."""
    header = file[: file.index(b"end_header")].decode("ascii")
    lines = [line for line in header.splitlines() if not line.startswith("comment")]
    return [re.sub(r"\d+$", "N", line) for line in lines]


def test_each_body_has_a_generator_of_its_own():
    drawn = [generator(*each).random() for each in ((1, 0), (1, 0), (1, 1), (2, 0))]
    assert drawn[0] == drawn[1]
    assert len(set(drawn)) == 3


def test_the_page_says_who_is_drawn_and_what_fits():
    assert f"of {AGES[0]:.0f} to {AGES[1]:.0f} years" in PAGE
    assert f"within {REACH} m of the z axis, no higher than {TOP} m" in " ".join(PAGE.split())
