# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Numbers as a report tells them: rounded so that what is said of them stays true."""

from __future__ import annotations

import math

# Percent that a share is told in at least: less is of no use to anyone.
_LEAST = 0.01


def percent(share: float) -> str:
    """Return a share as whole percent; near none and near all, to a tenth, or as much as it takes.

    It is 0 only for nothing, and 100 only for all.
    """
    if share <= 0 or share >= 1:
        return "0 %" if share <= 0 else "100 %"
    value = 100 * share
    if 1 <= value < 99:
        return f"{value:.0f} %"
    if value < 1:
        return f"{value:.1g} %" if value < 0.95 else "1 %"
    return f"{min(math.floor(10 * value) / 10, 99.9):.1f} %"


def ceiling(share: float) -> str:
    """Return a share in percent, rounded up to two digits."""
    value = max(100 * share, _LEAST)
    step: float = 10.0 ** (math.floor(math.log10(value)) - 1)
    return f"{min(math.ceil(round(value / step, 9)) * step, 100.0):.2g} %"


def floored(bound: float) -> str:
    """Return a lower bound with one decimal, rounded down: rounded up, it might be none."""
    return f"{math.floor(10 * bound) / 10:.1f}"


def change(share: float) -> str:
    """Return a relative change in percent, with its sign."""
    value = round(100 * share, 1)
    return f"{value:+.1f} %".replace("-", "−") if value else "0.0 %"


def millimetres(metres: float) -> str:
    """Return a length with two digits, or as many as it has before the point."""
    value = 1000 * metres
    return f"{value:.1f} mm" if value < 10 else f"{value:.0f} mm"
