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
