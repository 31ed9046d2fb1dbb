# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Calls to a running node, and waiting for conditions."""

from __future__ import annotations

import time
from contextlib import contextmanager
from dataclasses import replace

from focus_planner.messages.plan_reading import plan_from_message
from testing.ros.planner_process import PATIENCE

# Calls that wait for their turn however busy the machine is, and small plans.
WAITING = ("-p", f"service_max_wait:={float(PATIENCE)}")
FEW = (*WAITING, "-p", "samples:=300", "-p", "fresh_samples:=300")


@contextmanager
def having(client, **parameters):
    """Set parameters of the node, and set them back."""
    names = [name.replace("__", ".") for name in parameters]
    own = {
        name.replace(".", "__"): list(value) if isinstance(value, tuple) else value
        for name, value in client.get_parameters(names).items()
    }
    set_parameters(client, **parameters)
    try:
        yield
    finally:
        set_parameters(client, **own)


def set_parameters(client, **parameters):
    """Set parameters of the node, all of which it accepts."""
    results = client.set_parameters(**parameters)
    assert all(result.successful for result in results), results


def until(condition):
    """Wait until the condition holds, and return its value."""
    end = time.monotonic() + PATIENCE
    while not (found := condition()):
        assert time.monotonic() < end, "it never came"
        time.sleep(0.005)
    return found


def what_counts(plan):
    """All of a plan except its id and times."""
    return replace(plan_from_message(plan), solve_seconds=0.0, total_seconds=0.0)
