# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Everything at once for minutes, recorded: in the end every kept run replays bit for bit."""

from __future__ import annotations

import threading
import time
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from focus_planner_msgs.msg import LensState
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rich.console import Console

from benchmarks.attacks.race import differing, judge
from benchmarks.attacks.victim import Victim, peer, victim
from benchmarks.fuzz.requests import told
from benchmarks.guarantees import Outcome, own_graph, report
from benchmarks.options import options
from focus_planner.messages.typestore import CLOUD, POSES, serialize
from focus_planner.messages.typestore import RIG as RIG_TYPE
from focus_planner.messages.writing import cloud_to_fields, poses_to_fields, rig_to_fields
from focus_planner.ros.client import PlannerClient
from testing.malformed import CLOUD as POINTS
from testing.malformed import RIG, absurd, ball, broken
from testing.ros.recorded import moved, whole

# Beginnings of runs that are left.
_MINUTES = 15.0
_MOST_LEFT = 10
_MAX_RUNS, _MAX_BYTES = 1000, 400_000_000
_PATIENCE = 120.0
# MiB, after the first quarter.
_MOST_GROWTH = 64.0
_BETWEEN_SAMPLES = 2.0
_STATES = QoSProfile(
    depth=100,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)
_CHANGES: dict[str, tuple[Any, ...]] = {
    "samples": (100, 200, 300),
    "method": ("em", "greedy", "k_view", "closest", "optimal"),
    "seed": (0, 1, 2),
    "scope": ("all", "assigned"),
    "warm_start": (True, False),
    "record_markers": (True, False),
    "overlap": ("queue", "preempt", "refuse"),
    "cost.focus_weight": (0.2, 1 / 3),
    "lens.min_focus": (0.1, 0.2),
    "max_waiting": (5, 100),
    "status_period": (0.1, 1.0),
    "image.fx": (1100.0, 1190.732),
    "replan": ("never", "on_surface", "rate"),
    "replan_rate": (1.0, 10.0),
    "min_change": (0.0, 0.2),
    "record_replan_period": (0.0, 1.0),
}
_REQUESTS: dict[str, tuple[Any, ...]] = {
    "method": ("", "em", "greedy", "k_view", "closest", "average", "optimal"),
    "samples": (0, 50, 200, 300),
    "seed": (0, 0, 1, 2**64 - 1),
    "time_budget": (0.0, 0.0, 0.0, 0.05),
    "k": (0, 2, 3),
    "shots": (0, 0, 1, 2),
    "views": (0, 0, 1, 3),
    "depth_tolerance": (0.0, 0.001),
    "max_mm_per_pixel": (0.0, 0.0, 2.0),
    "bound": ("", "none", "quick"),
}


def run(console: Console) -> bool:
    """Print the table; return whether all guarantees held."""
    with own_graph() as folder:
        minutes = options().minutes or _MINUTES
        title = f"Soak of {minutes:g} minutes"
        return report(console, title, [partial(_soak, folder, 60 * minutes)])


@dataclass
class _Diary:
    """What all who took part have seen."""

    ends: float
    events: Counter[str] = field(default_factory=Counter)
    answers: Counter[str] = field(default_factory=Counter)
    plans: dict[str, Any] = field(default_factory=dict)
    failures: list[str] = field(default_factory=list)
    lock: threading.Lock = field(default_factory=threading.Lock)

    @property
    def is_over(self) -> bool:
        return time.monotonic() > self.ends

    def did(self, what: str) -> None:
        with self.lock:
            self.events[what] += 1

    def heard(self, answer: Any) -> None:
        with self.lock:
            self.answers[told(answer)] += 1
            if answer.success:
                self.plans[answer.plan.plan_id] = answer.plan


