"""A client that asks a planner for three long plans, says so, and waits to be killed."""

from __future__ import annotations

import sys
import time

from focus_planner.ros.client import PlannerClient
from testing.ros.goals import LONG

client = PlannerClient(sys.argv[1])
long = LONG | {"time_budget": 0.5}
assert client.send_goal(print, **long).accepted
client.plan_async(**long)
client.send_goal(**long)
print("asked", flush=True)
time.sleep(3600)
