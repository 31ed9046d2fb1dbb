"""Array types."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Offsets = NDArray[np.int64]

FloatArray = NDArray[np.float64]

IntArray = NDArray[np.int32]
