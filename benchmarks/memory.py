"""Peak memory of one plan at 65,536 samples, in a process of its own."""

from __future__ import annotations

import subprocess
import sys

from rich.console import Console

_PLAN = """
from pathlib import Path
from benchmarks.scenes import body_scenes, rig
from focus_planner import PlanRequest, plan_focus
def peak():
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmHWM")) / 2**20
scene = next(iter(body_scenes().values()))
before = peak()
plan_focus(scene, rig(), PlanRequest(samples=65536))
print(f"{before:.2f} {peak():.2f}")
"""


def run(console: Console) -> None:
    command = [sys.executable, "-c", _PLAN]
    done = subprocess.run(command, capture_output=True, text=True, check=True)  # noqa: S603
    before, peak = done.stdout.split()
    console.print(
        f"Peak memory of a plan at 65,536 samples: {peak} GiB"
        f" ({before} GiB of it before planning: libraries and the body)\n"
    )
