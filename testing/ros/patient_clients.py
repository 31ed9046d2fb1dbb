# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Clients of a planner that wait as long as a busy machine may need."""

from focus_planner.ros import client
from testing.ros.planner_process import PATIENCE

_USUAL = client._TIMEOUT


def have_clients_wait() -> None:
    """Let every call in this process wait, where no other time is given."""
    client._TIMEOUT = float(PATIENCE)
    for kind in (client.PlannerClient, client.Goal):
        for method in vars(kind).values():
            if defaults := getattr(method, "__defaults__", None):
                longer = [client._TIMEOUT if value == _USUAL else value for value in defaults]
                method.__defaults__ = tuple(longer)
