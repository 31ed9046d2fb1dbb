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
