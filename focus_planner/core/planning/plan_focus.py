# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Planning: the one path for every front end."""

from __future__ import annotations

import time
from collections.abc import Callable

from focus_planner.core.planning.plan import SolvedPlan, WarmStart
from focus_planner.core.planning.precompile import precompile, works_for
from focus_planner.core.planning.request import PlanRequest
from focus_planner.core.planning.resource_limits import ResourceLimits
from focus_planner.core.planning.solving import solve
from focus_planner.core.planning.stop_log import StopLog
from focus_planner.core.planning.subjects import Scenes, subjects_of
from focus_planner.core.problem.cost_model import CostModel
from focus_planner.core.progress import Progress, ProgressCallback, never_stop
from focus_planner.core.rig.rig import Rig
from focus_planner.core.surface.surface import PointCloud


def plan_focus(
    scene: Scenes,
    rig: Rig,
    request: PlanRequest | None = None,
    model: CostModel | None = None,
    on_progress: ProgressCallback = never_stop,
    warm_start: WarmStart | None = None,
    stop_log: StopLog | None = None,
    *,
    min_change: float = 0.0,
    limits: ResourceLimits | None = None,
    clock: Callable[[], float] = time.perf_counter,
) -> SolvedPlan:
    """Sample the surface, find what each camera sees, and solve for the focus distances.

    The same arguments give the same plan, bit for bit except for its seconds, unless the time
    budget or the callback ends it early.

    What such a request runs is compiled first, once for all processes of a machine. That is a
    stage of its own ("compiling"), and counts neither as part of the plan's seconds nor against
    its time budget; see :func:`focus_planner.core.planning.precompile.precompile`.

    Parameters
    ----------
    scene : Scene, or sequence of Scene or Subject
        Of the surface, in the rig's frame. Several are planned for together, each alone in front
        of the rig: their costs count the same, or as the weights of
        :class:`~focus_planner.core.planning.subjects.Subject` say, and numbers of samples are those
        of each.
    rig : Rig
    request : PlanRequest, optional
    model : CostModel, optional
        The paper's constants by default.
    on_progress : ProgressCallback, optional
        Called before and after every kernel that is compiled ("compiling"), after every part of
        ray casting (stages "fresh" and "visibility") and of the search for cells ("cells"), when
        the solver is about to start ("solving"), and after every step of the solver and of the
        bound ("prices"). Return False to stop; the plan is then the best found so far. There is no
        cost before the solver's first step. While kernels are compiled there is nothing to return
        yet: a stop waits for them, whereas an exception ends the call.
    warm_start : WarmStart, optional
        From a plan for a similar surface, rig and request: the solver starts from it, and the plan
        depends on it.
    stop_log : StopLog, optional
        Of a plan that a time budget or a callback ended, to make it again, bit for bit; the time
        budget is not looked at.
    min_change : float, optional
        With a warm start: a lens whose focus would change by at most this fraction of its depth of
        field stays where the earlier plan has it; see
        :func:`focus_planner.core.planning.holding.held_distances`. 0 for none.
    limits : ResourceLimits, optional
        What the plan may take; by default whatever it needs.
    clock : callable, optional
        Returns seconds, monotonic; measures the time budget and the plan's seconds.

    Raises
    ------
    InputError
        If the request does not fit the rig or the surface, no camera sees the surface, or the
        standard error would take too many samples, or the plan takes more than the limits allow.
        The message names the probable mistake.
    RuntimeError
        If the process was forked from one in which threads of GNU OpenMP ran already: nothing can
        be planned there.
    """
    request = request or PlanRequest()
    is_stopped = False

    def note(progress: Progress) -> None:
        nonlocal is_stopped
        is_stopped = is_stopped or not on_progress(progress)

    subjects = subjects_of(scene)
    clouds = any(isinstance(each.scene.surface, PointCloud) for each in subjects)
    precompile(works_for(request, clouds=clouds), note)
    return solve(
        subjects,
        rig,
        request,
        model,
        (lambda _: False) if is_stopped else on_progress,
        warm_start,
        stop_log,
        min_change=min_change,
        limits=limits,
        clock=clock,
    )
