# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""An adapter for 1,000 cameras, and drivers that answer what no driver does."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from signal import SIGINT
from typing import Any

from focus_planner_msgs.msg import CameraFocus, LensState
from rcl_interfaces.msg import ListParametersResult, ParameterValue, SetParametersResult
from rcl_interfaces.srv import GetParameters, ListParameters, SetParametersAtomically
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rich.console import Console

from benchmarks.attacks.graph import messages
from benchmarks.attacks.lens_nodes import LensNode, running_lenses
from benchmarks.attacks.table import Attack, Seen, attack, report
from benchmarks.attacks.victim import new_name, peer, until
from focus_planner.ros.qos import LATCHED

_CAMERAS, _MOST_SECONDS = 1000, 3.0
_LONGEST = 2000
_STATES = QoSProfile(
    depth=100,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
)
_BAD = (LensState.STATUS_FAILED, LensState.STATUS_DIFFERS)
# Until the adapter has found the driver.
_NOT_FOUND = "expected a running driver"
_PARAMETERS = ["LensPosition", "AfMode"]


def run(console: Console) -> bool:
    """Print the table; return whether all attacks held."""
    strange = [
        Attack(
            f"a driver that {name}",
            "told as what it is, in short, not as an internal error; the adapter goes on",
            partial(_with_driver, answers),
        )
        for name, answers in _DRIVERS.items()
    ]
    return report(console, "8. The rest: lenses", [many, *strange])


@attack(
    f"an adapter for {_CAMERAS:,} cameras without drivers",
    f"ready within {_MOST_SECONDS:g} s of its start, ended within {_MOST_SECONDS:g} s of SIGINT",
)
def many(_: Path) -> Seen:
    """Start and end an adapter for a large rig."""
    cameras = [f"cam_{number:04d}" for number in range(_CAMERAS)]
    began = time.perf_counter()
    planner = f"/{new_name('many')}"
    node = LensNode("lens_adapter", cameras=cameras, driver="camera_ros", planner=planner)
    with running_lenses(node, may_end=True):
        ready = time.perf_counter() - began
        began = time.perf_counter()
        node.signal(SIGINT)
        until(node.has_ended, "it did not end")
        ending, status, log = time.perf_counter() - began, node.wait(), node.log
    held = max(ready, ending) < _MOST_SECONDS and status == 0 and "Traceback" not in log
    return Seen(f"ready after {ready:.1f} s, ended after {ending:.1f} s with {status}", held)


# --- strange drivers ---------------------------------------------------------------------------


def _listed(_: Any, response: Any) -> Any:
    response.result = ListParametersResult(names=_PARAMETERS)
    return response


def _set(_: Any, response: Any) -> Any:
    response.result = SetParametersResult(successful=True)
    return response


def _got(*values: ParameterValue) -> Callable[[Any, Any], Any]:
    def answer(_: Any, response: Any) -> Any:
        response.values = list(values)
        return response

    return answer


def _refused(reason: str) -> Callable[[Any, Any], Any]:
    def answer(_: Any, response: Any) -> Any:
        response.result = SetParametersResult(successful=False, reason=reason)
        return response

    return answer


def _as_it_is(_: Any, response: Any) -> Any:
    return response


def _too_late(_: Any, response: Any) -> Any:
    # Longer than the adapter waits.
    time.sleep(20.0)
    return response


_GOOD = _got(ParameterValue(type=3, double_value=2.0))
#: How a driver lists, sets and gets parameters; None: it has no such service.
_DRIVERS: dict[str, tuple[Any, Any, Any]] = {
    "reads back a value of type 200": (_listed, _set, _got(ParameterValue(type=200))),
    "reads back values of type 255 and more than asked for": (
        _listed,
        _set,
        _got(*[ParameterValue(type=255)] * 5),
    ),
    "reads back nothing": (_listed, _set, _as_it_is),
    "reads back a text": (_listed, _set, _got(ParameterValue(type=4, string_value="y" * 10**6))),
    "reads back a list": (_listed, _set, _got(ParameterValue(type=8, double_array_value=[2.0]))),
    "reads back NaN": (_listed, _set, _got(ParameterValue(type=3, double_value=float("nan")))),
    "reads back an infinite value": (
        _listed,
        _set,
        _got(ParameterValue(type=3, double_value=float("inf"))),
    ),
    "has no parameters": (_as_it_is, _set, _GOOD),
    "answers empty messages": (_as_it_is, _as_it_is, _as_it_is),
    "refuses without a reason": (_listed, _refused(""), _GOOD),
    "refuses with 1 MB of control characters": (_listed, _refused("\x1b[31m\n" * 200_000), _GOOD),
    "never answers": (_too_late, _too_late, _too_late),
}


def _with_driver(answers: tuple[Any, Any, Any], _: Path) -> Seen:
    """Give an order for a lens of a strange driver."""
    camera, planner = new_name("strange"), f"/{new_name('orders')}"
    quick = {"timeout": 1.0, "retries": 0, "verify_timeout": 0.5, "poll_period": 0.1}
    adapter = LensNode(
        "lens_adapter", cameras=[camera], driver="camera_ros", planner=planner, **quick
    )
    with _driver(f"/{camera}/camera", answers), running_lenses(adapter), peer() as node:
        publisher = node.create_publisher(CameraFocus, f"{planner}/cameras/{camera}/focus", LATCHED)
        until(publisher.get_subscription_count, "the adapter does not listen")
        fields = {"status": 1, "focus_distance": 0.5, "dioptres": 2.0}
        publisher.publish(CameraFocus(name=camera, plan_id="strange", **fields))
        end, told = time.monotonic() + 20.0, ""
        while not told and time.monotonic() < end:
            states = messages(node, LensState, f"{planner}/lens_states", _STATES, 0.5)
            said = [state.message for state in states if state.status in _BAD]
            told = next((text for text in said if text and _NOT_FOUND not in text), "")
        log = adapter.log
    raw = any(c in log + told for c in "\x1b\r")
    wrong = "internal error" in (told + log) or "Traceback" in log
    observed = f"told {told[:200]!r}{'; raw characters' if raw else ''}"
    held = bool(told) and not wrong and not raw and len(told) < _LONGEST
    return Seen(observed, held)


@contextmanager
def _driver(name: str, answers: tuple[Any, Any, Any]) -> Iterator[None]:
    """Offer the services of a driver's parameters."""
    kinds = {
        "list_parameters": ListParameters,
        "set_parameters_atomically": SetParametersAtomically,
        "get_parameters": GetParameters,
    }
    with peer() as node:
        for (service, kind), answer in zip(kinds.items(), answers, strict=True):
            node.create_service(kind, f"{name}/{service}", answer)
        executor = SingleThreadedExecutor(context=node.context)
        executor.add_node(node)
        ending = threading.Event()

        def spin() -> None:
            while not ending.is_set():
                executor.spin_once(timeout_sec=0.1)

        thread = threading.Thread(target=spin, daemon=True)
        thread.start()
        try:
            yield
        finally:
            ending.set()
            thread.join()
            executor.shutdown()
