# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Callers who ask for too much: nobody is shut out, and what they took is given back."""

from __future__ import annotations

import re
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from focus_planner_msgs.srv import PlanFocus
from rich.console import Console

from benchmarks.attacks.table import Attack, Seen, attack, report
from benchmarks.attacks.victim import PATIENCE, Victim, until, victim
from benchmarks.processes import family, processor_seconds
from benchmarks.scenes import body_scenes, rig
from focus_planner import Mesh
from focus_planner.ros.client import PlannerClient

_TIME_LIMIT = PlanFocus.Response.REASON_TIME_LIMIT
_BAD_REQUEST = PlanFocus.Response.REASON_BAD_REQUEST
_BUSY = PlanFocus.Response.REASON_BUSY
_HUGE = {"method": "optimal", "samples": 2_000_000, "shots": 16}
_LONG = {"method": "optimal", "samples": 500_000, "gap": 1e-12}
_MODEST = {"method": "em", "samples": 1000}
_OTHERS = 9
_SECONDS = 30.0
# Seconds: the parameter's default, and what a modest plan takes on a busy machine.
_WAIT, _PLAN = 5.0, 3.0
# Seconds within which work ends and its memory is back, and the MiB that may be kept.
_ENDED, _KEPT = 1.0, 150.0
# Of processor time within two seconds: what a node that does not plan takes.
_IDLE = 0.6
# The longest duration of a request that would take far longer, seconds.
_LONGEST = 3.0
# Parameters, and samples that are too many for each.
_LIMITS = (("max_problem_size", 120_000, 50_000), ("max_memory", 200_000_000, 1_000_000))
_FITS = re.compile(r"at most ([\d,]+)")
_MOMENTS = (0.3, 1.0, 3.0, 6.0, 15.0)


def run(console: Console) -> bool:
    """Print the table; return whether all attacks held."""
    ends = [
        Attack(
            f"{how} {moment:g} s into {_LONG['samples']:,} samples by optimal",
            f"the answer, the end of the work and the memory back within {_ENDED:g} s each",
            partial(_end_midway, how, moment),
        )
        for how in _ENDING
        for moment in _MOMENTS
    ]
    limits = [
        Attack(
            f"a request beyond {parameter} {value:,}",
            "refused in words that tell what would fit, and that is planned",
            partial(_beyond, {parameter: value}, samples),
        )
        for parameter, value, samples in _LIMITS
    ]
    return report(
        console, "5. Nobody can shut the others out", [huge, greedy, endless, *limits, *ends]
    )


@attack(
    f"{_HUGE['samples']:,} samples × {_HUGE['shots']} shots by optimal,"
    f" with {_OTHERS} other callers",
    f"refused in words or bounded; each of the others is answered within {_WAIT + _PLAN:g} s"
    f" (service_max_wait {_WAIT:g}), and most of them get plans",
)
def huge(folder: Path) -> Seen:
    """Ask for the most while others ask for little."""
    with victim(folder, inputs=False, service_max_wait=_WAIT, fresh_samples=1024) as one:
        _put_body(one)
        one.client.plan(PATIENCE, **_MODEST)
        call = one.client.plan_async(**_HUGE)
        others = [_Caller(one.node.name) for _ in range(_OTHERS)]
        _at_once([partial(other.ask_until, time.monotonic() + _SECONDS) for other in others])
        peak = one.watch.peak
        said = call.result().message if call.done() else "nothing yet"
        unclear = call.done() and not call.result().success and not said
    waits = [wait for other in others for wait in other.waits]
    planned, busy = (sum(getattr(other, what) for other in others) for what in ("planned", "busy"))
    slowest = max(waits, default=_SECONDS)
    least = min(other.planned for other in others)
    observed = (
        f"peak {peak:.0f} MiB; told: {said[:160]!r}; the others: {planned} plans, {busy} told"
        f" busy, slowest answer {slowest:.1f} s, at least {least} plans each"
    )
    return Seen(observed, slowest < _WAIT + _PLAN and least > 0 and not unclear, len(waits))


@attack(
    "one caller keeps 40 requests waiting, another one asks for one at a time",
    f"the modest one gets its plans, each within {_WAIT + _PLAN:g} s",
)
def greedy(folder: Path) -> Seen:
    """Fill the queue from one client."""
    with victim(folder, inputs=False, service_max_wait=_WAIT, fresh_samples=1024) as one:
        _put_body(one)
        one.client.plan(PATIENCE, **_MODEST)
        modest, ends = _Caller(one.node.name), time.monotonic() + _SECONDS
        flood = threading.Thread(target=_flood, args=(one.node.name, ends))
        flood.start()
        time.sleep(1.0)
        modest.ask_until(ends)
        flood.join()
    slowest = max(modest.waits)
    observed = f"{modest.planned} plans, {modest.busy} told busy, slowest {slowest:.1f} s"
    held = modest.planned > 0 and not modest.busy and slowest < _WAIT + _PLAN
    return Seen(observed, held, len(modest.waits))


