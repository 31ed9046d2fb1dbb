# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Drawing the plots of experiments, all in one style; the same results give the same bytes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from matplotlib import rc_context
from matplotlib.figure import Figure

from focus_planner.io.files import atomic_write

_INCHES = (8, 4.5)
_DOTS_PER_INCH = 150
_TEXT, _LINES, _GRID = "#24292f", "#8c959f", "#e3e6e9"
_STYLE: dict[Any, Any] = {
    # Beside matplotlib's own, fonts differ from machine to machine.
    "font.family": "DejaVu Sans",
    "font.size": 10,
    "text.color": _TEXT,
    "axes.labelcolor": _TEXT,
    "axes.titlesize": 11,
    "axes.edgecolor": _LINES,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": _GRID,
    "grid.linewidth": 0.8,
    "xtick.color": _LINES,
    "ytick.color": _LINES,
    "xtick.labelcolor": _TEXT,
    "ytick.labelcolor": _TEXT,
    "legend.frameon": False,
    "lines.linewidth": 1.8,
    "lines.markersize": 5,
}


def save_plot(draw: Callable[[Figure], None], path: Path) -> None:
    """Draw a plot into a PNG file.

    Parameters
    ----------
    draw : callable
        Draws into an empty figure.
    path : Path

    Raises
    ------
    InputError
        If it cannot be written.
    """
    with rc_context(_STYLE):
        figure = Figure(figsize=_INCHES, dpi=_DOTS_PER_INCH, layout="constrained")
        draw(figure)
        with atomic_write(path) as file:
            # By default matplotlib puts in its version.
            figure.savefig(file, format="png", metadata={"Software": None})
