"""request."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from focus_planner.core.validation import InputError, check_choice, check_number, check_whole

if TYPE_CHECKING:
    # It compiles kernels; requests and plans are also read where nothing is planned.
    pass


#: Those of the solvers.
METHODS = ("closest", "average", "em", "k_view", "optimal")

SCOPES = ("all", "assigned")

TUPLES = ("overlap", "grid")

BOUNDS = ("none", "quick", "tight")

#: More would need more memory than rigs' computers have, and change no plan.
MAX_SAMPLES = 2_000_000

MAX_SHOTS = 16


@dataclass(frozen=True)
class PlanRequest:
    """What to plan with.

    Parameters
    ----------
    method : {"closest", "average", "em", "k_view", "optimal"}
    samples : int
        How many to plan on. 0 takes a cloud's points themselves, and on a mesh as many as
        ``standard_error`` asks for.
    seed : int
    k : {2, 3}
        How many cameras ``k_view`` moves together.
    scope : {"all", "assigned"}
        Which samples a ``k_view`` step may re-assign.
    tuples : {"overlap", "grid"}
        Whether ``k_view`` takes its tuples from what the cameras see or from the rig's grid.
    time_budget : float
        Seconds after which to return the best plan so far, with its bound; inf for no limit. What
        rays cannot be cast for in half of it is left out of the samples.
    shots : int
        How many pictures each camera takes, each with a focus distance of its own, planned
        together; 1 to 16.
    depth_tolerance : float
        How far, in metres, a sample's depth may be off either way: it counts as in focus only
        where all these depths are.
    fresh_samples : int
        How many to judge the plan on, which the solver does not see.
    standard_error : float
        Where ``samples`` is 0 on a mesh, the standard error that the cost is to have, in its
        unit: both numbers of samples, to plan on and to judge on, are then chosen for it.
    bound : {"none", "quick", "tight"}
        What to spend on a lower bound of a plan that comes without one: nothing, about as much
        as on a 2-view plan, or until it hardly rises any more. ``optimal`` always has its own.
    gap : float
        ``optimal`` stops when its plan is proven to cost at most this part of its cost too much,
        and so does a tight bound.

    Raises
    ------
    InputError
        If a value is out of range.
    """

    method: str = "k_view"
    samples: int = 4096
    seed: int = 0
    k: int = 2
    scope: str = "all"
    tuples: str = "overlap"
    time_budget: float = np.inf
    shots: int = 1
    depth_tolerance: float = 0.0
    fresh_samples: int = 4096
    standard_error: float = 2.0
    bound: str = "quick"
    gap: float = 1e-4

    def __post_init__(self) -> None:
        check_choice("method", self.method, METHODS)
        for name, at_least in (("samples", 0), ("fresh_samples", 2)):
            number = getattr(self, name)
            if check_whole(name, number, at_least) > MAX_SAMPLES:
                raise InputError(name, f"at most {MAX_SAMPLES}", str(number))
        check_whole("seed", self.seed, 0)
        if isinstance(self.k, bool) or not isinstance(self.k, int) or self.k not in (2, 3):
            raise InputError("k", "2 or 3", repr(self.k))
        check_choice("scope", self.scope, SCOPES)
        check_choice("tuples", self.tuples, TUPLES)
        check_number("time_budget", self.time_budget, above=0, infinite=True)
        if check_whole("shots", self.shots, 1) > MAX_SHOTS:
            raise InputError("shots", f"at most {MAX_SHOTS}", str(self.shots))
        check_number("depth_tolerance", self.depth_tolerance, at_least=0)
        check_number("standard_error", self.standard_error, above=0)
        check_choice("bound", self.bound, BOUNDS)
        if check_number("gap", self.gap, at_least=0) > 1:
            raise InputError("gap", "at most 1, the whole cost", f"{self.gap:g}")
