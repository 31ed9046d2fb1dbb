# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Trees of points, for the nearest of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from focus_planner.core.arrays import FloatArray

if TYPE_CHECKING:
    from scipy.spatial import cKDTree


def tree_of(points: FloatArray) -> cKDTree:
    """Return a k-d tree of (n, 3) points."""
    from scipy.spatial import cKDTree  # noqa: PLC0415 - takes as long as a plan, meshes need none

    return cKDTree(points)
