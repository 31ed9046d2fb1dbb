# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""A client of the planner node: publishes surfaces and rigs, requests plans, receives them."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from types import TracebackType
from typing import Any, final
from uuid import uuid4

from focus_planner_msgs.action import PlanFocus as PlanFocusAction
from focus_planner_msgs.msg import CameraFocus, CameraRig, FocusPlan, PlannerStatus
from focus_planner_msgs.srv import PlanFocus
from geometry_msgs.msg import PoseArray
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rcl_interfaces.msg import SetParametersResult
from rcl_interfaces.srv import GetParameters, SetParameters, SetParametersAtomically
from rclpy.action.client import ActionClient, ClientGoalHandle
from rclpy.client import Client
from rclpy.context import Context
from rclpy.duration import Duration
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter, parameter_value_to_python
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.task import Future
from sensor_msgs.msg import PointCloud2
from shape_msgs.msg import Mesh as MeshMsg

from focus_planner.core.rig.rig import Rig
from focus_planner.core.surface.surface import Mesh, PointCloud
from focus_planner.messages.writing import (
    Fields,
    Stamp,
    cloud_to_fields,
    header_fields,
    mesh_to_bytes,
    poses_to_fields,
    rig_to_fields,
)
from focus_planner.ros.base_node import BaseNode
from focus_planner.ros.calls import (
    WhileOffered,
    call_until_answered,
    result_of,
    wait_for_service,
)
from focus_planner.ros.conversions import message_to_ros, type_name_of
from focus_planner.ros.graph import full_name_of, planners_seen_by
from focus_planner.ros.qos import ALL_CALLS, LATCHED
from focus_planner.ros.status_watch import StatusWatch
from focus_planner.ros.waiting import wait_for

_INPUTS = {
    "mesh": MeshMsg,
    "cloud": PointCloud2,
    "camera_poses": PoseArray,
    "rig": CameraRig,
}
# With a depth of 1 Fast DDS requests an acknowledgement of every message, else every 3 s.
_RELIABLE = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE)
_TIMEOUT = 30.0
# Of waiting for an acknowledgement, seconds.
_STEP = 0.1

Send = Callable[[Callable[[], Future]], Future]


@final
class Goal:
    """A goal of ``~/plan``.

    Attributes
    ----------
    accepted : bool
        Whether the planner accepted it.
    """

    def __init__(
        self,
        handle: ClientGoalHandle,
        send: Send,
        on_wait: Callable[[], object] = lambda: None,
    ) -> None:
        self._handle = handle
        self._send = send
        self._on_wait = on_wait
        self._result = send(handle.get_result_async) if handle.accepted else None
        self.accepted: bool = handle.accepted

    def cancel(self, timeout: float = _TIMEOUT) -> bool:
        """Ask for it to end with the best plan so far; return whether it will."""
        sent = self._send(self._handle.cancel_goal_async)
        answer = result_of(sent, timeout, "plan's cancel_goal")
        return bool(answer.goals_canceling)

    def result(self, timeout: float = 600.0) -> tuple[int, PlanFocusAction.Result]:
        """Wait until it ends; return its status, one of ``GoalStatus``, and its result."""
        assert self._result is not None
        answer = result_of(self._result, timeout, "plan", self._on_wait)
        return answer.status, answer.result