def _soak(folder: Path, seconds: float) -> Outcome:
    runs = folder / "runs"
    recording = {"record_max_runs": _MAX_RUNS, "record_max_bytes": _MAX_BYTES}
    with victim(folder, clean=False, record_directory=runs, samples=200, **recording) as one:
        one.check_plan()
        diary = _Diary(time.monotonic() + seconds)
        memory = _lived_through(one, diary, seconds)
        faults, lines = one.faults, len(one.node.log.splitlines())
    kept = whole(runs)
    others = [path.name for path in runs.iterdir() if path.name not in kept]
    judged = [judge(path, diary.plans[name]) for name, path in kept.items() if name in diary.plans]
    mixed = sum(each.other_input for each in judged)
    wrong = sum(each.wrong_age for each in judged)
    negative = sum(min(p.rig.age, p.surface.age) < 0 for p in diary.plans.values())
    differ = differing(runs)
    growth = float(np.median(memory[-10:]) - np.median(memory[len(memory) // 4 :][:10]))
    result = (
        f"{_listed(diary.events)}; answers: {_listed(diary.answers)}; {len(kept)} runs kept,"
        f" {len(others)} beginnings left, {len(differ)} do not replay {differ[:2] or ''}, of"
        f" {len(judged)} compared {mixed} hold other inputs than their plan's and {wrong} tell ages"
        f" of different moments; {negative} of {len(diary.plans):,} plans with a negative age;"
        f" {len(faults)} faults in {lines:,} lines logged {faults[:1] or ''}; memory"
        f" {memory[-1]:.0f} MiB, {growth:+.1f} after the first quarter; failures:"
        f" {diary.failures[:3] or 'none'}"
    )
    # What deactivating cut short is limited whenever a run becomes whole, not at the end.
    left = max(len(others) - _MOST_LEFT, 0)
    bad = [len(differ), mixed, wrong, negative, left, len(faults), len(diary.failures)]
    held = not any(bad) and not diary.answers["internal error"] and growth < _MOST_GROWTH
    return Outcome("all at once", diary.events.total(), result, held and bool(kept))


def _listed(counts: Counter[str]) -> str:
    return ", ".join(f"{number:,} {name}" for name, number in counts.most_common())


def _lived_through(one: Victim, diary: _Diary, seconds: float) -> list[float]:
    """Let all take part until the time is over, then check the plan; return the memory, MiB."""
    before = one.client.get_parameters(list(_CHANGES))
    actors = [_inputs, _malformed, _calls, _calls, _goals, _goals, _parameters, _states, _lives]
    threads = [
        threading.Thread(target=_act, args=(actor, one.node.name, diary, seed))
        for seed, actor in enumerate(actors, options().seed)
    ]
    for thread in threads:
        thread.start()
    memory = []
    while not diary.is_over and one.node.is_alive:
        memory.append(one.node.memory)
        time.sleep(min(_BETWEEN_SAMPLES, seconds / 40))
    for thread in threads:
        thread.join()
    result = one.client.set_parameters_atomically(before)
    assert result.successful, f"the parameters cannot be set back: {result.reason}"
    one.put_inputs()
    one.check_plan()
    memory.append(one.node.memory)
    return memory


Random = np.random.Generator
Actor = Callable[[PlannerClient, str, _Diary, Random], None]


def _act(actor: Actor, planner: str, diary: _Diary, seed: int) -> None:
    """Let one take part; what is not answered is a failure."""
    random = np.random.default_rng(seed)
    with PlannerClient(planner) as client:
        try:
            actor(client, planner, diary, random)
        except Exception as error:  # noqa: BLE001 - told in the end, and the others go on
            diary.failures.append(f"{actor.__name__.strip('_')}: {error}")


def _inputs(client: PlannerClient, _: str, diary: _Diary, random: Random) -> None:
    """Publish surfaces and rigs that differ, with stamps that differ."""
    sent = 0
    while not diary.is_over:
        sent += 1
        stamp = {
            "frame_id": "world",
            "stamp": {"sec": sent, "nanosec": int(random.integers(10**9))},
        }
        rig, kind = moved(RIG, 1 + 0.002 * random.integers(100)), random.integers(10)
        if kind < 4:
            client.publish("rig", serialize(RIG_TYPE, rig_to_fields(rig) | {"header": stamp}))
            diary.did("rigs")
        elif kind < 5:
            fields = poses_to_fields(rig) | {"header": stamp}
            client.publish("camera_poses", serialize(POSES, fields))
            diary.did("poses")
        elif kind < 8:
            client.publish_mesh(ball(radius=0.3 + 0.0005 * random.integers(100)))
            diary.did("meshes")
        else:
            fields = cloud_to_fields(POINTS, "world") | {"header": stamp}
            client.publish("cloud", serialize(CLOUD, fields))
            diary.did("clouds")
        time.sleep(random.uniform(0, 0.1))


def _malformed(client: PlannerClient, _: str, diary: _Diary, random: Random) -> None:
    while not diary.is_over:
        topic = str(random.choice(["mesh", "cloud", "camera_poses", "rig"]))
        make = absurd if random.integers(2) else broken
        client.publish(topic, make(topic, random))
        diary.did("malformed messages")
        time.sleep(random.uniform(0, 2.0))


def _request(random: Random) -> dict[str, Any]:
    return {name: values[random.integers(len(values))] for name, values in _REQUESTS.items()}


def _calls(client: PlannerClient, _: str, diary: _Diary, random: Random) -> None:
    while not diary.is_over:
        diary.heard(client.plan(_PATIENCE, **_request(random)))
        diary.did("calls")
        time.sleep(random.choice([0.0, 0.0, 0.05]))


def _goals(client: PlannerClient, _: str, diary: _Diary, random: Random) -> None:
    while not diary.is_over:
        goal = client.send_goal(lambda _: None, **_request(random))
        diary.did("goals")
        if not goal.accepted:
            time.sleep(0.05)
            continue
        if random.random() < 0.4:
            time.sleep(random.uniform(0, 0.05))
            goal.cancel()
            diary.did("cancels")
        diary.heard(goal.result(_PATIENCE)[1])


def _parameters(client: PlannerClient, _: str, diary: _Diary, random: Random) -> None:
    while not diary.is_over:
        name = str(random.choice(list(_CHANGES)))
        value = _CHANGES[name][random.integers(len(_CHANGES[name]))]
        client.set_parameters_atomically({name: value})
        diary.did("parameter changes")
        time.sleep(random.uniform(0, 0.5))


def _states(client: PlannerClient, planner: str, diary: _Diary, random: Random) -> None:
    """Publish states of lenses, good ones and absurd ones."""
    with peer() as node:
        publisher = node.create_publisher(LensState, f"{planner}/lens_states", _STATES)
        while not diary.is_over:
            with suppress(TimeoutError):
                plan = client.latched_plan()
                for camera in plan.cameras[:3]:
                    changes = {"name": camera.name, "plan_id": plan.plan_id}
                    publisher.publish(absurd("lens_states", random, **changes))
                    diary.did("lens states")
            time.sleep(random.uniform(0, 0.3))


def _lives(client: PlannerClient, _: str, diary: _Diary, random: Random) -> None:
    """Deactivate the planner for a moment, and now and then configure it anew."""
    while not diary.is_over:
        time.sleep(min(random.uniform(5, 20), max(0.0, diary.ends - time.monotonic())))
        assert client.change_state("deactivate"), "it cannot be deactivated"
        if random.random() < 0.3:
            assert client.change_state("cleanup"), "it cannot be cleaned up"
            assert client.change_state("configure"), "it cannot be configured"
            diary.did("cleanups")
        assert client.change_state("activate"), "it cannot be activated"
        diary.did("deactivations")
