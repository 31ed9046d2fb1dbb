# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The drawings of a report that need no program: SVG within the page, coloured by its style."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from focus_planner.core.arrays import FloatArray
from focus_planner.core.planning.plan import CameraFocus
from focus_planner.report.content import CostRow, DepthHistogram, Step
from focus_planner.report.markup import text
from focus_planner.report.rounding import floored

_WIDTH, _HEIGHT = 640, 260
_LEFT, _RIGHT, _TOP, _BOTTOM = 52, 96, 14, 40
_BAR_WIDTH, _BAR_HEIGHT = 300, 22
_SPARK_WIDTH, _SPARK_HEIGHT = 120, 22


def bar(row: CostRow, most: float) -> str:
    """Return a bar as long as a row's cost on fresh samples, with its standard error.

    A bar without filling is a cost on the samples that were planned on, where there is no other.
    """
    value = row.cost if row.fresh_cost is None else row.fresh_cost
    if value is None or most <= 0:
        return ""
    kind = "reported" if row.reported else "bound" if row.fresh_cost is None else "other"
    scale = _BAR_WIDTH / (1.05 * most)
    parts = [f'<rect class="bar {kind}" y="4" width="{value * scale:.1f}" height="14" rx="1.5"/>']
    if row.standard_error:
        low, high = (scale * (value + s * row.standard_error) for s in (-1, 1))
        parts.append(
            f'<path class="whisker" d="M{low:.1f} 11H{high:.1f}M{low:.1f} 7v8M{high:.1f} 7v8"/>'
        )
    return _svg(_BAR_WIDTH, _BAR_HEIGHT, "bars", "".join(parts))


def convergence(steps: Sequence[Step]) -> str:
    """Return the curves of cost and lower bound over the seconds, or over the steps if unknown."""
    costed = [(k, each) for k, each in enumerate(steps) if each.cost is not None]
    if len(costed) < 2:
        return ""
    timed = all(each.elapsed is not None for _, each in costed)
    x = np.array([each.elapsed if timed else k for k, each in costed], dtype=np.float64)
    cost = np.array([each.cost for _, each in costed], dtype=np.float64)
    bound = np.array(
        [math.nan if each.lower_bound is None else each.lower_bound for _, each in costed]
    )
    axes = _Axes(x, np.concatenate([cost, bound[np.isfinite(bound)]]))
    parts = [axes.grid("seconds" if timed else "step")]
    for name, values in (("cost", cost), ("bound", bound)):
        known = np.isfinite(values)
        if known.any():
            parts.append(axes.curve(name, x[known], values[known]))
    last = [("cost", cost[-1], f"{cost[-1]:.1f}")]
    if np.isfinite(bound).any():
        value = bound[np.isfinite(bound)][-1]
        last.append(("bound", value, floored(value)))
    parts.append(axes.labels(last))
    said = f"Cost from {cost[0]:.1f} to {cost[-1]:.1f} in {len(costed)} steps"
    return (
        f'<svg class="convergence" viewBox="0 0 {_WIDTH} {_HEIGHT}" role="img"'
        f' aria-label="{text(said)}">{"".join(parts)}</svg>'
    )


