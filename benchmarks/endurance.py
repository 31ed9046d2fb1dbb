# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Whether the node's memory grows over thousands of plans."""

from __future__ import annotations

import time

import numpy as np
from rich.console import Console

from benchmarks.guarantees import Outcome, cameras_for, cameras_of, own_graph, report, running
from focus_planner.parameters.planner_settings import Settings
from focus_planner.ros.client import PlannerClient
from testing.malformed import RIG, ball

_PLANS = 10_000
_RECORDED = 1_000
_BETWEEN_SAMPLES = 50
_BETWEEN_MESHES = 20
_BETWEEN_GOALS = 10
# Flat: what it grows by a plan after the first quarter, KiB; a plan's message alone has 3.
_MOST_GROWTH = 0.5
_PARAMETERS = {"method": "em", "samples": 200, "fresh_samples": 256}


def run(console: Console) -> bool:
    """Print the table; return whether all guarantees held."""
    with own_graph() as folder:
        record = {"record_directory": folder / "runs", "record_max_runs": 20}
        return report(
            console,
            "Endurance",
            [
                lambda: _endure(_PLANS, "plans", {}),
                lambda: _endure(_RECORDED, "recorded plans", record),
            ],
        )


def _endure(plans: int, what: str, record: dict[str, object]) -> Outcome:
    surfaces = [ball(rings=40), ball(rings=40, radius=0.31)]
    request = Settings.from_values(_PARAMETERS).request
    expected = [cameras_for(surface, RIG, **vars(request)) for surface in surfaces]
    memory, wrong, started = [], 0, time.perf_counter()
    with running("endurance", **_PARAMETERS, **record) as node, PlannerClient(node.name) as client:
        client.wait_for_node(180)
        client.publish_rig(RIG)
        for i in range(plans):
            which = i // _BETWEEN_MESHES % 2
            if i % _BETWEEN_MESHES == 0:
                client.publish_mesh(surfaces[which])
            wrong += _plan(client, i) != expected[which]
            if i % _BETWEEN_SAMPLES == 0:
                memory.append(node.memory)
        faults = node.faults
    seconds = time.perf_counter() - started
    return _outcome(np.array(memory), plans, what, wrong, faults, seconds)


def _plan(client: PlannerClient, i: int) -> object:
    """Plan via the service, and now and then via the action."""
    if i % _BETWEEN_GOALS == 0:
        _, answer = client.send_goal().result(60.0)
    else:
        answer = client.plan(60.0)
    return cameras_of(answer.plan) if answer.success else answer.message


def _outcome(
    memory: np.ndarray, plans: int, what: str, wrong: int, faults: list[str], seconds: float
) -> Outcome:
    quarter = len(memory) // 4
    settled = memory[quarter:]
    per_plan = np.polyfit(np.arange(len(settled)) * _BETWEEN_SAMPLES, settled, 1)[0] * 1024
    result = (
        f"{wrong} wrong; MiB at first {memory[0]:.1f}, median of the quarters"
        f" {', '.join(f'{np.median(part):.1f}' for part in np.array_split(memory, 4))};"
        f" {per_plan:+.3f} KiB a plan after the first quarter;"
        f" {plans / seconds:.0f} plans a second; {len(faults)} errors logged"
    )
    return Outcome(what, plans, result, not wrong and not faults and per_plan < _MOST_GROWTH)
