# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Limits on the size of messages, checked by their counts before they are read."""

from __future__ import annotations

import math
from dataclasses import dataclass

from focus_planner.core.validation import InputError
from focus_planner.messages.cdr import length_after_header

# A closed mesh has half as many vertices as triangles, a mesh of separate triangles three times.
_VERTICES_PER_TRIANGLE = 3
#: Static transforms that are kept: twice as many as cameras that a rig may have by default.
MAX_TRANSFORMS = 40_000
#: Bytes of a message of static transforms, each of which takes some 150.
MAX_TRANSFORM_BYTES = 6 << 20
#: Bytes of a camera's info, whose coefficients of distortion are at most 14.
MAX_CAMERA_INFO_BYTES = 16 << 10
#: Characters of a frame's name.
MAX_FRAME_NAME = 255


@dataclass(frozen=True)
class Limits:
    """The greatest sizes accepted; infinity for no limit.

    Attributes
    ----------
    max_points : float
        Points in a cloud.
    max_triangles : float
        Triangles in a mesh; the limit on its vertices is three times this.
    max_cameras : float
        Cameras in a rig.
    """

    max_points: float = math.inf
    max_triangles: float = math.inf
    max_cameras: float = math.inf

    def check_cloud(self, points: int) -> None:
        """Raise ``InputError`` if a cloud has too many points."""
        _check("cloud", points, "points", self.max_points, "max_points", "thin the cloud out")

    def check_mesh(self, triangles: int, vertices: int) -> None:
        """Raise ``InputError`` if a mesh has too many triangles or vertices."""
        limit, name = self.max_triangles, "max_triangles"
        _check("mesh", triangles, "triangles", limit, name, "simplify the mesh")
        most = _VERTICES_PER_TRIANGLE * limit
        _check("mesh", vertices, "vertices", most, f"3 × {name}", "remove those in no triangle")

    def check_rig(self, payload: bytes) -> None:
        """Raise ``InputError`` if a serialized rig, or its poses, has too many cameras."""
        cameras = length_after_header(payload)
        _check("rig", cameras, "cameras", self.max_cameras, "max_cameras", "plan it in parts")


def check_bytes(what: str, payload: bytes, most: int) -> None:
    """Raise ``InputError`` if a serialized message is longer than any of its kind need be."""
    if len(payload) > most:
        raise InputError(what, f"at most {most:,} bytes", f"{len(payload):,}")


def _check(
    argument: str, count: int, of_what: str, limit: float, parameter: str, remedy: str
) -> None:
    if count > limit:
        raise InputError(
            argument,
            f"at most {limit:,.0f} {of_what} (parameter {parameter})",
            f"{count:,}",
            f"{remedy}, or raise the parameter if there is enough memory",
        )
