# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The planning process: parses inputs and plans, apart from the node, which serves meanwhile.

Importing this module loads the solvers, which takes seconds.
"""

from __future__ import annotations

import functools
import gc
import math
import resource
import time
import traceback
from collections.abc import Collection
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from focus_planner.core.planning.fingerprint import Fingerprint, fingerprints
from focus_planner.core.planning.plan import SolvedPlan
from focus_planner.core.planning.precompile import missing_kernels, precompile, works_for
from focus_planner.core.planning.request import PlanRequest
from focus_planner.core.planning.work import PLANS, Work
from focus_planner.core.progress import Progress
from focus_planner.core.rig.rig import Rig
from focus_planner.core.validation import InputError
from focus_planner.runtime import planning_orders as orders
from focus_planner.runtime.description import ShownPlan
from focus_planner.runtime.feedback import Feedback
from focus_planner.runtime.inputs import Arrival
from focus_planner.runtime.planner import NotReady, Planner, internal_error
from focus_planner.runtime.status import without_problem

# Between looks at what the node says, while a plan is being made.
_SECONDS_BETWEEN_LOOKS = 0.005
# Between two that say how much of a surface is prepared.
_SECONDS_BETWEEN_SHARES = 0.1
# Says Python where there is no memory for the stack of a thread.
_NO_THREAD = "can't start new thread"
# Linux ends this process before any other of the machine when memory runs out.
_FIRST_TO_GO = "1000"


def serve(connection: Connection) -> None:
    """Carry out orders until the node closes the connection."""
    with suppress(OSError):
        Path("/proc/self/oom_score_adj").write_text(_FIRST_TO_GO, encoding="utf-8")
    PlanningProcess(connection).serve()


class _ConnectionLog:
    """Sends what is logged to the node."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def warning(self, message: str) -> None:
        """Send a warning."""
        self._connection.send(orders.Logged(False, message))

    def error(self, message: str) -> None:
        """Send an error."""
        self._connection.send(orders.Logged(True, message))


