# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.
"""What revisions call differently, under one name: all that depends on the revision is here."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module
from importlib.util import find_spec
from typing import Any

#: The options of Python that start the command line.
PROGRAM: Sequence[str] = (
    ("-m", "focus_planner")
    if find_spec("focus_planner.__main__")
    else ("-c", "import sys; from focus_planner.cli.main import main; sys.exit(main())")  # 0.1
)


def formulate(scene: Any, rig: Any, request: Any) -> Any:
    """Return the problem of a request, with its cells."""
    problem = _found(
        "core.planning.formulation.formulate_problem",
        "core.posing.pose_problem",  # 0.1
    )(scene, rig, request)
    _ = problem.cells
    return problem


def judge(scene: Any, rig: Any, request: Any, focus: Any) -> float:
    """Return the cost on the request's fresh samples, formulated for it."""
    if find_spec("focus_planner.core.posing"):  # 0.1
        fresh = _found("core.posing.pose_fresh_problem")(scene, rig, request)
        return float(_found("core.quality.judge")(fresh, focus).cost.value)
    fresh = _found("core.planning.formulation.formulate_problem")(scene, rig, request, fresh=True)
    estimate = _found("core.planning.quality.estimate_quality")
    return float(estimate(fresh, focus, rig).cost.value)


def camera_tuples(problem: Any) -> Any:
    """Return the pairs of cameras that ``k_view`` moves together."""
    function = _found(
        "core.problem.camera_tuples.camera_tuples",
        "core.tuples.camera_tuples",  # 0.1
    )
    return function(problem, 2, "all", None)


def _found(*places: str) -> Any:
    """Return what is at the first of these places that this revision has."""
    for place in places:
        module, _, name = f"focus_planner.{place}".rpartition(".")
        try:
            return getattr(import_module(module), name)
        except (ModuleNotFoundError, AttributeError):
            continue
    raise LookupError(f"this revision has none of {', '.join(places)}")
