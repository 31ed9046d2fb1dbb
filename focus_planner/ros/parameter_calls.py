# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Calls about parameters are answered, whatever is in them."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.msg import SetParametersResult
from rcl_interfaces.srv import (
    DescribeParameters,
    GetParameters,
    GetParameterTypes,
    ListParameters,
    SetParameters,
    SetParametersAtomically,
)
from rclpy.parameter import Parameter

from focus_planner.core.text import MAX_REASON, printable
from focus_planner.core.validation import InputError

_Callback = Callable[[Any, Any], Any]
_READERS = (DescribeParameters, GetParameters, GetParameterTypes, ListParameters)
_TYPES = frozenset(kind.value for kind in Parameter.Type)


class AnsweredParameterCalls:
    """Mix-in of nodes: rclpy's parameter services answer where they would raise.

    What a call cannot set is refused with a reason, one of each parameter; a call that reads is
    answered with nothing, as it is for names that are not declared. Where something went wrong
    that nobody foresaw, one line is logged.
    """

    def create_service(
        self, srv_type: Any, srv_name: str, callback: _Callback, **options: Any
    ) -> Any:
        """Create a service; rclpy creates its own by this too."""
        if srv_type is SetParameters:
            callback = self._each_set(callback)
        elif srv_type is SetParametersAtomically:
            callback = self._set_together(callback)
        elif srv_type in _READERS:
            callback = self._read(callback)
        return super().create_service(srv_type, srv_name, callback, **options)  # type: ignore[misc]

    def _each_set(self, callback: _Callback) -> _Callback:
        def call(request: Any, response: Any) -> Any:
            for parameter in request.parameters:
                one = SetParameters.Request(parameters=[parameter])
                result = self._result(one, partial(_only_result, callback, one))
                response.results.append(result)
            return response

        return call

    def _set_together(self, callback: _Callback) -> _Callback:
        def call(request: Any, response: Any) -> Any:
            response.result = self._result(request, lambda: callback(request, response).result)
            return response

        return call

    def _read(self, callback: _Callback) -> _Callback:
        def call(request: Any, response: Any) -> Any:
            try:
                return callback(request, response)
            except Exception as error:  # noqa: BLE001 - no call of a peer's may end the node
                self._tell("read", error)
                return type(response)()

        return call

    def _result(self, request: Any, set_them: Callable[[], Any]) -> Any:
        try:
            for parameter in request.parameters:
                self._check_declared(parameter.name)
                _check_type(parameter)
            return set_them()
        except InputError as error:
            reason = str(error)
        except Exception as error:  # noqa: BLE001 - no call of a peer's may end the node
            reason = self._tell("set", error)
        return SetParametersResult(successful=False, reason=reason)

    def _check_declared(self, name: str) -> None:
        # rclpy would take a value that is not set for a name that is not declared.
        if not name or not self.has_parameter(name):  # type: ignore[attr-defined]
            raise InputError(
                "parameter", "the name of one that is declared", repr(name), "see ros2 param list"
            )

    def _tell(self, what: str, error: Exception) -> str:
        """Log what was unforeseen; return it for the caller."""
        told = printable(f"{type(error).__name__}: {error}", MAX_REASON)
        self.get_logger().error(  # type: ignore[attr-defined]
            f"a call that {what}s parameters went wrong: {told}"
        )
        return f"internal error: {told}"


def _only_result(callback: _Callback, request: Any) -> Any:
    (result,) = callback(request, SetParameters.Response()).results
    return result


def _check_type(parameter: ParameterMessage) -> None:
    kind = parameter.value.type
    if kind not in _TYPES:
        raise InputError(
            f"parameter {parameter.name}",
            f"a value of a type from {min(_TYPES)} to {max(_TYPES)}",
            f"type {kind}",
            "see rcl_interfaces/msg/ParameterType",
        )
