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
import pytest

from focus_planner.core import kernels


def table(kind, random):
    """Return ascending numbers."""
    even = np.sort(random.random(300))
    ascending = {
        "even": even,
        "crowded": np.sort(np.concatenate([1e-9 * even, even[:5]])),
        "equal": np.full(40, 0.5),
        "steps": np.sort(np.round(4 * even) / 4),
        "infinite": np.concatenate([[-np.inf, -np.inf], even, [np.inf]]),
        "one": even[:1],
    }
    return ascending[kind]


@pytest.mark.parametrize("kind", ["even", "crowded", "equal", "steps", "infinite", "one"])
@pytest.mark.parametrize(("equal", "side"), [(True, "right"), (False, "left")])
def test_ranks_are_those_of_numpys_search(kind, equal, side):
    random = np.random.default_rng(1)
    ascending = table(kind, random)
    values = np.concatenate([random.uniform(-0.2, 1.2, 500), ascending, [0.0, 0.5, 1.0]])
    ranks = np.empty(len(values), dtype=np.int64)
    kernels.ranks_among(ascending, values, equal, ranks)
    np.testing.assert_array_equal(ranks, np.searchsorted(ascending, values, side=side))
