# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Random orders to lenses, half absurd and half broken bytes: the adapter goes on."""

from __future__ import annotations

import time
from functools import partial
from pathlib import Path

import numpy as np
from focus_planner_msgs.msg import CameraFocus
from rclpy.duration import Duration
from rclpy.publisher import Publisher
from rich.console import Console

from benchmarks.attacks.claims import orders_to
from benchmarks.attacks.lens_nodes import LensNode, running_lenses
from benchmarks.attacks.victim import new_name, peer, until
from benchmarks.fuzz.campaign import batches
from benchmarks.guarantees import Outcome, own_graph, report
from benchmarks.options import options
from benchmarks.processes import family, memory_of
from focus_planner.ros.qos import LATCHED
from testing.malformed import absurd, broken

_TABLES = "default: {unit: steps, whole: true, distances: [0.25, 1.0], values: [200, 50]}\n"
_MOST_GROWTH = 32.0
_PATIENCE = 60.0


def run(console: Console) -> bool:
    """Print the table; return whether all guarantees held."""
    with own_graph() as folder:
        return report(console, "Random orders to lenses", [partial(_orders, folder)])


def _orders(folder: Path) -> Outcome:
    tables = folder / "tables.yaml"
    tables.write_text(_TABLES)
    planner, camera = f"/{new_name('orders')}", new_name("webcam")
    webcam = {"cameras": [camera], "driver": "v4l2_camera"}
    lens = LensNode("simulated_lens", **webcam)
    adapter = LensNode("lens_adapter", **webcam, planner=planner, lens_tables=tables)
    count, random = options().count, np.random.default_rng(options().seed)
    memory, began, sent = [], time.perf_counter(), 0
    topic = f"{planner}/cameras/{camera}/focus"
    with running_lenses(lens, adapter), orders_to(planner, camera) as give, peer() as node:
        publisher = node.create_publisher(CameraFocus, topic, LATCHED)
        until(publisher.get_subscription_count, "the adapter does not listen")
        for size in batches(count):
            for _ in range(size):
                make = absurd if sent % 2 else broken
                _send(publisher, make("focus", random, name=camera, plan_id=f"random_{sent}"))
                sent += 1
            assert give(f"good_{sent}", {}), f"no good order is carried out after {sent:,}"
            assert "Traceback" not in adapter.log, f"a traceback within {sent:,}"
            memory.append(memory_of(family(adapter.pid)))
    growth = memory[-1] - memory[len(memory) // 4]
    lines = adapter.log.splitlines()
    result = (
        f"a good order was carried out after each of {len(memory)} batches; {len(lines):,} lines"
        f" logged, the longest {max(map(len, lines)):,} characters; memory {memory[-1]:.0f} MiB,"
        f" {growth:+.1f} after the first quarter;"
        f" {(time.perf_counter() - began) / count * 1000:.1f} ms each"
    )
    internal = sum("internal error" in line for line in lines)
    held = growth < _MOST_GROWTH and not internal
    return Outcome("orders on the topic of a camera", sent, result, held)


def _send(publisher: Publisher, payload: bytes) -> None:
    publisher.publish(payload)
    if not publisher.wait_for_all_acked(Duration(seconds=_PATIENCE)):
        raise TimeoutError("the adapter does not take messages any more")
