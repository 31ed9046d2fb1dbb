# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Time from cancelling a goal, in another process, to the result with the best plan so far."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from action_msgs.msg import GoalStatus
from focus_planner_msgs.action import PlanFocus
from rich.console import Console
from rich.table import Table

from benchmarks.scenes import body_scenes, rig
from benchmarks.service import running_node
from focus_planner import Mesh
from focus_planner.ros.client import PlannerClient

_MOMENTS = 30
# What takes longer is cancelled within so many seconds.
_LONGEST = 10.0
_CASES: dict[str, dict[str, Any]] = {
    "k_view, 1,000": {"method": "k_view", "samples": 1_000},
    "k_view, 16,384": {"method": "k_view", "samples": 16_384},
    "k_view, 65,536": {"method": "k_view", "samples": 65_536},
    "optimal, 65,536": {"method": "optimal", "samples": 65_536, "gap": 1e-9},
    "k_view, k = 3, 16,384": {"method": "k_view", "k": 3, "samples": 16_384},
    "k_view, 4 shots, 16,384": {"method": "k_view", "shots": 4, "samples": 16_384},
}


def run(console: Console) -> None:
    """Print the table."""
    with running_node() as client:
        _measure(console, client)


@dataclass
class _Waits:
    """Seconds from the cancel request to the result, and the last stage in the feedback."""

    seconds: list[float] = field(default_factory=list)
    stages: list[str] = field(default_factory=list)

    @property
    def row(self) -> list[str]:
        worst = int(np.argmax(self.seconds))
        late = sum(seconds > 0.1 for seconds in self.seconds)
        times = (np.median(self.seconds), np.quantile(self.seconds, 0.9), self.seconds[worst])
        return [*(f"{1000 * each:.0f}" for each in times), self.stages[worst], str(late)]


def _measure(console: Console, client: PlannerClient) -> None:
    surface = next(iter(body_scenes().values())).surface
    assert isinstance(surface, Mesh)
    client.publish_rig(rig())
    client.publish_mesh(surface)
    table = Table(
        "goal",
        "not cancelled [s]",
        "median [ms]",
        "90 of 100",
        "worst",
        "worst in stage",
        "over 100 ms",
        title=f"From cancelling to the result, {_MOMENTS} random moments each",
    )
    for name, goal in _CASES.items():
        seconds = _whole(client, goal)
        told = f"{seconds:.1f}" if seconds < _LONGEST else f"over {_LONGEST:.0f}"
        table.add_row(name, told, *_waits(client, goal, seconds).row)
    console.print(table)


def _whole(client: PlannerClient, goal: dict[str, Any]) -> float:
    """Return the duration of a plan, limited to the longest wait, seconds."""
    began = time.perf_counter()
    status, result = client.send_goal(**goal, seed=1, time_budget=_LONGEST).result()
    assert status == GoalStatus.STATUS_SUCCEEDED, result.message
    return min(time.perf_counter() - began, _LONGEST)


def _waits(client: PlannerClient, goal: dict[str, Any], whole: float) -> _Waits:
    """Cancel at times spread over a plan's duration, with new seeds (samples are cached)."""
    random, waits, seed = np.random.default_rng(1), _Waits(), 1
    while len(waits.seconds) < _MOMENTS:
        seed += 1
        _cancel_one(client, goal | {"seed": seed}, random.uniform(0, whole), waits)
    return waits


def _cancel_one(client: PlannerClient, goal: dict[str, Any], delay: float, waits: _Waits) -> None:
    heard: list[PlanFocus.Feedback] = []
    sent = client.send_goal(heard.append, **goal)
    time.sleep(delay)
    stage = heard[-1].stage if heard else "none yet"
    began = time.perf_counter()
    sent.cancel()
    status, result = sent.result()
    seconds = time.perf_counter() - began
    if status == GoalStatus.STATUS_CANCELED:  # it may have been done before
        assert result.success, result.message
        waits.seconds.append(seconds)
        waits.stages.append(stage)
