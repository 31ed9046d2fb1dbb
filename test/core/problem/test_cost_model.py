# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

import math

import pytest

from focus_planner import (
    CostModel,
    InputError,
)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"focus_weight": -0.1}, "focus_weight: expected a number of at least 0, got -0.1"),
        ({"projected_area_weight": -1}, "projected_area_weight: expected a number of at least 0"),
        ({"axis_deviation_weight": math.nan}, "axis_deviation_weight: .* got nan"),
        ({"focus_weight": 0.5}, "cost weights: expected a sum of at most 1, got 1.16667"),
        ({"projected_area_scale": -1}, "projected_area_scale: expected a number of at least 0"),
        ({"axis_deviation_limit": 0}, "axis_deviation_limit: expected a number above 0, got 0"),
    ],
)
def test_cost_models_that_cannot_be(values, message):
    with pytest.raises(InputError, match=message):
        CostModel(**values)
