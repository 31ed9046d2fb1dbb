"""One file per solver, one signature: ``solve(problem, options, on_progress) -> Solution``."""

from focus_planner.core.solvers import average, closest, em, k_view, optimal
from focus_planner.core.solvers.options import Options
from focus_planner.core.solvers.solution import Solution, Solver

#: Every method by its name in requests, on the command line and in plans.
SOLVERS: dict[str, Solver] = {
    "closest": closest.solve,
    "average": average.solve,
    "em": em.solve,
    "k_view": k_view.solve,
    "optimal": optimal.solve,
}

__all__ = ["SOLVERS", "Options", "Solution", "Solver"]
