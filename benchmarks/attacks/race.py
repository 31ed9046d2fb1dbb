# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A stream of rigs while runs are planned and recorded: all of a run is of one moment."""

from __future__ import annotations

import json
import threading
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rich.console import Console

from benchmarks.attacks.table import Seen, attack, report
from benchmarks.attacks.victim import PATIENCE, REQUEST, Victim, command, until, victim
from focus_planner.messages.typestore import RIG as RIG_TYPE
from focus_planner.messages.typestore import serialize
from focus_planner.messages.writing import rig_to_fields
from focus_planner.ros.client import PlannerClient
from testing.malformed import RIG
from testing.ros.recorded import moved, whole

_SECONDS = 30.0
_CALLERS = 3
_RIGS = 100
_NANO = 10**9
# Seconds: of an age, what rounding to a message may cost.
_ROUNDING = 1e-6


def run(console: Console) -> bool:
    """Print the table; return whether all attacks held."""
    return report(console, "1. What is recorded is what was planned", [stream])


@attack(
    f"rigs as fast as they are taken, while {_CALLERS} callers plan and all is recorded",
    "every run holds the rig that its plan names, replays bit for bit, and no age is negative or"
    " of another moment than the other input's",
)
def stream(folder: Path) -> Seen:
    """Plan and record during a stream of rigs, each with a stamp of its own."""
    runs = folder / "runs"
    with victim(folder, record_directory=runs) as one:
        plans, rigs = _planned_meanwhile(one)
        until(lambda: len(whole(runs)) >= len(plans), "not all runs were recorded")
    judged = [judge(path, plans[name]) for name, path in whole(runs).items() if name in plans]
    other = sum(each.other_input for each in judged)
    wrong = sum(each.wrong_age for each in judged)
    negative = sum(min(p.rig.age, p.surface.age) < 0 for p in plans.values())
    differ = differing(runs)
    observed = (
        f"{len(judged)} runs, {rigs:,} rigs; {other} runs with another rig than their plan's;"
        f" {len(differ)} do not replay; {negative} plans with a negative age, {wrong} with ages of"
        " different moments"
    )
    return Seen(observed, not (other or wrong or negative or differ) and bool(judged), len(plans))


@dataclass
class _Stream:
    """Publishes rigs in turn until it is stopped."""

    client: PlannerClient
    sent: int = 0
    stopping: threading.Event = field(default_factory=threading.Event)

    def run(self) -> None:
        rigs = [rig_to_fields(moved(RIG, 1 + 0.002 * i)) for i in range(_RIGS)]
        while not self.stopping.is_set():
            self.sent += 1
            fields = rigs[self.sent % _RIGS]
            header = {"frame_id": "world", "stamp": {"sec": self.sent, "nanosec": 0}}
            self.client.publish("rig", serialize(RIG_TYPE, fields | {"header": header}))


def _planned_meanwhile(one: Victim) -> tuple[dict[str, Any], int]:
    """Return the plans by id, and how many rigs were sent."""
    plans: dict[str, Any] = {}
    rigs = _Stream(one.client)
    ends = time.monotonic() + _SECONDS

    def call() -> None:
        with PlannerClient(one.node.name) as client:
            while time.monotonic() < ends:
                answer = client.plan(PATIENCE, **REQUEST)
                if answer.success:
                    plans[answer.plan.plan_id] = answer.plan

    threads = [threading.Thread(target=call) for _ in range(_CALLERS)]
    sender = threading.Thread(target=rigs.run)
    for thread in (sender, *threads):
        thread.start()
    for thread in threads:
        thread.join()
    rigs.stopping.set()
    sender.join()
    return plans, rigs.sent


@dataclass(frozen=True)
class Judged:
    """Whether a run holds other inputs than its plan names, and whether its ages are wrong."""

    other_input: bool
    wrong_age: bool


def judge(path: Path, plan: Any) -> Judged:
    """Compare a run with the plan that its caller got."""
    (file,) = path.glob("*.mcap")
    messages = _messages(file)
    kept = next(message for topic, message in messages.items() if topic.endswith("/focus_plan"))
    stamps = [
        (messages[named.topic].header.stamp, named.stamp)
        for named in (plan.rig, plan.surface, kept.rig, kept.surface)
        if hasattr(messages.get(named.topic), "header")
    ]
    there = {named.topic for named in (plan.rig, plan.surface)} <= messages.keys()
    same = all((one.sec, one.nanosec) == (other.sec, other.nanosec) for one, other in stamps)
    ages = plan.rig.age, plan.surface.age
    # Both inputs were taken at one moment, which was before the plan.
    taken = [_seconds(each.received) + each.age for each in (plan.rig, plan.surface)]
    late = max(taken) > _seconds(plan.header.stamp)
    wrong_age = min(ages) < 0 or abs(taken[0] - taken[1]) > _ROUNDING or late
    return Judged(not (there and same), wrong_age)


def _messages(file: Path) -> dict[str, Any]:
    """Return the last message of each topic, as another program reads it."""
    with file.open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        return {channel.topic: message for _, channel, _, message in reader.iter_decoded_messages()}


def _seconds(stamp: Any) -> float:
    # Relative to a day, in which a double is exact to nanoseconds.
    return float(stamp.sec % 86400) + stamp.nanosec / _NANO


def differing(runs: Path) -> list[str]:
    """Return which runs of a folder do not replay bit for bit, and why; beginnings do not count."""
    ran = command("replay", runs, "--json", "--quiet", seconds=1800)
    assert ran.status in {0, 1, 2}, ran.told()
    return [
        f"{each['run']} {each['outcome']} {_why(each)}"
        for each in json.loads(ran.out)
        if each["outcome"] != "reproduced" and ".partial: " not in str(each["message"])
    ]


def _why(replayed: dict[str, Any]) -> str:
    return str(replayed["message"] or replayed["differences"][:1])[:200]
