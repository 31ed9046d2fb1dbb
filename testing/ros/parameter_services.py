# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Standard parameter services of a node in another process."""

from __future__ import annotations

from rcl_interfaces.srv import DescribeParameters, ListParameters, SetParameters
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter

from testing.ros.planner_process import PATIENCE


def call(node, service_type, name, request):
    """Call a service from a node that is not being spun, and return the response."""
    client = node.create_client(service_type, name)
    executor = SingleThreadedExecutor(context=node.context)
    executor.add_node(node)
    try:
        assert client.wait_for_service(PATIENCE), f"nobody offers {name}"
        answer = client.call_async(request)
        executor.spin_until_future_complete(answer, PATIENCE)
        assert answer.done(), f"{name} did not answer"
        return answer.result()
    finally:
        executor.remove_node(node)
        executor.shutdown()
        node.destroy_client(client)


def listed(node, planner):
    """Return the names of the planner's parameters."""
    request = ListParameters.Request()
    return set(call(node, ListParameters, f"{planner}/list_parameters", request).result.names)


def set_of(node, other, **values):
    """Set parameters of another node, one by one, all of which it accepts."""
    parameters = [Parameter(name, value=value).to_parameter_msg() for name, value in values.items()]
    request = SetParameters.Request(parameters=parameters)
    answer = call(node, SetParameters, f"{other}/set_parameters", request)
    assert all(result.successful for result in answer.results), answer


def described(node, planner, names):
    """Return the descriptors of parameters of the planner, by name."""
    request = DescribeParameters.Request(names=list(names))
    answer = call(node, DescribeParameters, f"{planner}/describe_parameters", request)
    return {each.name: each for each in answer.descriptors}
