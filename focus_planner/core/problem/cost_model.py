# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The constants of the pointwise cost."""

from __future__ import annotations

from dataclasses import dataclass

from focus_planner.core.validation import InputError, check_number


@dataclass(frozen=True)
class CostModel:
    """The constants of the pointwise cost (paper, Eq. 1).

    Parameters
    ----------
    projected_area_weight, axis_deviation_weight, focus_weight : float
        w₁, w₂, w₃; their sum is at most 1, the cost of a sample that no camera sees.
    projected_area_scale : float
        ε₁, 1/m².
    axis_deviation_limit : float
        ε₂, metres.

    Raises
    ------
    InputError
        If a value is negative, the limit is 0, or the weights sum to more than 1.
    """

    projected_area_weight: float = 1 / 3
    axis_deviation_weight: float = 1 / 3
    focus_weight: float = 1 / 3
    projected_area_scale: float = 1.0
    axis_deviation_limit: float = 0.75

    def __post_init__(self) -> None:
        weights = (self.projected_area_weight, self.axis_deviation_weight, self.focus_weight)
        check_number("projected_area_weight", weights[0], at_least=0)
        check_number("axis_deviation_weight", weights[1], at_least=0)
        check_number("focus_weight", weights[2], at_least=0)
        if sum(weights) > 1 + 1e-9:
            raise InputError("cost weights", "a sum of at most 1", f"{sum(weights):g}")
        check_number("projected_area_scale", self.projected_area_scale, at_least=0)
        check_number("axis_deviation_limit", self.axis_deviation_limit, above=0)
