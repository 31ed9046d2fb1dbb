# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Who sent a request, so that callers can take turns.

The middleware tells with every request which client wrote it. rclpy hands that on in an object
whose attributes leave it out, so it is read from the object's memory, after all that has attributes
has been found where it belongs. If it is not, the caller counts as unknown.
"""

from __future__ import annotations

import ctypes
from typing import Any

from focus_planner_msgs.srv import PlanFocus
from rclpy._rclpy_pybind11 import InvalidHandle
from rclpy.action.server import ActionServer
from rclpy.executors import SingleThreadedExecutor

#: The caller of a request of which it is not known.
UNKNOWN = b""
# The beginning of a DDS GUID names the participant, usually a process; the rest is the client's.
_PARTICIPANT = 12


class _RequestId(ctypes.Structure):
    """``rmw_request_id_t``, with which goals come."""

    _fields_ = (("writer", ctypes.c_uint8 * 16), ("sequence_number", ctypes.c_int64))


class _ServiceInfo(ctypes.Structure):
    """``rmw_service_info_t``, with which calls come."""

    _fields_ = (
        ("source_timestamp", ctypes.c_int64),
        ("received_timestamp", ctypes.c_int64),
        ("request_id", _RequestId),
    )


def caller_of_call(header: Any) -> bytes:
    """Return which participant sent a call; ``UNKNOWN`` if that cannot be told.

    Parameters
    ----------
    header : rclpy._rclpy_pybind11.rmw_service_info_t
    """
    info = _content(header, "rmw_service_info_t", _ServiceInfo)
    if info is None:
        return UNKNOWN
    found = info.source_timestamp, info.received_timestamp, info.request_id.sequence_number
    told = header.source_timestamp, header.received_timestamp, header.request_id.sequence_number
    return bytes(info.request_id.writer[:_PARTICIPANT]) if found == told else UNKNOWN


def caller_of_goal(header: Any) -> bytes:
    """Return which participant sent a goal; ``UNKNOWN`` if that cannot be told.

    Parameters
    ----------
    header : rclpy._rclpy_pybind11.rmw_request_id_t
    """
    request_id = _content(header, "rmw_request_id_t", _RequestId)
    if request_id is None or request_id.sequence_number != header.sequence_number:
        return UNKNOWN
    return bytes(request_id.writer[:_PARTICIPANT])


def _content(header: Any, name: str, structure: type[Any]) -> Any:
    """Return the C structure that pybind11 keeps in an object of this type; None for others."""
    kind = type(header)
    if (kind.__module__, kind.__name__) != ("rclpy._rclpy_pybind11", name):
        return None
    # After what all Python objects begin with, such an object has a pointer to what it wraps.
    address = ctypes.c_void_p.from_address(id(header) + object.__basicsize__).value
    return None if not address else structure.from_address(address)


class CallerTellingExecutor(SingleThreadedExecutor):
    """Tells who has sent the call whose callback begins.

    Attributes
    ----------
    caller : bytes
        To be read before the callback first waits for anything.
    """

    caller = UNKNOWN

    def _take_service(self, srv: Any) -> Any:
        if srv.srv_type is not PlanFocus:
            return super()._take_service(srv)
        try:
            with srv.handle:
                request, header = srv.handle.service_take_request(srv.srv_type.Request)
        except InvalidHandle:  # it has been destroyed meanwhile
            return None

        async def execute() -> None:
            if header is not None:
                self.caller = caller_of_call(header)
                answer = await srv.callback(request, srv.srv_type.Response())
                srv.send_response(answer, header)

        return execute


class CallerTellingActionServer(ActionServer):
    """Tells who has sent the goal whose callbacks are called.

    Attributes
    ----------
    caller : bytes
        To be read in the callbacks that accept or reject a goal.
    """

    caller = UNKNOWN

    async def execute(self, taken_data: dict[str, Any]) -> None:
        """Do what is to be done with what was taken from the middleware."""
        if "goal" in taken_data:
            self.caller = caller_of_goal(taken_data["goal"][0])
        await super().execute(taken_data)
