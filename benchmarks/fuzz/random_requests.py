# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Random requests: fields that are good, at a limit, beyond it, or absurd."""

from __future__ import annotations

from typing import Any

import numpy as np

_TEXTS = ("", "em ", "EM", "\x1b[31m", "../../etc/passwd", "é😀\u202e", "%s%n{}", "y" * 10_000)
_NUMBERS = (float("nan"), float("inf"), -float("inf"), -1.0, -0.0, 5e-324, 1e308)
_MOST = 2**32 - 1
# What is usual of each field, and what is not. No usual one takes long.
_FIELDS: dict[str, tuple[tuple[Any, ...], tuple[Any, ...]]] = {
    "method": (("closest", "average", "em", "greedy", "k_view", "optimal"), _TEXTS),
    "samples": ((0, 1, 2, 10, 50, 100), (_MOST, 2_000_001, 10**9)),
    "seed": ((0, 1, 2, 3), (2**64 - 1, 2**63)),
    "time_budget": ((0.0, 0.0, 0.05, 0.2), _NUMBERS[:4] + (5e-324,)),
    "k": ((0, 2, 3), (1, 4, _MOST)),
    "scope": (("", "all", "assigned"), _TEXTS),
    "shots": ((0, 1, 2, 3), (16, 17, _MOST)),
    "views": ((0, 1, 2, 3), (8, 9, _MOST)),
    "depth_tolerance": ((0.0, 0.0, 0.001), _NUMBERS),
    "max_mm_per_pixel": ((0.0, 0.0, 4.0), _NUMBERS),
    "bound": (("", "none", "quick", "tight"), _TEXTS),
    "gap": ((0.0, 1e-4, 0.01), _NUMBERS),
}
_UNUSUAL = 0.06


def random_request(random: np.random.Generator) -> dict[str, Any]:
    """Return the fields of a request; about half of all requests are good."""
    return {
        name: choices[random.integers(len(choices))]
        for name, both in _FIELDS.items()
        for choices in [both[int(random.random() < _UNUSUAL)]]
    }
