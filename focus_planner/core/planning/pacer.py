# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Whether to go on: the time budget, the caller's callback and a log of stops, asked together."""

from __future__ import annotations

import math
from collections.abc import Callable

from focus_planner.core.planning.stop_log import Answer, StopLog, StopRecorder, StopReplay
from focus_planner.core.planning.time_budget import TimeBudget
from focus_planner.core.progress import Progress, ProgressCallback, never_stop

# Stages without a plan have no cost yet.
_NO_COST = math.nan
# Samples that are planned on at once when a caller stops the plan and waits for it.
_ENOUGH_TO_STOP = 4096


class Pacer:
    """Decides after every step whether to take another, and logs the decision.

    Solvers and bounds take it as their ``on_progress``. It stops them when the next step would
    not fit into the time budget, and from the moment at which the callback returned False. The
    callback is not called again after that.

    Parameters
    ----------
    budget : TimeBudget
    on_progress : ProgressCallback, optional
        The caller's.
    replayed : StopLog, optional
        Of an earlier plan, to answer in place of the time budget.

    Attributes
    ----------
    budget : TimeBudget
    stopped : bool
        Whether the current solver or bound was told to stop.
    callback_stopped : bool
        Whether the callback returned False: the caller is waiting for the plan.
    samples_left_out : bool
        Whether the plan is for fewer samples than were asked for.
    """

    def __init__(
        self,
        budget: TimeBudget,
        on_progress: ProgressCallback = never_stop,
        replayed: StopLog | None = None,
    ) -> None:
        self.budget = budget
        self._callback = on_progress
        self._replay = None if replayed is None else StopReplay(replayed)
        self._recorder = StopRecorder()
        self._questions = 0
        self.stopped = False
        self.callback_stopped = False
        self.samples_left_out = False

    @property
    def stop_log(self) -> StopLog:
        """What was decided so far."""
        return self._recorder.log

    @property
    def may_stop(self) -> bool:
        """Whether anything could ever end the plan early."""
        return self._callback is not never_stop or self.budget.limited or self._replay is not None

    def enough(self) -> float:
        """Return how many of the samples with rays cast are enough, now that no more are."""
        return _ENOUGH_TO_STOP if self.callback_stopped else math.inf

    def within(self, stage: str, budget_share: float) -> Callable[[float], bool]:
        """Return what to call between parts of a stage that may take a share of the budget.

        It is given the share of the stage that is done.
        """

        def keep_going(done: float) -> bool:
            self._questions += 1
            step = Progress(stage, self._questions, _NO_COST, share=done)
            self._ask(step, Answer.CALLBACK_STOP)
            more = self._decide(self.budget.has_share_left(budget_share))
            self.samples_left_out = self.samples_left_out or not more
            return more

        return keep_going

    def untimed(self, stage: str) -> Callable[[], bool]:
        """Return what to call between parts of a stage that may take whatever time it needs."""

        def keep_going() -> bool:
            self._questions += 1
            self._ask(Progress(stage, self._questions, _NO_COST), Answer.CALLBACK_STOP_UNTIMED)
            return not self.callback_stopped

        return keep_going

    def start_solver(self, cells_seconds: float, shots: int = 1, *, bound: bool = False) -> None:
        """Tell the callback that solving begins; see :meth:`TimeBudget.start_solver`."""
        # A stop here is logged, and replayed, as one at the solver's first step.
        self._ask(Progress("solving", 0, _NO_COST), Answer.CALLBACK_STOP, replay=False)
        self.budget.start_solver(cells_seconds, shots, bound=bound)
        self.stopped = self.callback_stopped

    def start_bound(self) -> None:
        """Let the bound use the time reserved for it."""
        self.budget.start_bound()
        self.stopped = self.callback_stopped

    def __call__(self, progress: Progress) -> bool:
        """Return whether a solver or bound is to go on after this step."""
        fits = self.budget.next_step_fits(progress.stage)
        self._ask(progress, Answer.CALLBACK_STOP)
        self.stopped = not self._decide(fits and not self.stopped)
        return not self.stopped

    def _ask(self, progress: Progress, stop: Answer, *, replay: bool = True) -> None:
        """Ask the callback, and the replayed log for its stop, unless one stopped before."""
        if self.callback_stopped:
            return
        self.callback_stopped = not self._callback(progress) or (
            replay and self._replay is not None and self._replay.callback_stops(stop)
        )
        if self.callback_stopped:
            self._recorder.add(stop)

    def _decide(self, in_time: bool) -> bool:
        """Return, and log, the answer to a timed question."""
        more = in_time if self._replay is None else self._replay.answer()
        more = more and not self.callback_stopped
        self._recorder.add(Answer.CONTINUE if more else Answer.STOP)
        return more
