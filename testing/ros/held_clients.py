# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Clients that each ask a planner for a long plan, say so, and then what they are answered."""

from __future__ import annotations

import os
import sys

from focus_planner.ros.client import PlannerClient
from testing.ros.goals import LONG
from testing.ros.one_process import end_deliveries_within_it
from testing.ros.planner_process import PATIENCE

_CLIENTS = 4

end_deliveries_within_it()
clients = [PlannerClient(sys.argv[1]) for _ in range(_CLIENTS)]
for client in clients:
    client.wait_for_node(PATIENCE)
calls = [client.plan_async(**LONG) for client in clients]
print("asked", flush=True)
for client, call in zip(clients, calls, strict=True):
    print(client.wait_for(call, PATIENCE).message, flush=True)
os._exit(0)