@attack(
    f"{_LONG['samples']:,} samples by optimal with max_planning_time {_LONGEST:g} s",
    f"answered within {_LONGEST + _PLAN:g} s that this was the reason, and idle afterwards",
)
def endless(folder: Path) -> Seen:
    """Ask for a plan that takes longer than any may."""
    with victim(folder, inputs=False, max_planning_time=_LONGEST, fresh_samples=1024) as one:
        _put_body(one)
        one.client.plan(PATIENCE, **_MODEST)
        began = time.perf_counter()
        answer = one.client.plan(4 * PATIENCE, **_LONG)
        took = time.perf_counter() - began
        spent = _spent_in_two_seconds(one)
        again = one.client.plan(PATIENCE, **_MODEST).success
    plan = "a plan" if answer.success else "no plan"
    observed = (
        f"{plan} after {took:.1f} s, {answer.message[:120]!r}; then {spent:.1f} s of 2 s busy"
    )
    held = answer.reason == _TIME_LIMIT and took < _LONGEST + _PLAN and spent < _IDLE
    return Seen(observed, held and again and bool(answer.message))


def _beyond(limit: dict[str, int], samples: int, folder: Path) -> Seen:
    """Ask for too much, then for as much as the refusal allows."""
    with victim(folder, fresh_samples=256, **limit) as one:
        request = {"method": "em", "bound": "none"}
        refused = one.client.plan(PATIENCE, **request, samples=samples)
        told = _FITS.search(refused.message)
        fits = int(told[1].replace(",", "")) if told else 0
        taken = one.client.plan(4 * PATIENCE, **request, samples=fits or samples)
    observed = f"told {refused.message[:160]!r}; {fits:,} planned: {taken.success}"
    held = refused.reason == _BAD_REQUEST and 0 < fits < samples and taken.success
    return Seen(observed if taken.success else f"{observed}, {taken.message[:160]!r}", held)


def _end_midway(how: str, moment: float, folder: Path) -> Seen:
    """End a long plan, and look at what the node does and holds afterwards."""
    with victim(folder, inputs=False, fresh_samples=1024) as one:
        _put_body(one)
        one.client.plan(PATIENCE, **_MODEST)
        before = one.node.memory
        goal = one.client.send_goal(**_LONG)
        assert goal.accepted
        time.sleep(moment)
        during, began = one.node.memory, time.perf_counter()
        said = _ENDING[how](one, goal)
        answered = time.perf_counter() - began
        time.sleep(max(0.0, _ENDED - (time.perf_counter() - began)))
        # It is published ten times a second at most.
        status = one.client.status()
        spent = _spent_in_two_seconds(one)
        after = one.node.memory
        if how == "deactivating":
            assert one.client.change_state("activate")
        until(lambda: one.client.plan(PATIENCE, **_MODEST).success, "no plan afterwards")
    held = answered < _ENDED and spent < _IDLE and after - before < _KEPT and not status.planning
    observed = (
        f"answered after {answered:.2f} s, {said[:60]!r}; {spent:.1f} s of processor time in the"
        f" two seconds from {max(answered, _ENDED):.1f} s on; memory {before:.0f}, then"
        f" {during:.0f}, then {after:.0f} MiB{'; still planning' if status.planning else ''}"
    )
    return Seen(observed, held)


def _cancel(_: Victim, goal: Any) -> str:
    goal.cancel()
    return str(goal.result(PATIENCE)[1].message)


def _deactivate(one: Victim, goal: Any) -> str:
    assert one.client.change_state("deactivate")
    return str(goal.result(PATIENCE)[1].message)


_ENDING: dict[str, Callable[[Victim, Any], str]] = {
    "cancelling": _cancel,
    "deactivating": _deactivate,
}


def _spent_in_two_seconds(one: Victim) -> float:
    before = processor_seconds(family(one.node.pid))
    time.sleep(2.0)
    return processor_seconds(family(one.node.pid)) - before


@dataclass
class _Caller:
    """A caller of its own who asks for little, again and again."""

    planner: str
    waits: list[float] = field(default_factory=list)
    planned: int = 0
    busy: int = 0

    def ask_until(self, ends: float) -> None:
        with PlannerClient(self.planner) as client:
            while time.monotonic() < ends:
                began = time.perf_counter()
                answer = client.plan(4 * PATIENCE, **_MODEST)
                self.waits.append(time.perf_counter() - began)
                self.planned += answer.success
                self.busy += answer.reason == _BUSY


def _flood(planner: str, ends: float) -> None:
    with PlannerClient(planner) as client:
        calls: list[Any] = []
        seed = 0
        while time.monotonic() < ends:
            calls = [call for call in calls if not call.done()]
            while len(calls) < 40:
                seed += 1
                calls.append(client.plan_async(method="k_view", samples=4096, seed=seed))
            time.sleep(0.05)


def _at_once(functions: list[Callable[[], None]]) -> None:
    threads = [threading.Thread(target=function) for function in functions]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()


def _put_body(one: Victim) -> None:
    body = next(iter(body_scenes().values())).surface
    assert isinstance(body, Mesh)
    one.client.publish_rig(rig())
    one.client.publish_mesh(body)
