# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""False claims: of lenses, of orders to them, of runs that are replayed."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import Any

from focus_planner_msgs.msg import CameraFocus, LensState
from rcl_interfaces.srv import GetParameters
from rclpy.node import Node as RosNode
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import serialize_message
from rich.console import Console

from benchmarks.attacks.graph import heard, messages
from benchmarks.attacks.lens_nodes import LensNode, running_lenses
from benchmarks.attacks.table import Attack, Seen, attack, report
from benchmarks.attacks.victim import PATIENCE, Ran, command, new_name, peer, until, victim
from focus_planner.messages.typestore import serialize
from focus_planner.ros.qos import LATCHED
from testing.ros.parameter_services import call
from testing.runs import rewritten, with_payload

_BAGS = Path(__file__).parents[2] / "bags"
# Seconds in which a state, or an order, is heard on an idle machine many times over.
_HEARD = 3.0
_MOST_STATUS = 200_000
_STATES = QoSProfile(
    depth=100,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)
_TABLES = "default: {unit: steps, whole: true, distances: [0.25, 1.0], values: [200, 50]}\n"
# The value at 0.5 m of this table, which is linear in dioptres.
_AT_HALF_A_METRE = 100.0
_NO = math.nan


def run(console: Console) -> bool:
    """Print the table; return whether all attacks held."""
    states = [
        Attack(
            f"a peer claims a verified lens: {name}",
            "not counted as verified; who published it is named; the status stays below"
            f" {_MOST_STATUS // 1000} kB",
            partial(_claim, changes),
        )
        for name, changes in _CLAIMS.items()
    ]
    orders = [
        Attack(
            f"an order to the adapter: {name}",
            "refused, and said so; the driver's parameter stays",
            partial(_order, changes),
        )
        for name, changes in _ORDERS.items()
    ]
    replayed = [failure_of_success, success_of_failure, live]
    return report(console, "6. Claims are checked", [*states, *orders, *replayed])


# --- lens states -------------------------------------------------------------------------------

_CLAIMS: dict[str, dict[str, Any]] = {
    "a read-back of NaN": {"read_value": _NO, "read_distance": _NO},
    "a read-back of -500 at 99 m": {"read_value": -500.0, "read_distance": 99.0},
    "at 99 m, with the planned distance changed too": {
        "planned_distance": 99.0,
        "read_distance": 99.0,
    },
    "of an infinite value": {"sent_value": math.inf, "read_value": math.inf},
    "of a plan that is not in force": {"plan_id": "20260101T000000.000000Z-00000000"},
    "with a status of 250": {"status": 250},
    "with a text of 5 MB": {"message": "y" * 5_000_000},
    "with a unit of 5 MB": {"unit": "y" * 5_000_000},
    "with control characters": {"message": "\x1b[31mred\r\n[ERROR] forged", "status": 4},
}


def _claim(changes: Mapping[str, Any], folder: Path) -> Seen:
    """Publish states as no lens has them, and read the status."""
    with victim(folder) as one, peer() as node:
        plan_id = one.check_plan()
        camera = one.client.latched_plan().cameras[0]
        publisher = node.create_publisher(LensState, f"{one.node.name}/lens_states", _STATES)
        until(publisher.get_subscription_count, "the planner does not listen")
        publisher.publish(_state(camera, plan_id, changes))
        time.sleep(_HEARD)
        status = one.client.status()
        size = len(serialize_message(status))
        named = node.get_name() in one.node.log + " ".join(heard(one.node.name))
        named = named or any(node.get_name() in each.message for each in status.lenses)
        raw = "\x1b" in one.node.log
        one.check_plan()
    observed = (
        f"verified {status.verified}, failed {status.failed}, differ {status.differ}; the status"
        f" has {size:,} bytes; its publisher is {'named' if named else 'not named'}"
        f"{'; control characters in the log' if raw else ''}"
    )
    # Of an older plan an adapter may rightly tell: nobody has to be named.
    named = named or "plan_id" in changes
    return Seen(observed, not status.verified and size < _MOST_STATUS and named and not raw)


def _state(camera: CameraFocus, plan_id: str, changes: Mapping[str, Any]) -> LensState:
    distance = camera.focus_distance
    fields = {
        "name": camera.name,
        "plan_id": plan_id,
        "status": LensState.STATUS_VERIFIED,
        "planned_distance": distance,
        "unit": "dioptres",
        "sent_value": 1 / distance,
        "read_value": 1 / distance,
        "read_distance": distance,
    }
    return LensState(**fields | dict(changes))


# --- orders ------------------------------------------------------------------------------------

_ORDERS: dict[str, dict[str, Any]] = {
    "a device value that is not its distance's": {"device_value": 180.0},
    "a distance that is not its device value's": {"focus_distance": 0.9},
    "in another unit": {"device_unit": "furlongs"},
    "another camera's": {"name": "somebody"},
    "an unknown status": {"status": 250},
    "the status of an empty message": {"status": 0},
    "at -5 m": {"focus_distance": -5.0, "device_value": _NO},
    "at NaN": {"focus_distance": _NO, "device_value": _NO},
    "at 0": {"focus_distance": 0.0, "device_value": _NO},
    "at 1e308 m": {"focus_distance": 1e308, "device_value": _NO},
    "a device value of 1e308": {"device_value": 1e308},
}


