# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Random calls that set parameters: any name, any type, any value, alone or several at once."""

from __future__ import annotations

import os
from collections import Counter
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from rcl_interfaces.msg import Parameter, ParameterValue
from rcl_interfaces.srv import ListParameters, SetParameters, SetParametersAtomically
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node as RosNode
from rich.console import Console

from benchmarks.attacks.victim import Victim, peer
from benchmarks.fuzz.campaign import LOST, campaign
from benchmarks.guarantees import Outcome, own_graph, report

_PATIENCE = 10.0
# Calls without an answer: then it is known that there are such.
_MOST_LOST = 3
_WHOLES = (0, 1, -1, 2, 2**31 - 1, 2**31, 2**63 - 1, -(2**63))
_FLOATS = (0.0, -0.0, 1.0, 0.5, -1.0, 1e-300, 5e-324, 1e308, *map(float, ("nan", "inf", "-inf")))
_TEXTS = ("", "em", "all", "k_view", "queue", "\x1b[31m\n[ERROR]", "é😀", "%s{}", "y" * 100_000)
_NAMES = ("", "/", "a b", "use_sim_time", "none.such", "\x1b[31m", "y" * 1000, "..", "é")
# Names of files: what is there could harm who opens it, or is not there.
_FILES = ("", "fifo", "deep/none/such", "a file", "../x", "key\n")
_PATHS = ("lens_tables", "record_directory")


def run(console: Console) -> bool:
    """Print the table; return whether all guarantees held."""
    with own_graph() as folder:
        return report(console, "Random parameters", [partial(_parameters, folder)])


def _parameters(folder: Path) -> Outcome:
    os.mkfifo(folder / "fifo")
    (folder / "a file").write_text("no tables, and no folder")
    return campaign("calls that set parameters", folder, partial(_fire, folder), samples=200)


def _fire(folder: Path, one: Victim, random: np.random.Generator, count: int) -> Counter[str]:
    answers: Counter[str] = Counter()
    with peer() as node:
        names = _call(node, ListParameters, one, "list_parameters", ListParameters.Request())
        names = sorted(names.result.names)
        before = one.client.get_parameters(names)
        for _ in range(count):
            answers[_set_some(node, one, names, random, folder)] += 1
            assert answers[LOST] < _MOST_LOST, (
                f"{dict(answers)}; logged last: {one.node.log[-200:]}"
            )
    now = one.client.get_parameters(names)
    # NaN is no parameter's good value, so what is not equal was changed.
    changed = {name: value for name, value in before.items() if now[name] != value}
    result = one.client.set_parameters_atomically(changed)
    assert result.successful, f"the parameters cannot be set back: {result.reason}"
    return answers


def _set_some(
    node: RosNode, one: Victim, names: list[str], random: np.random.Generator, folder: Path
) -> str:
    parameters = [_parameter(names, random, folder) for _ in range(random.choice([1, 1, 1, 2, 5]))]
    if random.random() < 0.3:
        kind, service = SetParametersAtomically, "set_parameters_atomically"
    else:
        kind, service = SetParameters, "set_parameters"
    answer = _call(node, kind, one, service, kind.Request(parameters=parameters))
    if answer is None:
        return LOST
    results = answer.results if service == "set_parameters" else [answer.result]
    return "taken" if all(result.successful for result in results) else "refused"


def _parameter(names: list[str], random: np.random.Generator, folder: Path) -> Parameter:
    known = random.random() < 0.9
    name = str(random.choice(names if known else _NAMES))
    if name in _PATHS and random.random() < 0.8:
        text = str(random.choice(_FILES))
        value = ParameterValue(type=4, string_value=str(folder / text) if text else "")
    else:
        value = _value(random)
        # Nothing is to be written where this is started.
        value.string_value = "" if name in _PATHS else value.string_value
    return Parameter(name=name, value=value)


def _value(random: np.random.Generator) -> ParameterValue:
    kind = int(random.integers(12))
    numbers = [float(random.choice(_FLOATS)) for _ in range(random.integers(4))]
    return ParameterValue(
        type=kind,
        bool_value=bool(random.integers(2)),
        integer_value=int(_WHOLES[random.integers(len(_WHOLES))]),
        double_value=float(random.choice(_FLOATS)),
        string_value=_TEXTS[random.integers(len(_TEXTS))],
        double_array_value=numbers,
        string_array_value=list(_TEXTS[:3]),
        integer_array_value=[1, -1],
        byte_array_value=[b"\0", b"\xff"],
        bool_array_value=[True],
    )


def _call(node: RosNode, kind: type, one: Victim, service: str, request: Any) -> Any:
    """Return the response; None if there is none."""
    client = _client(node, kind, f"{one.node.name}/{service}")
    executor = SingleThreadedExecutor(context=node.context)
    executor.add_node(node)
    call = client.call_async(request)
    executor.spin_until_future_complete(call, _PATIENCE)
    executor.remove_node(node)
    executor.shutdown()
    return call.result() if call.done() else None


def _client(node: RosNode, kind: type, name: str) -> Any:
    """Return the node's client of a service, which it keeps."""
    for client in node.clients:
        if client.srv_name == name:
            return client
    client = node.create_client(kind, name)
    assert client.wait_for_service(_PATIENCE), f"nobody offers {name}"
    return client
