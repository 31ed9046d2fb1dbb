"""A solver's progress, and the callback that may stop it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Progress:
    """How far a solver has come.

    Attributes
    ----------
    stage : str
        The solver's name.
    iteration : int
        Steps done in this stage, from 1; 0 while the stage is being set up. ``optimal``, which
        returns to its stages, counts all its steps.
    cost : float
        1000 × the weighted mean cost of the best choice of cells so far, or an upper bound on it.
    lower_bound : float, optional
        No plan for these samples costs less.
    """

    stage: str
    iteration: int
    cost: float
    lower_bound: float | None = None


#: Called after every step; return False to stop.
ProgressCallback = Callable[[Progress], bool]


def never_stop(_: Progress) -> bool:
    """Let the solver run to its end: the default callback."""
    return True
