# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

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
