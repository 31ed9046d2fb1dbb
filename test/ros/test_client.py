# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

from __future__ import annotations

import threading

import pytest

from focus_planner.ros.client import PlannerClient
from testing.ros.calls import until


def test_a_subscription_is_destroyed_on_the_thread_that_waits_on_it(monkeypatch):
    """Elsewhere it may end that thread, and with it every later call."""
    threads = []
    with PlannerClient("/nobody") as client:
        destroy = client._node.destroy_subscription

        def noting(subscription):
            threads.append(threading.current_thread())
            return destroy(subscription)

        monkeypatch.setattr(client._node, "destroy_subscription", noting)
        with pytest.raises(TimeoutError, match="no response from status within 0 s"):
            client.status(timeout=0.0)
        until(lambda: threads)
        assert threads == [client._thread]