def _order(changes: Mapping[str, Any], folder: Path) -> Seen:
    """Give a good order, a bad one, and another good one to an adapter."""
    tables = folder / "tables.yaml"
    tables.write_text(_TABLES)
    planner = f"/{new_name('orders')}"
    camera = new_name("webcam")
    webcam = {"cameras": [camera], "driver": "v4l2_camera"}
    lens = LensNode("simulated_lens", **webcam)
    adapter = LensNode("lens_adapter", **webcam, planner=planner, lens_tables=tables)
    with running_lenses(lens, adapter), orders_to(planner, camera) as give, peer() as node:
        assert give("first", {}), "a good order was not carried out"
        before = _value(node, camera)
        taken = give("bad", changes)
        after = _value(node, camera)
        assert give("last", {}), "a good order was not carried out afterwards"
        said = _last_said(adapter.log)
        assert "Traceback" not in adapter.log, "a traceback in the adapter's log"
    observed = (
        f"{'carried out' if taken else 'not carried out'}; the parameter went from {before} to"
        f" {after}; {said!r}"
    )
    held = not taken and before == after and bool(said) and "internal error" not in said
    return Seen(observed, held)


@contextmanager
def orders_to(planner: str, camera: str) -> Iterator[Callable[[str, Mapping[str, Any]], bool]]:
    """Yield a function that gives an order and returns whether it was carried out."""
    with peer() as node:
        topic = f"{planner}/cameras/{camera}/focus"
        publisher = node.create_publisher(CameraFocus, topic, LATCHED)
        until(publisher.get_subscription_count, "the adapter does not listen")

        def give(plan_id: str, changes: Mapping[str, Any]) -> bool:
            fields = {
                "name": camera,
                "plan_id": plan_id,
                "status": CameraFocus.STATUS_PLANNED,
                "focus_distance": 0.5,
                "dioptres": 2.0,
                "device_value": _AT_HALF_A_METRE,
                "device_unit": "steps",
            }
            publisher.publish(CameraFocus(**fields | dict(changes)))
            end = time.monotonic() + (_HEARD if changes else PATIENCE)
            while time.monotonic() < end:
                states = messages(node, LensState, f"{planner}/lens_states", _STATES, 0.5)
                mine = [state for state in states if state.plan_id == plan_id]
                if any(_is_carried_out(state) for state in mine):
                    return True
            return False

        yield give


def _is_carried_out(state: LensState) -> bool:
    return state.status in {
        LensState.STATUS_SENT,
        LensState.STATUS_ACCEPTED,
        LensState.STATUS_VERIFIED,
    }


def _value(node: RosNode, camera: str) -> int:
    request = GetParameters.Request(names=["focus_absolute"])
    answer = call(node, GetParameters, f"/{camera}/v4l2_camera/get_parameters", request)
    value: int = answer.values[0].integer_value
    return value


def _last_said(log: str) -> str:
    lines = [line for line in log.splitlines() if "[WARN]" in line or "[ERROR]" in line]
    return lines[-1][-160:] if lines else ""


# --- replays -----------------------------------------------------------------------------------

_RESULT = "focus_planner_msgs/msg/RunResult"


@attack(
    "a run whose result was turned into a failure",
    "replay says that it differs (status 1)",
)
def failure_of_success(folder: Path) -> Seen:
    """Replay a run that tells of no plan although it has one."""
    return _replay_with(folder, "mesh_em", {"success": False, "message": "no plan"})


@attack(
    "a failed run whose result was turned into a success",
    "replay says that it differs (status 1), or that it is no run (2)",
)
def success_of_failure(folder: Path) -> Seen:
    """Replay a run that tells of a plan although it has none."""
    return _replay_with(folder, "failed_request", {"success": True, "message": "a plan"})


def _replay_with(folder: Path, bag: str, changes: Mapping[str, Any]) -> Seen:
    def change(message: Any) -> Any:
        if message.type_name != _RESULT:
            return message
        result = message.read()
        kept = {name: list(getattr(result, name)) for name in ("answers",)}
        return with_payload(message, serialize(_RESULT, kept | dict(changes)))

    run_folder = rewritten(_BAGS / bag, folder / "changed", change)
    ran = command("replay", run_folder, "--quiet", seconds=120)
    return Seen(ran.told() + _first(ran), ran.status in ({1} if "mesh" in bag else {1, 2}))


@attack(
    "replay --live of the runs of bags/, but what was cut short by the clock",
    "each is reproduced, whatever definitions it has, or refused for what a node cannot be sent",
)
def live(folder: Path) -> Seen:
    """Replay the repository's runs on a node."""
    runs = sorted(path.parent for path in _BAGS.glob("*/*.mcap"))
    runs = [run for run in runs if run.name != "mesh_budget"]
    with victim(folder, inputs=False, service_max_wait=PATIENCE) as one:
        ran = command(
            "replay", "--live", "--node", one.node.name, "--json", "--quiet", *runs, seconds=300
        )
    outcomes = {}
    with suppress(json.JSONDecodeError):
        outcomes = {Path(each["path"]).name: each["outcome"] for each in json.loads(ran.out)}
    others = {name: outcome for name, outcome in outcomes.items() if outcome != "reproduced"}
    held = len(outcomes) == len(runs) and set(others.values()) <= {"refused"}
    observed = f"{len(outcomes)} replayed; other than reproduced: {others}; {ran.told()}"
    return Seen(observed, held, len(runs))


def _first(ran: Ran) -> str:
    return f", {ran.out.strip().splitlines()[0][:160]!r}" if ran.out.strip() else ""
