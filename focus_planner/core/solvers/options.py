"""options."""

from __future__ import annotations

from dataclasses import dataclass

from focus_planner.core.arrays import FloatArray
from focus_planner.core.rig.rig import Grid


@dataclass(frozen=True)
class Options:
    """What a solver may be told; each takes what concerns it.

    Attributes
    ----------
    k : int
        How many cameras move together: 2 or 3.
    scope : {"all", "assigned"}
        Which samples a step may re-assign: all that its cameras see, or those assigned to them.
    grid : Grid, optional
        Take the tuples from the cameras' neighbourhood on this grid; from overlap when absent.
    start : (C,) array, optional
        Focus distances to start from, metres; the closest depths when absent, or NaN.
    gap : float
        ``optimal`` is content with a plan proven to cost at most this part of its cost too much.
    prices : (N,) array, optional
        Of the samples, 0 to 1, to start bounds from: those of a solution of a similar problem.
    """

    k: int = 2
    scope: str = "all"
    grid: Grid | None = None
    start: FloatArray | None = None
    gap: float = 1e-6
    prices: FloatArray | None = None
