"""What a solver tells, and the callback that may stop it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Progress:
    """Where a solver stands.

    Attributes
    ----------
    stage : str
        The solver's name.
    iteration : int
        Steps done in this stage, from 1; 0 before one that takes some setting up. Of ``optimal``,
        which returns to its stages, steps in all.
    cost : float
        1000 × the weighted mean; the cells chosen so far cost no more.
    lower_bound : float, optional
        No plan for these samples costs less.
    """

    stage: str
    iteration: int
    cost: float
    lower_bound: float | None = None


#: Told of every step; answers whether to go on.
ProgressCallback = Callable[[Progress], bool]


def never_stop(_: Progress) -> bool:
    """Let the solver run to its end: the default watch."""
    return True
