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
from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from focus_planner import Camera, Rig, cylinder_rig
from focus_planner.core.rig.walk import walking_order


def camera(name, place, towards):
    """A camera at a place that looks towards a point, with any roll."""
    forward = np.subtract(towards, place) / np.linalg.norm(np.subtract(towards, place))
    # The shortest rotation from +z to the direction.
    q = np.array([-forward[1], forward[0], 0.0, 1.0 + forward[2]])
    q = np.array([1.0, 0.0, 0.0, 0.0]) if q[3] < 1e-9 else q / np.linalg.norm(q)
    return Camera(name, tuple(map(float, place)), tuple(q.tolist()))


def walked(cameras):
    return [cameras[i].name for i in walking_order(Rig(tuple(cameras)))]


def ring(columns, heights, radius=1.0, wobble=0.0, span=360.0):
    """Cameras named by column and row, listed row by row, that look at the z axis."""
    random = np.random.default_rng(5)
    cameras = []
    for (row, z), column in product(enumerate(heights), range(columns)):
        angle = math.radians(span * column / (columns if span == 360 else columns - 1))
        x, y = radius * math.cos(angle), radius * math.sin(angle)
        place = np.array([x, y, z]) + wobble * random.uniform(-1, 1, 3)
        cameras.append(camera(f"c{column}_{row}", place, (0.0, 0.0, z)))
    return cameras


def by_columns(columns, rows):
    return [f"c{column}_{row}" for column in columns for row in range(rows)]


def test_a_cylinder_is_walked_column_by_column_from_below():
    rig = cylinder_rig()
    expected = [f"cam_{row}_{column:02d}" for column in range(24) for row in range(7)]
    assert [rig.cameras[i].name for i in walking_order(rig)] == expected
    # The poses alone tell the same as the grid.
    assert walked(rig.cameras) == expected


def test_a_sequence_is_in_its_own_order():
    cameras = cylinder_rig(2, 4).cameras[::-1]
    rig = Rig(cameras, sequence=True)
    assert walking_order(rig).tolist() == list(range(8))
    assert walking_order(replace(rig, sequence=False)).tolist() != list(range(8))


@pytest.mark.parametrize(("columns", "rows"), [(24, 7), (3, 2), (100, 1), (30, 1), (4, 3)])
def test_cameras_need_not_stand_exactly_in_columns(columns, rows):
    cameras = ring(columns, np.linspace(0.1, 1.7, rows), wobble=0.008)
    assert walked(cameras) == by_columns(range(columns), rows)


def test_the_walk_starts_at_the_first_camera():
    cameras = ring(8, (0.2, 0.8))
    start = [cameras[5], *cameras[:5], *cameras[6:]]
    assert walked(start) == by_columns([5, 6, 7, 0, 1, 2, 3, 4], 2)


def test_an_open_ring_is_walked_from_the_end_nearer_to_the_first_camera():
    for span in (60.0, 120.0, 180.0, 250.0):
        cameras = ring(7, (0.2, 0.8, 1.4), span=span)
        assert walked(cameras) == by_columns(range(7), 3)
        other_way = sorted(cameras, key=lambda c: c.name, reverse=True)
        assert walked(other_way) == by_columns(reversed(range(7)), 3)


def test_a_ring_around_anywhere_that_looks_outward():
    cameras = []
    for column, row in product(range(6), range(2)):
        angle = math.radians(60 * column)
        out = np.array([math.cos(angle), math.sin(angle), 0.0])
        place = np.array([40.0, -7.0, 1.0 + row]) + 0.1 * out
        cameras.append(camera(f"c{column}_{row}", place, place + out))
    assert walked(cameras) == by_columns(range(6), 2)


def test_of_a_dome_the_camera_at_the_top_is_last():
    cameras = [camera("top", (0.0, 0.0, 2.0), (0.0, 0.0, 0.0))]
    for row, column in product(range(3), range(8)):
        up, around = math.radians(20 + 25 * row), math.radians(45 * column)
        flat = 2.0 * math.cos(up)
        place = (flat * math.cos(around), flat * math.sin(around), 2.0 * math.sin(up))
        cameras.append(camera(f"c{column}_{row}", place, (0.0, 0.0, 0.0)))
    names = walked(cameras)
    assert names[-1] == "top"
    # The first in the list is in no column: the walk starts at any, and goes round.
    first = int(names[0][1])
    assert names[:-1] == by_columns([(first + k) % 8 for k in range(8)], 3)


@pytest.mark.parametrize("tilt", [0.0, 0.15])
def test_a_wall_is_walked_from_the_end_of_the_first_camera(tilt):
    # Along (0.6, 0.8), facing (0.8, -0.6), all alike or a little towards the middle.
    cameras = []
    for row, column in product(range(3), range(5)):
        along = 0.5 * column - 1.0
        place = np.array([0.6 * along, 0.8 * along, 0.4 * row])
        facing = np.array([0.8, -0.6, 0.0]) - tilt * along * np.array([0.6, 0.8, 0.0])
        cameras.append(camera(f"c{column}_{row}", place, place + facing))
    assert walked(cameras) == by_columns(range(5), 3)
    assert walked(cameras[::-1]) == by_columns(reversed(range(5)), 3)


def test_a_gantry_is_walked_line_by_line():
    random = np.random.default_rng(1)
    cameras = []
    for row, column in product(range(4), range(9)):
        place = np.array([0.3 * column, 0.25 * row, 2.0]) + [0, 0, random.uniform(-1, 1) * 1e-3]
        cameras.append(camera(f"c{column}_{row}", place, place - [0, 0, 1]))
    assert walked(cameras) == by_columns(range(9), 4)


def test_a_pole_is_walked_from_below():
    random = np.random.default_rng(2)
    cameras = [
        camera(
            f"c0_{row}", np.array([0, 0, 0.4 * row]) + 0.003 * random.uniform(-1, 1, 3), (9, 0, 1)
        )
        for row in range(5)
    ]
    assert walked(cameras[::-1]) == by_columns([0], 5)


def test_cameras_in_one_spot_are_walked_by_where_they_look():
    cameras = [
        camera(
            f"c{column}_{row}",
            (3.0, 4.0, 5.0),
            (3 + math.cos(1.2 * column), 4 + math.sin(1.2 * column), 4.8 + 0.4 * row),
        )
        for row, column in product(range(2), range(5))
    ]
    assert walked(cameras) == by_columns(range(5), 2)


def test_any_rig_has_an_order_that_depends_on_nothing_else():
    one = camera("one", (1.0, 2.0, 3.0), (0.0, 0.0, 0.0))
    assert walked([one]) == ["one"]
    twins = [camera(name, (1.0, 2.0, 3.0), (0.0, 0.0, 0.0)) for name in ("b", "a")]
    assert walked(twins) == ["b", "a"]
    random = np.random.default_rng(3)
    for count in (2, 3, 5, 40, 200):
        places, towards = random.normal(size=(2, count, 3))
        cameras = [
            camera(f"c{i}", p, t) for i, (p, t) in enumerate(zip(places, towards, strict=True))
        ]
        order = walking_order(Rig(tuple(cameras)))
        assert sorted(order.tolist()) == list(range(count))
        np.testing.assert_array_equal(order, walking_order(Rig(tuple(cameras))))
