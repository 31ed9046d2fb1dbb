# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Peak memory of one plan at 65,536 samples, in a process of its own."""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

from rich.console import Console

from benchmarks.scenes import body_scenes, rig
from focus_planner import PlanRequest, plan_focus


def run(console: Console) -> None:
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as process:
        before, after = process.submit(_plan).result()
    console.print(
        f"Peak memory of a plan at 65,536 samples: {after:.2f} GiB"
        f" ({before:.2f} GiB of it before planning: libraries and the body)\n"
    )


def peak() -> float:
    """Return this process's peak memory so far, GiB."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmHWM")) / 2**20


def _plan() -> tuple[float, float]:
    scene = next(iter(body_scenes().values()))
    before = peak()
    plan_focus(scene, rig(), PlanRequest(samples=65536))
    return before, peak()
