"""Peak memory of one plan at 65,536 samples, in a process of its own."""

from __future__ import annotations

import subprocess
import sys

from rich.console import Console

_PLAN = """
import resource
from benchmarks.scenes import body_scenes, rig
from focus_planner import PlanRequest, plan_focus
def peak(): return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
scene = next(iter(body_scenes().values()))
before = peak()
plan_focus(scene, rig(), PlanRequest(samples=65536))
print(f"{before:.2f} {peak():.2f}")
"""


def run(console: Console) -> None:
    done = subprocess.run([sys.executable, "-c", _PLAN], capture_output=True, text=True, check=True)
    before, peak = done.stdout.split()
    console.print(
        f"Peak memory of a plan at 65,536 samples: {peak} GiB"
        f" ({before} GiB of it before planning: libraries and the body)\n"
    )
