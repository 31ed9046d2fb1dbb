# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Random requests of ``~/plan_focus``, many at once."""

from __future__ import annotations

from collections import Counter
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from benchmarks.attacks.victim import Victim
from benchmarks.fuzz.campaign import INTERNAL, LOST, campaign
from benchmarks.fuzz.random_requests import random_request
from benchmarks.guarantees import Outcome, own_graph, report
from focus_planner.runtime.reason import Reason

_IN_FLIGHT = 32
_PATIENCE = 120.0


def run(console: Console) -> bool:
    """Print the table; return whether all guarantees held."""
    with own_graph() as folder:
        return report(console, "Random requests", [partial(_requests, folder)])


def _requests(folder: Path) -> Outcome:
    waiting = {"service_max_wait": _PATIENCE, "time_budget": 0.2, "samples": 50}
    return campaign("calls of ~/plan_focus", folder, _fire, **waiting)


def _fire(one: Victim, random: np.random.Generator, count: int) -> Counter[str]:
    answers: Counter[str] = Counter()
    calls: list[Any] = []
    for _ in range(count):
        calls.append(one.client.plan_async(**random_request(random)))
        if len(calls) == _IN_FLIGHT:
            answers[_answer(one, calls.pop(0))] += 1
    for call in calls:
        answers[_answer(one, call)] += 1
    return answers


def _answer(one: Victim, call: Any) -> str:
    try:
        answer = one.client.wait_for(call, _PATIENCE)
    except TimeoutError:
        return LOST
    return told(answer)


def told(answer: Any) -> str:
    """Return what an answer, or a result, counts as."""
    reason = Reason(answer.reason)
    if reason is Reason.INTERNAL or not (answer.success or answer.message):
        return INTERNAL
    return f"{'planned' if answer.success else 'refused'}: {reason.name.lower()}"
