# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What docs/security.md says that any peer can do: it is a stranger to whoever uses the planner."""

from __future__ import annotations

import pytest
from action_msgs.srv import CancelGoal
from focus_planner_msgs.msg import CameraFocus
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import SetParameters
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from shape_msgs.msg import Mesh

from focus_planner.ros.qos import ALL_CALLS, LATCHED
from focus_planner.runtime.reason import Reason
from testing.ros.calls import FEW, until
from testing.ros.goals import CANCELED, ended, planning
from testing.ros.planner_process import PATIENCE

pytestmark = pytest.mark.processes


@pytest.fixture(scope="module")
def planner(start_planner):
    return start_planner(*FEW)


class Peer:
    """A node that nobody knows."""

    def __init__(self, context):
        self.node = Node("stranger", context=context, use_global_arguments=False)
        self._executor = SingleThreadedExecutor(context=context)
        self._executor.add_node(self.node)

    def until(self, condition):
        return until(lambda: self._executor.spin_once(0.01) or condition())

    def call(self, kind, name, **request):
        client = self.node.create_client(kind, name, qos_profile=ALL_CALLS)
        assert client.wait_for_service(PATIENCE)
        answer = client.call_async(kind.Request(**request))
        self.until(answer.done)
        return answer.result()

    def close(self):
        self._executor.shutdown()
        self.node.destroy_node()


@pytest.fixture
def peer():
    context = Context()
    context.init(args=[])
    peer = Peer(context)
    yield peer
    peer.close()
    context.try_shutdown()


def test_a_peer_can_do_what_the_page_says(planner, client, peer, body, rig):
    # Read the scan.
    scans = []
    peer.node.create_subscription(Mesh, f"{planner.name}/mesh", scans.append, 1)
    client.publish_rig(rig)
    client.publish_mesh(body)
    peer.until(lambda: scans or client.publish_mesh(body))

    # End the goals of others, all at once.
    goal = planning(client)
    assert peer.call(CancelGoal, f"{planner.name}/plan/_action/cancel_goal").goals_canceling
    assert ended(goal)[:2] == (CANCELED, Reason.CANCELLED)

    # Set a lens.
    driver = Peer(peer.node.context)
    orders, topic = [], f"{planner.name}/cameras/{rig.cameras[0].name}/focus"
    driver.node.create_subscription(CameraFocus, topic, orders.append, LATCHED)
    lie = CameraFocus(name=rig.cameras[0].name, focus_distance=0.123)
    peer.node.create_publisher(CameraFocus, topic, LATCHED).publish(lie)
    driver.until(lambda: lie in orders)
    driver.close()

    # Change how it plans, and what time it is.
    for name, value in (
        ("samples", ParameterValue(type=ParameterType.PARAMETER_INTEGER, integer_value=100)),
        ("use_sim_time", ParameterValue(type=ParameterType.PARAMETER_BOOL, bool_value=True)),
    ):
        change = [Parameter(name=name, value=value)]
        answer = peer.call(SetParameters, f"{planner.name}/set_parameters", parameters=change)
        assert answer.results[0].successful

    # Stop it from serving, for good.
    for label in ("deactivate", "shutdown"):
        transition = Transition(label=label)
        state = peer.call(ChangeState, f"{planner.name}/change_state", transition=transition)
        assert state.success
    assert client.plan().reason == Reason.INACTIVE
    assert client.state() == "finalized"
    assert not planner.has_ended()