@final
class PlannerClient:
    """A client of a planner node, with a context and a thread of its own; a context manager.

    Its methods that publish return once the node has received the message, so that a request made
    afterwards is planned with it.

    Parameters
    ----------
    planner : str
        Full name of the planner node.
    on_wait : callable, optional
        Called again and again by methods while they wait for the node; what it raises ends them.

    Raises
    ------
    TimeoutError
        From any method, if the node does not respond in time.
    """

    def __init__(
        self, planner: str = "/focus_planner", on_wait: Callable[[], object] = lambda: None
    ) -> None:
        self._planner = planner
        self._on_wait = on_wait
        self._context = Context()
        self._context.init(args=[])
        name = f"focus_planner_client_{uuid4().hex[:8]}"
        self._node = BaseNode(
            name,
            context=self._context,
            use_global_arguments=False,
            enable_rosout=False,
            start_parameter_services=False,
        )
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._inputs: dict[str, _InputPublisher] = {}
        self._plan_focus = self._client(PlanFocus, "plan_focus")
        self._set_parameters = self._client(SetParameters, "set_parameters")
        self._set_parameters_atomically = self._client(
            SetParametersAtomically, "set_parameters_atomically"
        )
        self._get_parameters = self._client(GetParameters, "get_parameters")
        self._change_state = self._client(ChangeState, "change_state")
        self._get_state = self._client(GetState, "get_state")
        self._plan = ActionClient(
            self._node,
            PlanFocusAction,
            f"{planner}/plan",
            goal_service_qos_profile=ALL_CALLS,
            result_service_qos_profile=ALL_CALLS,
            cancel_service_qos_profile=ALL_CALLS,
        )
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._spin, name=name)
        self._thread.start()

    def __enter__(self) -> PlannerClient:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Leave the graph."""
        self._closing.set()
        # Waking the executor does not end its spin, a task does.
        self._executor.create_task(lambda: None)
        self._thread.join()
        self._executor.shutdown()
        self._plan.destroy()  # which the node does not, and which would keep all in the graph
        self._node.destroy_node()
        self._context.try_shutdown()

    def publish_mesh(self, mesh: Mesh) -> None:
        """Publish a mesh, in the planner's frame."""
        self.publish("mesh", mesh_to_bytes(mesh))

    def publish_cloud(
        self, cloud: PointCloud, frame_id: str = "world", stamp: Stamp = (0, 0)
    ) -> None:
        """Publish a cloud."""
        header = {"header": header_fields(frame_id, stamp)}
        self._publish_fields("cloud", cloud_to_fields(cloud, frame_id) | header)

    def publish_poses(self, rig: Rig) -> None:
        """Publish a rig's poses; the planner takes intrinsics and lens from its parameters."""
        self._publish_fields("camera_poses", poses_to_fields(rig))

    def publish_rig(self, rig: Rig, stamp: Stamp = (0, 0)) -> None:
        """Publish a rig with names, intrinsics, lenses and grid."""
        header = {"header": header_fields(rig.frame_id, stamp)}
        self._publish_fields("rig", rig_to_fields(rig) | header)

    def publish(self, topic: str, message: Any) -> None:
        """Publish a message, or its serialized bytes, on one of the planner's input topics."""
        self._input_of(topic).publish(message)

    def plan(self, timeout: float = 600.0, **request: Any) -> PlanFocus.Response:
        """Call ``~/plan_focus`` with the given request fields, and wait for the response."""
        return self.wait_for(self.plan_async(**request), timeout)

    def plan_async(self, **request: Any) -> Future:
        """Call ``~/plan_focus`` with the given request fields."""
        self.wait_for_node()
        return self._plan_focus.call_async(PlanFocus.Request(**request))

    def wait_for(self, call: Future, timeout: float = 600.0) -> PlanFocus.Response:
        """Wait for the response to :meth:`plan_async`."""
        here = WhileOffered(self._plan_focus.service_is_ready, "plan_focus", self._on_wait)
        return result_of(call, timeout, "plan_focus", here)

    def send_goal(
        self, on_feedback: Callable[[PlanFocusAction.Feedback], None] | None = None, **goal: Any
    ) -> Goal:
        """Send a goal of ``~/plan`` with the given fields; return it once accepted or rejected.

        Parameters
        ----------
        on_feedback : callable, optional
            Called with feedback as it arrives, on the client's thread, until the result does.
        """
        if not self._plan.wait_for_server(_TIMEOUT):
            raise TimeoutError(f"no planner offers {self._planner}/plan; is the node running?")
        forward = None if on_feedback is None else lambda message: on_feedback(message.feedback)
        request = PlanFocusAction.Goal(**goal)
        sent = self._send(partial(self._plan.send_goal_async, request, forward))
        here = WhileOffered(self._plan.server_is_ready, "plan", self._on_wait)
        return Goal(result_of(sent, _TIMEOUT, "plan's send_goal"), self._send, here)

    def change_state(self, transition: str) -> bool:
        """Request a transition, such as ``"activate"``; return whether it was made."""
        request = ChangeState.Request(transition=Transition(label=transition))
        wait_for_service(self._change_state, _TIMEOUT, self._on_wait)
        call = self._change_state.call_async(request)
        return bool(result_of(call, 600.0, "change_state", self._on_wait).success)

    def state(self) -> str:
        """Return the state of the planner's life cycle."""
        answer = self._call(self._get_state, GetState.Request(), "get_state")
        label: str = answer.current_state.label
        return label

    def status(self, timeout: float = _TIMEOUT) -> PlannerStatus:
        """Return the planner's newest status: its state, its inputs and all lenses."""
        return self._latched(PlannerStatus, "status", timeout)

    def watch_status(self) -> StatusWatch:
        """Return what hears every status of the planner from now on."""
        return StatusWatch(self._node, f"{self._planner}/status", self._on_wait)

    def planners(self) -> list[str]:
        """Return the full names of the planners that are on the graph, as far as discovered."""
        return planners_seen_by(self._node)

    @property
    def domain(self) -> int:
        """The ROS domain."""
        return self._context.get_domain_id()

    def set_parameters(self, **values: Any) -> list[SetParametersResult]:
        """Set parameters of the planner; write ``__`` for a dot in a name."""
        parameters = [
            Parameter(name.replace("__", "."), value=value).to_parameter_msg()
            for name, value in values.items()
        ]
        request = SetParameters.Request(parameters=parameters)
        answer = self._call(self._set_parameters, request, "set_parameters")
        results: list[SetParametersResult] = answer.results
        return results

    def set_parameters_atomically(self, values: Mapping[str, Any]) -> SetParametersResult:
        """Set parameters of the planner by name, all of them or none."""
        parameters = [
            Parameter(name, value=list(value) if isinstance(value, tuple) else value)
            for name, value in values.items()
        ]
        request = SetParametersAtomically.Request(
            parameters=[parameter.to_parameter_msg() for parameter in parameters]
        )
        answer = self._call(self._set_parameters_atomically, request, "set_parameters_atomically")
        return answer.result

    def get_parameters(self, names: Sequence[str]) -> dict[str, Any]:
        """Return the values of some of the planner's parameters, lists as tuples."""
        request = GetParameters.Request(names=list(names))
        answer = self._call(self._get_parameters, request, "get_parameters")
        values = [parameter_value_to_python(value) for value in answer.values]
        return {
            name: value if isinstance(value, (str, int, float)) else tuple(value)
            for name, value in zip(names, values, strict=True)
        }

    def wait_for_node(self, timeout: float = _TIMEOUT) -> None:
        """Wait until the planner's service is available."""
        wait_for_service(self._plan_focus, timeout, self._on_wait)

    def latched_plan(self, timeout: float = _TIMEOUT) -> FocusPlan:
        """Return the newest plan, as a new subscriber receives it."""
        return self._latched(FocusPlan, "focus_plan", timeout)

    def latched_focus(self, camera: str, timeout: float = _TIMEOUT) -> CameraFocus:
        """Return a camera's part of the newest plan, as its driver receives it."""
        return self._latched(CameraFocus, f"cameras/{camera}/focus", timeout)

    def _input_of(self, topic: str) -> _InputPublisher:
        # Not before there is something to publish: a planner tells its callers of publishers that
        # have sent nothing.
        if topic not in self._inputs:
            self._inputs[topic] = self._input(_INPUTS[topic], f"{self._planner}/{topic}")
        return self._inputs[topic]

    def _input(self, message_type: type, topic: str) -> _InputPublisher:
        wait = partial(wait_for, on_wait=self._on_wait)
        return _InputPublisher(self._node, message_type, topic, self._planner, wait)

    def _publish_fields(self, topic: str, fields: Fields) -> None:
        self.publish(topic, message_to_ros(_INPUTS[topic], fields))

    def _latched(self, message_type: type, topic: str, timeout: float) -> Any:
        message = Future()
        subscription = self._node.create_subscription(
            message_type, f"{self._planner}/{topic}", message.set_result, LATCHED
        )
        try:
            return result_of(message, timeout, topic, self._on_wait)
        finally:
            self._destroy_soon(self._node.destroy_subscription, subscription)

    def _destroy_soon(self, destroy: Callable[[Any], bool], entity: Any) -> None:
        """Destroy an entity of the node on the thread that spins.

        Destroyed on another one while the executor prepares to wait for it, its events would end
        that thread with an ``InvalidHandle``, and no call would be answered any more.
        """
        self._executor.create_task(destroy, entity)

    def _client(self, service_type: type, service: str) -> Client:
        return self._node.create_client(
            service_type, f"{self._planner}/{service}", qos_profile=ALL_CALLS
        )

    def _call(self, client: Client, request: Any, what: str) -> Any:
        """Call a service for which twice is as good as once."""
        wait_for_service(client, _TIMEOUT, self._on_wait)
        return call_until_answered(client, request, _TIMEOUT, what, self._on_wait)

    def _send(self, send: Callable[[], Future]) -> Future:
        """Send on the thread that spins.

        rclpy's action client registers a request only after sending it, without a lock, and may
        miss a response that arrives in between.
        """
        task = self._executor.create_task(send)
        sent: Future = result_of(task, _TIMEOUT, "this client's own thread")
        return sent

    def _spin(self) -> None:
        while not self._closing.is_set():
            self._executor.spin_once()


