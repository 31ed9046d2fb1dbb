# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Open3D, imported when it is first used, and without what it draws with until somebody draws.

It takes half a second to import, and web frameworks that it draws with take longer still.
"""

from __future__ import annotations

from functools import cache
from importlib import import_module
from typing import Any

import numpy as np

from focus_planner.core.arrays import FloatArray
from focus_planner.core.deferred import deferred


@cache
def open3d() -> Any:
    """Return the package."""
    with deferred("open3d.visualization"):
        return import_module("open3d")


def estimated_normals(points: FloatArray, count: int) -> FloatArray:
    """Return (M, 3) normals of unknown sign, each of the plane through so many nearest points.

    Parameters
    ----------
    points : (M, 3) array
        Metres.
    count : int
        The point itself included.
    """
    o3d = open3d()
    shape = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points.copy()))
    shape.estimate_normals(o3d.geometry.KDTreeSearchParamKNN(count))
    normals: FloatArray = np.asarray(shape.normals).copy()
    return normals
