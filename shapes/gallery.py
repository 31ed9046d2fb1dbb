# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Those of the gallery: a gear with a hub that lies flat, and a body on a plinth."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np

from focus_planner import Mesh, load_surface
from focus_planner.core.arrays import FloatArray, IntArray
from focus_planner.io.bodies import body
from shapes.files import save

# The gear has an outer diameter of 240 mm.
_TEETH = 24
_TIP, _ROOT = 0.120, 0.104  # metres
# From the bore's upper edge outwards and down: radius and height, metres; the rim's radius is
# replaced by that of the teeth.
_GEAR = np.array(
    [
        [0.018, 0.080],
        [0.036, 0.080],
        [0.040, 0.076],
        [0.042, 0.038],
        [0.048, 0.032],
        [0.078, 0.032],
        [0.084, 0.040],
        [0.086, 0.050],
        [0.088, 0.052],
        [_TIP, 0.052],
        [_TIP, 0.004],
        [0.088, 0.004],
        [0.086, 0.010],
        [0.078, 0.016],
        [0.048, 0.016],
        [0.042, 0.010],
        [0.040, 0.000],
        [0.018, 0.000],
    ]
)
# The plinth's outline from its top to its foot; the first and the last point are on its axis.
_PLINTH = np.array(
    [
        [0.000, 0.340],
        [0.290, 0.340],
        [0.300, 0.330],
        [0.300, 0.300],
        [0.275, 0.285],
        [0.260, 0.250],
        [0.255, 0.110],
        [0.270, 0.080],
        [0.310, 0.060],
        [0.320, 0.050],
        [0.320, 0.000],
        [0.000, 0.000],
    ]
)


def gear() -> Mesh:
    """Return a spur gear with a web and a hub, lying flat, its axis z."""
    angles = np.linspace(0.0, 2 * np.pi, 24 * _TEETH, endpoint=False)
    outline = _refined(_GEAR, 0.006)
    rim = np.isclose(outline[:, 0], _TIP)
    radii = np.repeat(outline[:, :1], len(angles), axis=1)
    radii[rim] = _tooth_radius(angles)
    return _revolved(radii, outline[:, 1], angles, closed=True)


def statue() -> Mesh:
    """Return a body on a round plinth, 2 m high."""
    angles = np.linspace(0.0, 2 * np.pi, 180, endpoint=False)
    outline = _refined(_PLINTH, 0.02)
    plinth = _revolved(
        np.repeat(outline[:, :1], len(angles), axis=1), outline[:, 1], angles, closed=False
    )
    person = load_surface(body("arms_raised"))
    assert isinstance(person, Mesh)
    low = person.vertices.min(axis=0)
    middle = (low + person.vertices.max(axis=0)) / 2
    lifted = person.vertices + [-middle[0], -middle[1], _PLINTH[0, 1] - low[2]]
    return Mesh(
        np.vstack([plinth.vertices, lifted]),
        np.vstack([plinth.triangles, person.triangles + len(plinth.vertices)]),
    )


def _tooth_radius(angles: FloatArray) -> FloatArray:
    """Return the rim's radius at each angle: teeth with slanting flanks."""
    phase = (angles * _TEETH / (2 * np.pi)) % 1.0
    rise = np.clip((0.5 - np.abs(2 * phase - 1)) * 3.2 + 0.5, 0.0, 1.0)
    radius: FloatArray = _ROOT + (_TIP - _ROOT) * rise
    return radius


def _refined(outline: FloatArray, step: float) -> FloatArray:
    """Return an outline with points at most ``step`` metres apart."""
    parts = []
    for start, end in pairwise(outline):
        pieces = max(1, int(np.ceil(np.linalg.norm(end - start) / step)))
        parts.append(start + (end - start) * np.arange(pieces)[:, None] / pieces)
    return np.vstack([*parts, outline[-1:]])


def _revolved(radii: FloatArray, heights: FloatArray, angles: FloatArray, *, closed: bool) -> Mesh:
    """Return what an outline sweeps around z; ``closed`` joins its end to its beginning.

    Parameters
    ----------
    radii : (n, m) array
        Of the outline's n points at m angles, metres.
    heights : (n,) array
    angles : (m,) array
        Around z, all the way.
    closed : bool
    """
    n, m = radii.shape
    vertices = np.stack(
        [radii * np.cos(angles), radii * np.sin(angles), np.repeat(heights[:, None], m, axis=1)],
        axis=-1,
    ).reshape(-1, 3)
    rows = np.arange(n if closed else n - 1)
    i, j = (index.ravel() for index in np.meshgrid(rows, np.arange(m), indexing="ij"))
    below, right = (i + 1) % n, (j + 1) % m
    a, b, c, d = i * m + j, below * m + j, below * m + right, i * m + right
    triangles: IntArray = np.vstack([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])
    return _with_area(vertices, triangles)


def _with_area(vertices: FloatArray, triangles: IntArray) -> Mesh:
    """Return the mesh without the triangles that the axis leaves no area."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    return Mesh(vertices, triangles[areas > 1e-12])


if __name__ == "__main__":
    save(gear(), Path("gear.ply"))
    save(statue(), Path("statue.ply"))
