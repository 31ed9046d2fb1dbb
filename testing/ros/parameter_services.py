"""Standard parameter services of a node in another process."""

from __future__ import annotations

from rcl_interfaces.srv import DescribeParameters, ListParameters
from rclpy.executors import SingleThreadedExecutor

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


def described(node, planner, names):
    """Return the descriptors of parameters of the planner, by name."""
    request = DescribeParameters.Request(names=list(names))
    answer = call(node, DescribeParameters, f"{planner}/describe_parameters", request)
    return {each.name: each for each in answer.descriptors}
