# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Random goals of ``~/plan`` from several clients, many of them cancelled at any time."""

from __future__ import annotations

import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from functools import partial
from pathlib import Path

import numpy as np
from rich.console import Console

from benchmarks.attacks.victim import Victim
from benchmarks.fuzz.campaign import LOST, campaign
from benchmarks.fuzz.random_requests import random_request
from benchmarks.fuzz.requests import told
from benchmarks.guarantees import Outcome, own_graph, report
from focus_planner.ros.client import Goal, PlannerClient

_CLIENTS, _IN_FLIGHT = 4, 6
_PATIENCE = 120.0
_CANCELLED = 0.4


def run(console: Console) -> bool:
    """Print the table; return whether all guarantees held."""
    with own_graph() as folder:
        return report(console, "Random goals", [partial(_goals, folder)])


def _goals(folder: Path) -> Outcome:
    with ExitStack() as stack:
        fire = partial(_fire, stack, [])
        return campaign("goals of ~/plan", folder, fire, time_budget=0.2, samples=50)


def _fire(
    stack: ExitStack,
    clients: list[PlannerClient],
    one: Victim,
    random: np.random.Generator,
    count: int,
) -> Counter[str]:
    # The same clients throughout: on a busy machine the middleware drops what a server answers to
    # one that it has not discovered yet.
    while len(clients) < _CLIENTS:
        clients.append(stack.enter_context(PlannerClient(one.node.name)))
    shares = [count // _CLIENTS + (k < count % _CLIENTS) for k in range(_CLIENTS)]
    seeds = random.integers(2**32, size=_CLIENTS)
    with ThreadPoolExecutor(_CLIENTS) as pool:
        return sum(pool.map(_send_all, clients, seeds, shares), Counter())


def _send_all(client: PlannerClient, seed: int, count: int) -> Counter[str]:
    random = np.random.default_rng(seed)
    answers: Counter[str] = Counter()
    goals: list[Goal] = []
    for _ in range(count):
        goals.append(client.send_goal(**random_request(random)))
        if random.random() < _CANCELLED and goals[-1].accepted:
            time.sleep(random.choice([0.0, 0.002, 0.02]))
            goals[-1].cancel()
        if len(goals) == _IN_FLIGHT:
            answers[_answer(goals.pop(0))] += 1
    for goal in goals:
        answers[_answer(goal)] += 1
    return answers


def _answer(goal: Goal) -> str:
    if not goal.accepted:
        return "rejected"
    try:
        _, result = goal.result(_PATIENCE)
    except TimeoutError:
        return LOST
    return told(result)