class _InputPublisher:
    """A publisher that waits until the planner has received its messages."""

    def __init__(
        self,
        node: Node,
        message_type: type,
        topic: str,
        planner: str,
        wait: Callable[[Callable[[], bool], float], bool],
    ) -> None:
        self._node = node
        self._message_type = message_type
        self._topic = topic
        self._planner = planner
        self._wait = wait
        self._publisher: Publisher | None = None

    def publish(self, message: Any) -> None:
        if not self._wait(self._is_matched, _TIMEOUT):
            raise TimeoutError(f"no planner subscribes to {self._topic}; is the node running?")
        assert self._publisher is not None
        self._publisher.publish(message)
        if not self._wait(self._is_acknowledged, _TIMEOUT):
            raise TimeoutError(f"the planner did not acknowledge the message on {self._topic}")

    def _is_matched(self) -> bool:
        """Return whether the planner's own subscription will receive what is published.

        Others may subscribe as well, and which of them have been matched is not told: all must be.
        """
        type_name = type_name_of(self._message_type)
        found = self._node.get_subscriptions_info_by_topic(self._topic)
        found = [each for each in found if each.topic_type == type_name]
        own = [each for each in found if full_name_of(each) == self._planner]
        if not own:
            return False
        if self._publisher is None:
            # Latched only for a planner that asks for that: with Fast DDS, volatile subscriptions
            # that come after a latched message never acknowledge the next.
            qos = QoSProfile(
                depth=_RELIABLE.depth,
                reliability=_RELIABLE.reliability,
                durability=own[0].qos_profile.durability,
            )
            self._publisher = self._node.create_publisher(self._message_type, self._topic, qos)
        return self._publisher.get_subscription_count() >= len(found)

    def _is_acknowledged(self) -> bool:
        assert self._publisher is not None
        acknowledged: bool = self._publisher.wait_for_all_acked(Duration(seconds=_STEP))
        return acknowledged