class PlanningProcess:
    """Carries out the orders of a node, one at a time.

    Parameters
    ----------
    connection : Connection
        To the node.
    """

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._new_rig: Rig | None = None
        self._planner = Planner(
            _ConnectionLog(connection), self._note_rig, self._announce, self._tell_share
        )
        self._told_share = -math.inf  # when
        self._recorded: SolvedPlan | None = None  # until it has been described
        self._shown: dict[str, ShownPlan] = {}
        self._unlimited_memory = 0
        self._unloaded: list[Work] = []

    def serve(self) -> None:
        """Carry out orders until the connection ends."""
        with suppress(EOFError, ConnectionError):
            while True:
                while self._unloaded and not self._connection.poll():
                    self._load_more()
                order = self._connection.recv()
                if not isinstance(order, (orders.Stop, orders.GoOn)):  # too late for the last plan
                    self._connection.send(self._carry_out(order))

    def _carry_out(self, order: Any) -> orders.Result:
        try:
            return self._do(order)
        except NotReady as error:
            return orders.NotReadyYet(str(error))
        except InputError as error:
            return orders.Refused(str(error))
        except MemoryError:
            return orders.OutOfMemory()
        except (EOFError, ConnectionError):
            raise
        except Exception as error:  # noqa: BLE001 - told to the caller; the log has the details
            if str(error) == _NO_THREAD:
                return orders.OutOfMemory()
            return orders.Failed(internal_error(error), traceback.format_exc())

    @functools.singledispatchmethod
    def _do(self, order: Any) -> orders.Result:
        raise NotImplementedError(type(order))

    @_do.register
    def _load(self, _: orders.Load) -> orders.Result:
        works: Collection[Work] = PLANS
        if not missing_kernels(PLANS):
            # What most plans run; the rest while there is nothing else to do.
            works, self._unloaded = works_for(PlanRequest(), clouds=False), list(PLANS)
        compiled = precompile(
            works, lambda progress: self._connection.send(orders.Compiling(progress))
        )
        if compiled.kernels:
            self._connection.send(orders.Compiled(str(compiled), compiled.folder is not None))
        self._unlimited_memory = _data_bytes()
        _spare_the_loaded()
        return orders.Done()

    @_do.register
    def _digest(self, order: orders.Digest) -> orders.Result:
        self._limit_memory(order.max_memory)
        self._recorded = None
        self._condense()
        planner = self._planner
        planner.surface.keep(order.subjects)
        for slot, arrivals, unheard in (
            (planner.surface, order.surfaces, order.unheard[0]),
            (planner.rig, order.rigs, order.unheard[1]),
        ):
            slot.unheard = unheard
            for arrival in arrivals:
                slot.receive(arrival)
        planner.digest(order.optics, order.subjects)
        rig, self._new_rig = self._new_rig, None
        return orders.Digested(
            surface=planner.surface.state,
            rig=planner.rig.state,
            surfaces=planner.surface.states,
            subjects=tuple(each.arrival.number for each in planner.surface.all_in_force),
            in_force=(_number(planner.surface.in_force), _number(planner.rig.in_force)),
            needed=tuple(arrival.number for arrival in planner.arrivals()),
            kept=tuple(arrival.number for arrival in planner.kept()),
            new_rig=None if rig is None else _what_a_node_needs(rig),
            refused_surfaces=planner.surface.take_refused(),
        )

    @_do.register
    def _plan(self, order: orders.Plan) -> orders.Result:
        self._shown = {name: each for name, each in self._shown.items() if name == order.in_force}
        feedback = Feedback(order.request.time_budget)
        looked, stopped = time.monotonic(), False

        def on_progress(progress: Progress) -> bool:
            nonlocal looked, stopped
            if order.is_recorded:
                self._connection.send(orders.Step(progress))
            standing = feedback.standing(progress)
            if standing is not None:
                self._connection.send(orders.Feedback(standing))
            if order.is_recorded and progress.stage == "solving" and not stopped:
                stopped = isinstance(self._connection.recv(), orders.Stop)
            now = time.monotonic()
            if now - looked > _SECONDS_BETWEEN_LOOKS:
                looked = now
                while self._connection.poll():
                    stopped = isinstance(self._connection.recv(), orders.Stop) or stopped
            return not stopped

        self._planner.warm_start = order.warm_start
        plan, rig, reminder = self._planner.plan(
            order.request,
            order.model,
            on_progress,
            warm_start=order.keep_warm,
            min_change=order.min_change,
            was_asked_for=order.was_asked_for,
            limits=order.limits,
        )
        self._shown[order.plan_id] = ShownPlan(plan, rig)
        if order.is_recorded:
            self._recorded = plan
        return orders.Planned(
            plan=without_problem(plan),
            stop_log=plan.stop_log,
            warm_start=self._planner.warm_start,
            reminder=reminder,
        )

    @_do.register
    def _describe(self, order: orders.Describe) -> orders.Result:
        shown, visuals = self._shown.get(order.plan_id), None
        if shown and order.visuals_stamp is not None:
            visuals = shown.visuals(order.visuals_stamp)
        return orders.Description(self._fingerprints() if order.for_record else (), visuals)

    def _load_more(self) -> None:
        """Load what another kind of work runs."""
        before = _data_bytes()
        with suppress(Exception):  # plans that run it will tell what is wrong
            precompile((self._unloaded.pop(0),))
        self._unlimited_memory += _data_bytes() - before
        _spare_the_loaded()

    def _condense(self) -> None:
        """Give back the memory of plans that may be shown; all of it, if there is too little."""
        try:
            for shown in self._shown.values():
                shown.condense()
        except MemoryError:
            self._shown.clear()

    def _fingerprints(self) -> tuple[Fingerprint, ...]:
        assert self._recorded is not None
        plan, self._recorded = self._recorded, None
        return fingerprints(plan)

    def _note_rig(self, rig: Rig) -> None:
        self._new_rig = rig

    def _announce(self, arrival: Arrival[Any]) -> None:
        self._connection.send(orders.Reading(arrival.number))

    def _tell_share(self, share: float) -> None:
        now = time.monotonic()
        if now - self._told_share > _SECONDS_BETWEEN_SHARES:
            self._told_share = now
            self._connection.send(orders.Preparing(share))

    def _limit_memory(self, max_memory: int) -> None:
        """Let allocations fail beyond a limit, rather than take what others need."""
        most = self._unlimited_memory + max_memory if max_memory else resource.RLIM_INFINITY
        _, hard = resource.getrlimit(resource.RLIMIT_DATA)
        if hard != resource.RLIM_INFINITY:
            most = hard if most == resource.RLIM_INFINITY else min(most, hard)
        resource.setrlimit(resource.RLIMIT_DATA, (most, hard))


def _spare_the_loaded() -> None:
    """Have kernels and modules never be looked through for garbage: it takes as long as a plan."""
    gc.freeze()


def _what_a_node_needs(rig: Rig) -> orders.RigInForce:
    return orders.RigInForce(rig.frame_id, tuple(camera.name for camera in rig.cameras))


def _number(accepted: Any) -> int | None:
    return None if accepted is None else accepted.arrival.number


def _data_bytes() -> int:
    """Return what counts towards RLIMIT_DATA so far."""
    for line in Path("/proc/self/status").read_text(encoding="utf-8").splitlines():
        if line.startswith("VmData:"):
            return int(line.split()[1]) * 1024
    return 0
