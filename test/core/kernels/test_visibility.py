# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

import numpy as np

from focus_planner.core import kernels


def samples_in_blocks(random):
    points = random.uniform(-2, 2, (300, 3))
    points = points[np.argsort(points[:, 2])] * [1, 1, 5]  # some blocks lie behind
    normals = random.normal(size=(300, 3))
    order = np.arange(300)[::-1].copy()
    return points, normals, order, kernels.blocks_of(points, normals, order)


def cameras_along_z(random, count):
    positions, rotations = random.uniform(-1, 1, (count, 3)), np.tile(np.eye(3), (count, 1, 1))
    frustums = np.tile([100.0, 100, 50, 40, 100, 80, 0.05], (count, 1))
    return kernels.Views(positions, rotations, frustums)


def test_blocks_hold_the_samples_in_order_and_their_bounds():
    points, normals, order, blocks = samples_in_blocks(np.random.default_rng(2))
    for each, of in ((blocks.points, points), (blocks.normals, normals)):
        flat = each.transpose(0, 2, 1).reshape(-1, 3)
        np.testing.assert_array_equal(flat[:300], of[order])
        assert np.isnan(flat[300:]).all()
    centres = np.repeat(blocks.spheres[:3].T, kernels.PER_BLOCK, axis=0)[:300]
    radii = np.repeat(blocks.spheres[3], kernels.PER_BLOCK)[:300]
    assert (np.linalg.norm(points[order] - centres, axis=1) <= radii).all()


def test_what_is_in_view_is_listed_and_no_more_than_there_is_room_for():
    random = np.random.default_rng(1)
    points, normals, order, blocks = samples_in_blocks(random)
    views = cameras_along_z(random, 5)
    for facing in (False, True):
        may = kernels.near_view(blocks, views, facing)
        assert 0 < may.sum() < may.size
        room = np.concatenate([[0], np.cumsum(may.sum(axis=1) * kernels.PER_BLOCK)])
        listed = np.full(room[-1], -1, dtype=np.int32)
        counts = kernels.list_in_view(blocks, may, views, facing, room, listed)
        for c in range(5):
            offset = points[order] - views.positions[c]
            u, v = (100 * offset[:, :2] / offset[:, 2:]).T + [[50], [40]]
            expected = (offset[:, 2] > 0.05) & (u >= -0.5) & (u < 99.5) & (v >= -0.5) & (v < 79.5)
            if facing:
                expected &= (offset * normals[order]).sum(axis=1) < 0
            np.testing.assert_array_equal(
                listed[room[c] : room[c] + counts[c]], np.flatnonzero(expected)
            )
        assert counts.sum() > 20


def test_rays_end_short_of_their_samples():
    random = np.random.default_rng(3)
    points, _, order, blocks = samples_in_blocks(random)
    views = cameras_along_z(random, 2)
    listed = random.integers(0, 300, 250).astype(np.int32)
    room, offsets = (
        np.array([10, 60, 250]),
        np.array([0, 40, 200]),
    )  # the first lists 40, of room 50
    rays = np.empty((200, 6), dtype=np.float32)
    centre = np.array([0.5, -0.5, 1.0])
    kernels.fill_rays(blocks, views.positions, room, listed, offsets, centre, 0.1, rays)
    for ray in range(200):
        c, place = (0, 10 + ray) if ray < 40 else (1, 60 + ray - 40)
        origin, target = views.positions[c] - centre, points[order[listed[place]]] - centre
        away = np.linalg.norm(target - origin)
        expected = [*origin, *((target - origin) * (away - 0.1) / away)]
        np.testing.assert_allclose(rays[ray], expected, rtol=1e-5, atol=1e-6)


def test_what_is_not_hidden_is_listed_ascending():
    random = np.random.default_rng(4)
    order = random.permutation(300)
    counts = np.array([130, 0, 300])
    room, offsets = np.array([5, 200, 210, 520]), np.concatenate([[0], np.cumsum(counts)])
    listed = np.full(520, -1, dtype=np.int32)
    for c in range(3):
        listed[room[c] : room[c] + counts[c]] = random.permutation(300)[: counts[c]]
    for hidden in (random.random(430) < 0.5, np.zeros(430, bool), np.ones(430, bool)):
        seen = kernels.count_seen(offsets, hidden)
        seen_offsets = np.concatenate([[0], np.cumsum(seen)])
        found = np.full(seen_offsets[-1], -1, dtype=np.int32)
        kernels.list_seen(room, listed, offsets, hidden, order, seen_offsets, found)
        for c in range(3):
            own = listed[room[c] : room[c] + counts[c]]
            expected = np.sort(order[own[~hidden[offsets[c] : offsets[c + 1]]]])
            np.testing.assert_array_equal(found[seen_offsets[c] : seen_offsets[c + 1]], expected)


def test_keys_are_sorted_like_a_stable_sort_of_numpy():
    random = np.random.default_rng(3)
    for count in (0, 1, 2, 1000, 5000):
        for most in (1, 3, 2**11, 2**40, 2**64 - 1):
            keys = random.integers(0, most, count, dtype=np.uint64)
            np.testing.assert_array_equal(kernels.ascending(keys), np.argsort(keys, kind="stable"))