class _Axes:
    """A plot's area: from values to places in the drawing."""

    def __init__(self, x: FloatArray, y: FloatArray) -> None:
        self._x = float(x.min()), float(x.max()) if x.max() > x.min() else float(x.min()) + 1
        margin = 0.06 * float(y.max() - y.min()) or 1.0
        self._y = float(y.min()) - margin, float(y.max()) + margin

    def _across(self, value: float) -> float:
        low, high = self._x
        return _LEFT + (value - low) / (high - low) * (_WIDTH - _LEFT - _RIGHT)

    def _up(self, value: float) -> float:
        low, high = self._y
        return _HEIGHT - _BOTTOM - (value - low) / (high - low) * (_HEIGHT - _TOP - _BOTTOM)

    def grid(self, unit: str) -> str:
        lines = []
        for value, shown in _ticks(*self._y, 5):
            y = self._up(value)
            lines.append(f'<path class="grid" d="M{_LEFT} {y:.1f}H{_WIDTH - _RIGHT}"/>')
            lines.append(f'<text class="tick y" x="{_LEFT - 8}" y="{y + 4:.1f}">{shown}</text>')
        for value, shown in _ticks(*self._x, 6):
            x = self._across(value)
            lines.append(
                f'<text class="tick x" x="{x:.1f}" y="{_HEIGHT - _BOTTOM + 18}">{shown}</text>'
            )
        middle = (_LEFT + _WIDTH - _RIGHT) / 2
        lines.append(f'<text class="tick x" x="{middle:.0f}" y="{_HEIGHT - 4}">{unit}</text>')
        return "".join(lines)

    def curve(self, name: str, x: FloatArray, y: FloatArray) -> str:
        places = [(self._across(a), self._up(b)) for a, b in zip(x, y, strict=True)]
        line = "L".join(f"{a:.1f} {b:.1f}" for a, b in places)
        dots = "".join(f"M{a:.1f} {b:.1f}h0" for a, b in places) if len(places) <= 40 else ""
        return f'<path class="curve {name}" d="M{line}"/><path class="dots {name}" d="{dots}"/>'

    def labels(self, entries: list[tuple[str, float, str]]) -> str:
        """Return the curves' names and last values as told, apart from each other at their ends."""
        places = [self._up(value) + 4 for _, value, _ in entries]
        if len(places) == 2 and places[1] - places[0] < 15:
            middle = sum(places) / 2
            places = [middle - 8, middle + 8]
        x = _WIDTH - _RIGHT + 8
        return "".join(
            f'<text class="label {name}" x="{x}" y="{y:.1f}">{name} {told}</text>'
            for (name, _, told), y in zip(entries, places, strict=True)
        )


def _ticks(low: float, high: float, about: int) -> list[tuple[float, str]]:
    """Return round numbers within a range, about this many, and how they are written."""
    rough = (high - low) / about
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(m * power for m in (1, 2, 5, 10) if m * power >= rough)
    decimals = max(0, -math.floor(math.log10(step) + 1e-9))
    first = math.ceil(low / step)
    numbers = range(first, math.floor(high / step + 1e-9) + 1)
    return [(k * step, f"{k * step:.{decimals}f}") for k in numbers]


def depth_range(histograms: Sequence[DepthHistogram]) -> tuple[float, float]:
    """Return the least and the greatest depth that any camera sees; 0, 1 if none sees any."""
    ends = [each.edges[[0, -1]] for each in histograms if len(each.edges)]
    if not ends:
        return 0.0, 1.0
    return float(np.min(ends)), float(np.max(ends))


def depths(histogram: DepthHistogram, focus: CameraFocus, ends: tuple[float, float]) -> str:
    """Return the depths that a camera sees as a small histogram, with its depth of field."""
    if not len(histogram.edges) or not histogram.areas.max(initial=0.0):
        return ""
    low, high = ends
    scale = _SPARK_WIDTH / ((high - low) or 1.0)
    parts = []
    for shot in focus.shots:
        if shot.near_limit > high or shot.far_limit < low:
            continue
        near, far = np.clip([shot.near_limit, shot.far_limit], low, high)
        parts.append(
            f'<rect class="field" x="{(near - low) * scale:.1f}"'
            f' width="{max((far - near) * scale, 0.8):.1f}" height="{_SPARK_HEIGHT}"/>'
        )
    x = (histogram.edges - low) * scale
    y = _SPARK_HEIGHT * (1 - histogram.areas / histogram.areas.max())
    line = "".join(f"V{b:.1f}H{a:.1f}" for a, b in zip(x[1:], y, strict=True))
    parts.append(f'<path class="depths" d="M{x[0]:.1f} {_SPARK_HEIGHT}{line}V{_SPARK_HEIGHT}z"/>')
    return _svg(_SPARK_WIDTH, _SPARK_HEIGHT, "spark", "".join(parts))


def _svg(width: int, height: int, of: str, inside: str) -> str:
    """Return a drawing whose numbers are told in words beside it."""
    return (
        f'<svg class="{of}" viewBox="0 0 {width} {height}" preserveAspectRatio="none"'
        f' aria-hidden="true">{inside}</svg>'
    )
