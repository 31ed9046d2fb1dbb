# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What shows plans in 3D, read as viewers read it."""

from __future__ import annotations

import math

import numpy as np

NUMBERS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}
ADD, DELETE_ALL = 0, 3
LINE_LIST, TEXT, TRIANGLE_LIST = 5, 9, 11
# How many points make one of them.
OF_EACH = {LINE_LIST: 2, TRIANGLE_LIST: 3}


def cloud_columns(cloud):
    """Return the columns of a ``PointCloud2`` by name."""
    dtype = np.dtype(
        {
            "names": [field.name for field in cloud.fields],
            "formats": [NUMBERS[field.datatype] for field in cloud.fields],
            "offsets": [field.offset for field in cloud.fields],
            "itemsize": cloud.point_step,
        }
    )
    points = np.frombuffer(bytes(cloud.data), dtype)
    return {name: points[name].copy() for name in dtype.names}


def points_of(marker):
    return np.array([(p.x, p.y, p.z) for p in marker.points]).reshape(-1, 3)


def colours_of(marker):
    return np.array([(c.r, c.g, c.b, c.a) for c in marker.colors]).reshape(-1, 4)


def shown(markers):
    """What a viewer shows once it has handled these markers, by namespace and number."""
    there = {}
    for marker in markers:
        if marker.action == DELETE_ALL:
            there = {key: each for key, each in there.items() if marker.ns not in ("", key[0])}
        else:
            assert marker.action == ADD
            there[marker.ns, marker.id] = marker
    return there


def check_markers(markers, frame_id, stamp):
    """Check what RViz checks before it draws, and warns of."""
    keys = [(marker.ns, marker.id) for marker in markers]
    assert len(set(keys)) == len(keys), "RViz: several markers have the same ns and id"
    for marker in markers:
        assert marker.header.frame_id == frame_id
        assert (marker.header.stamp.sec, marker.header.stamp.nanosec) == stamp
        turned = marker.pose.orientation
        assert math.hypot(turned.x, turned.y, turned.z, turned.w) == 1.0
        assert (marker.lifetime.sec, marker.lifetime.nanosec) == (0, 0)
        scale = marker.scale
        assert all(0 < each < math.inf for each in (scale.x, scale.y, scale.z))
        place, tint = marker.pose.position, marker.color
        assert np.isfinite([place.x, place.y, place.z]).all()
        assert all(0.0 <= each <= 1.0 for each in (tint.r, tint.g, tint.b))
        assert 0.0 < tint.a <= 1.0
        points, colours = points_of(marker), colours_of(marker)
        assert np.isfinite(points).all()
        assert len(colours) in {0, len(points)}
        assert ((colours >= 0) & (colours <= 1)).all()
        assert (colours[:, 3] > 0).all()
        if marker.action == DELETE_ALL:
            assert not len(points)
        elif marker.type == TEXT:
            assert marker.text
            assert not len(points)
        else:
            assert len(points), "RViz: no points"
            assert len(points) % OF_EACH[marker.type] == 0, "RViz: half a line or triangle"
