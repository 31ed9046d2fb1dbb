"""Made-up things for the tests of messages."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

triangle_arrays = st.integers(0, 7).flatmap(
    lambda n: arrays.arrays(np.int32, (n, 3), elements=st.integers(0, 2**31 - 1))
)
vertex_arrays = st.integers(0, 7).flatmap(lambda n: arrays.arrays(np.float64, (n, 3)))
