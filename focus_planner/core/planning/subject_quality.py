# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""How well a plan for several subjects images each of them."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class SubjectQuality:
    """One subject's part of the quality of a plan for several.

    Attributes
    ----------
    surface : str
        The subject's name: in commands its file, in a node its topic and number.
    weight : float
        How much it counts in the mean over all, relative to the others.
    multiplier : float
        Its weight in the proof of the lower bound of the worst subject's cost, 0 to 1; all sum to
        1. 0 unless the plan was made for the worst subject.
    samples : int
        Of those planned on.
    cost : float
        1000 × the mean over its samples, by weight, of the pointwise cost.
    fresh_samples : int
    fresh_cost, fresh_standard_error : float
        The same mean over its fresh samples, and its standard error.
    surface_area, covered_area, covered_standard_error : float
        Of its surface, and of the part that some camera sees, with its standard error; m².
    in_focus_area, in_focus_standard_error : float
        Of the part that is in focus in the camera that images it best, with its standard error; m².
    preset : int
        Which of several plans it takes, from 1.
    """

    surface: str
    weight: float
    multiplier: float
    samples: int
    cost: float
    fresh_samples: int
    fresh_cost: float
    fresh_standard_error: float
    surface_area: float
    covered_area: float
    covered_standard_error: float
    in_focus_area: float
    in_focus_standard_error: float
    preset: int = 1
