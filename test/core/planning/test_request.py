# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Requests that cannot be, and why."""

import math

import pytest

from focus_planner import (
    InputError,
    PlanRequest,
)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"method": "best"}, "method: expected one of closest, average, em, greedy, k_view"),
        ({"samples": -1}, "samples: expected a whole number of at least 0, got -1"),
        ({"samples": 10.0}, "samples: expected a whole number of at least 0, got 10.0"),
        ({"seed": -1}, "seed: expected a whole number of at least 0, got -1"),
        ({"k": 1}, "k: expected 2 or 3, got 1"),
        ({"k": 4}, "k: expected 2 or 3, got 4"),
        ({"scope": "some"}, "scope: expected one of all, assigned, got 'some'"),
        ({"tuples": "none"}, "tuples: expected one of overlap, grid, got 'none'"),
        ({"time_budget": -1}, "time_budget: expected a number of at least 0, got -1"),
        ({"time_budget": math.nan}, "time_budget: expected a number of at least 0, got nan"),
        ({"shots": 0}, "shots: expected a whole number of at least 1, got 0"),
        ({"shots": 17}, "shots: expected at most 16, got 17"),
        ({"shots": 2.0}, "shots: expected a whole number of at least 1, got 2.0"),
        ({"depth_tolerance": -0.1}, "depth_tolerance: expected a number of at least 0, got -0.1"),
        (
            {"depth_tolerance": math.inf},
            "depth_tolerance: expected a number of at least 0, got inf",
        ),
        ({"depth_tolerance": 1e308}, r"depth_tolerance: expected at most 1e\+08, got 1e\+308"),
        ({"samples": 2_000_001}, "samples: expected at most 2000000, got 2000001"),
        ({"fresh_samples": 1}, "fresh_samples: expected a whole number of at least 2, got 1"),
        ({"fresh_samples": 2_000_001}, "fresh_samples: expected at most 2000000, got 2000001"),
        ({"standard_error": 0}, "standard_error: expected a number above 0, got 0"),
        ({"standard_error": math.inf}, "standard_error: expected a number above 0, got inf"),
        ({"standard_error": math.nan}, "standard_error: expected a number above 0, got nan"),
        ({"bound": "some"}, "bound: expected one of none, quick, tight, got 'some'"),
        ({"gap": -1e-9}, "gap: expected a number of at least 0, got -1e-09"),
        ({"gap": math.nan}, "gap: expected a number of at least 0, got nan"),
        ({"gap": "tight"}, "gap: expected a number of at least 0, got 'tight'"),
        ({"gap": 1e300}, r"gap: expected at most 1, the whole cost, got 1e\+300"),
    ],
)
def test_requests_that_cannot_be(values, message):
    with pytest.raises(InputError, match=message):
        PlanRequest(**values)
