# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Testing the node's guarantees: a node in a process of its own, and a table of outcomes."""

from __future__ import annotations

import os
import re
import shutil
import tempfile
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.table import Table

from benchmarks.processes import family, memory_of, status_of
from focus_planner import FocusPlan, Mesh, PlanRequest, Rig, Scene, plan_focus
from focus_planner.messages.plan_reading import plan_from_message
from testing.ros.planner_process import PlannerProcess

# What a message said stands within a line, never at its start.
_FAULT = re.compile(r"^\[(ERROR|FATAL)\]|Traceback|internal error|Warning:")
Cameras = tuple[object, ...]


@dataclass(frozen=True)
class Outcome:
    """What was tested, how often, the outcome, and whether it is as guaranteed."""

    what: str
    times: int
    result: str
    kept: bool


def report(console: Console, title: str, tests: list[Callable[[], Outcome]]) -> bool:
    """Run the tests and print their outcomes; return whether every guarantee held."""
    table = Table("what was done", "times", "what came of it", "kept", title=title)
    kept = True
    for test in tests:
        outcome = _outcome(test)
        table.add_row(
            outcome.what, f"{outcome.times:,}", outcome.result, "yes" if outcome.kept else "NO"
        )
        console.print(f"{outcome.what}: {outcome.result}", style="dim")
        kept = kept and outcome.kept
    console.print(table)
    return kept


def _outcome(test: Callable[[], Outcome]) -> Outcome:
    try:
        return test()
    except Exception as error:  # noqa: BLE001 - a test that fails must not cost the others
        traceback.print_exc()
        name = getattr(getattr(test, "func", test), "__name__", "test").strip("_")
        return Outcome(name, 0, f"{type(error).__name__}: {error}", False)


class Node(PlannerProcess):
    """A node in a process of its own, with access to its memory use and log."""

    def __init__(self, name: str, *arguments: str, **how: object) -> None:
        super().__init__(name, *arguments, forked=False, **how)

    @property
    def is_alive(self) -> bool:
        return not self.has_ended()

    @property
    def memory(self) -> float:
        """Memory of it and all processes that it started, MiB."""
        return memory_of(family(self.pid))

    @property
    def peak(self) -> float:
        """Peak resident memory so far of it and all processes that it started, MiB."""
        return sum(status_of(pid, "VmHWM") for pid in family(self.pid)) / 1024

    @property
    def faults(self) -> list[str]:
        """Unexpected lines of the log."""
        return [line for line in self.log.splitlines() if _FAULT.search(line)]


@contextmanager
def own_graph() -> Iterator[Path]:
    """Use a ROS graph of its own on this machine; yield a folder, with logs in ``log``."""
    os.environ.setdefault("ROS_DOMAIN_ID", "89")
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
    folder = Path(tempfile.mkdtemp(prefix="focus_planner_"))
    os.environ["ROS_LOG_DIR"] = str(folder / "log")
    # Nodes are started in other folders too.
    os.environ["PYTHONPATH"] = os.pathsep.join(
        [str(Path(__file__).parents[1]), *filter(None, [os.environ.get("PYTHONPATH")])]
    )
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


@contextmanager
def running(name: str, **parameters: object) -> Iterator[Node]:
    """Run a node, which must exit cleanly."""
    node = Node(f"{name}_{os.getpid()}", *arguments(**parameters))
    try:
        yield node
    finally:
        if node.is_alive:
            node.stop()


def arguments(**parameters: object) -> list[str]:
    """Return parameters as ROS arguments."""
    return [part for key, value in parameters.items() for part in ("-p", f"{key}:={_text(value)}")]


def _text(value: object) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


def cameras_for(surface: Mesh, rig: Rig, **request: object) -> Cameras:
    """Return the plan made by the library."""
    return plan_focus(Scene(surface), rig, PlanRequest(**request)).cameras  # type: ignore[arg-type]


def cameras_of(message: object) -> Cameras:
    """Return the contents of a received plan."""
    plan: FocusPlan = plan_from_message(message)
    return plan.cameras
