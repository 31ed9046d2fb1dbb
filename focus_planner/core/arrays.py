# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Types of the arrays that hold points, costs and indices."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

#: Where each group of a flat array begins, (groups + 1,): group g is ``offsets[g]`` up to
#: ``offsets[g + 1]``. Also costs in whole units, which need the same width.
Offsets = NDArray[np.int64]

#: Points, distances, costs.
FloatArray = NDArray[np.float64]

#: Indices of samples, cameras, pairs, vertices and cells.
IntArray = NDArray[np.int32]
