# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The planning thread: hands inputs and requests to the planning process, in order of arrival."""

from __future__ import annotations

import time
from collections.abc import Callable
from concurrent.futures import Future as Job
from concurrent.futures import ThreadPoolExecutor, wait

from focus_planner.core.progress import Standing
from focus_planner.core.rig.rig import Rig
from focus_planner.core.surface.surface import Surface
from focus_planner.messages.typestore import RIG, serialize
from focus_planner.recording.naming import new_run_id
from focus_planner.recording.software import software
from focus_planner.ros.planning_host import PlanningHost
from focus_planner.ros.request_planner import RequestPlanner
from focus_planner.runtime.feedback import Teller
from focus_planner.runtime.inputs import Arrival, Unheard
from focus_planner.runtime.log import Log, log_exception
from focus_planner.runtime.reason import Reason
from focus_planner.runtime.remote_planner import PlanningDied, PlanningEnded, Wish
from focus_planner.runtime.replanning import Replanned
from focus_planner.runtime.requests import NewestOnly, Request, Turns, unasked
from focus_planner.runtime.status import Snapshot


class PlanningThread:
    """One thread that waits for the planning process, so that no other has to.

    Parameters
    ----------
    host : PlanningHost
    """

    def __init__(self, host: PlanningHost) -> None:
        self._log: Log = host.get_logger()
        self._info: Callable[[str], object] = host.get_logger().info
        self._wished = Wish.GO_ON
        self._requests = RequestPlanner(host, lambda: self._wished)
        self._thread = ThreadPoolExecutor(max_workers=1, thread_name_prefix="planning")
        self._jobs: set[Job[None]] = set()
        self._turns = Turns()
        self._replans = NewestOnly()
        self._is_warm = False
        #: How far compiling is, in words; empty while nothing is compiled.
        self.compiling = ""

    def load(self) -> bool:
        """Compile or load all kernels; return False if :meth:`stop` interrupted that."""
        self._enqueue(self._warm_up)
        wait(self._jobs.copy())
        return self._is_warm

    def receive_surface(self, arrival: Arrival[Surface], *, to_replan: bool = False) -> None:
        """Keep a surface; queue its parsing, or leave that to :meth:`replan`."""
        self._requests.planner.surface.receive(arrival)
        if to_replan:
            self._requests.surfaces.receive(arrival.number)
        else:
            self._enqueue(self._digest)

    def receive_rig(self, arrival: Arrival[Rig]) -> None:
        """Keep a rig, and queue its parsing."""
        self._requests.planner.rig.receive(arrival)
        self._enqueue(self._digest)

    def note_unheard(self, surface: Unheard, rig: Unheard) -> None:
        """Note which publishers of surfaces and rigs are not received."""
        planner = self._requests.planner
        if (planner.surface.unheard, planner.rig.unheard) != (surface, rig):
            planner.surface.unheard, planner.rig.unheard = surface, rig
            self._enqueue(self._digest)

    def plan(self, request: Request) -> None:
        """Queue a request, and end a plan that nobody asked for."""
        self._turns.add(request)
        self._replans.stop(Reason.PREEMPTED)
        if not self._enqueue(self._answer_next):
            request.abort(Reason.SHUTTING_DOWN)

    def replan(self, request: Request) -> None:
        """Queue a plan for the newest surface, in place of one that waits, after requests."""
        if self._replans.put(request):
            self._enqueue(self._replan)

    @property
    def replanning(self) -> str:
        """The name of the plan being made that nobody asked for; empty if there is none."""
        return self._replans.planned

    @property
    def replanned(self) -> Replanned:
        """What became of the surfaces that were to be planned for."""
        return self._requests.surfaces.counts

    @property
    def surfaces_wait(self) -> bool:
        """Whether a surface waits that was to be planned for."""
        return self._requests.surfaces.are_waiting

    def show(self) -> None:
        """Queue showing the plan in force to who has begun to watch, after waiting requests."""
        self._enqueue(self._show)

    def show_if_due(self) -> None:
        """Show the plan in force if that was put off; to be called now and then."""
        if self._requests.shown.is_due:
            self.show()

    def resume(self) -> None:
        """Work, after :meth:`pause`."""
        if self._wished is Wish.STOP:
            self._wished = Wish.GO_ON
            self._enqueue(self._digest)

    def pause(self) -> None:
        """End what is being done within a second; inputs are kept."""
        self._replans.clear(Reason.INACTIVE)
        if self._wished is Wish.GO_ON:
            self._wished = Wish.STOP

    def stop(self) -> None:
        """Drop queued jobs, and end the planning process."""
        self._replans.clear(Reason.SHUTTING_DOWN)
        self._wished = Wish.END
        self._thread.shutdown(wait=False, cancel_futures=True)

    def finish(self, timeout: float) -> bool:
        """Wait, after :meth:`stop`, until planning and recording end; return False on timeout."""
        until = time.monotonic() + timeout
        ended = not wait(self._jobs.copy(), timeout).not_done
        self._requests.planner.close()
        recorded = self._requests.recorder.close(max(until - time.monotonic(), 0.0))
        if not recorded:
            self._log.error("some runs are only partly recorded: writing them took too long")
        return recorded and ended

    @property
    def snapshot(self) -> Snapshot:
        """The inputs and the last run, as of now."""
        return self._requests.snapshot

    @property
    def pid(self) -> int | None:
        """The planning process; None while there is none."""
        return self._requests.planner.pid

    @property
    def recording_failure(self) -> str:
        """Why the last run is not recorded; empty if it is, or need not be."""
        return self._requests.recording_failure

    @property
    def runs_to_write(self) -> int:
        """How many jobs the recorder has."""
        return self._requests.recorder.jobs

    def _enqueue(self, job: Callable[[], None]) -> bool:
        """Queue a job; return False after :meth:`stop`."""
        try:
            future = self._thread.submit(self._guard, job)
        except RuntimeError:
            return False
        self._jobs.add(future)
        future.add_done_callback(self._jobs.discard)
        return True

    def _guard(self, job: Callable[[], None]) -> None:
        try:
            job()
        except Exception:  # noqa: BLE001 - no message may end the node
            log_exception(self._log)

    def _digest(self) -> None:
        self._requests.digest(self._turns.waiting)

    def _answer_next(self) -> None:
        request = self._turns.next()
        if request is not None:
            self._requests.answer(request)

    def _replan(self) -> None:
        if self._turns.waiting():
            self._enqueue(self._replan)  # each of those has its job before it
            return
        request = self._replans.take()
        if request is None or self._wished is not Wish.GO_ON:
            return
        try:
            outcome = self._requests.replan(request)
        finally:
            self._replans.done()
        if outcome is not None and outcome.reason is Reason.PREEMPTED:
            self.replan(unasked(request.settings, new_run_id()))

    def _show(self) -> None:
        if self._turns.waiting():
            self.show()
        else:
            self._requests.shown.show()

    def _warm_up(self) -> None:
        # The first calls take some time.
        software()
        serialize(RIG, {})
        teller = Teller(self._info, "start", self._note_compiling)

        def wish() -> Wish:
            teller.look()
            return self._wished

        try:
            compiled = self._requests.planner.load(wish, teller.note)
            self._is_warm = True
            if compiled:
                self._info(compiled)
        except PlanningEnded:
            pass
        except PlanningDied as error:
            self._log.error(f"the planning process does not start: {error}")
        finally:
            self.compiling = ""

    def _note_compiling(self, standing: Standing) -> None:
        if not self.compiling:
            self._info(standing.doing)
        self.compiling = str(standing)
