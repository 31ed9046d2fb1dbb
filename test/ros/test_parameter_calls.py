# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Calls about parameters that no client library makes, in this process."""

from __future__ import annotations

import pytest
from rcl_interfaces.msg import Parameter, ParameterValue, SetParametersResult
from rcl_interfaces.srv import (
    DescribeParameters,
    GetParameters,
    GetParameterTypes,
    ListParameters,
    SetParameters,
    SetParametersAtomically,
)

from focus_planner.ros.base_node import BaseNode
from focus_planner.ros.lifecycle import ManagedNode
from testing.ros.log import recorded_log

ABSURD = ["", "..", "\x1b[31m", "y" * 100_000, "none.such"]


@pytest.fixture(params=[BaseNode, ManagedNode])
def node(request, context):
    node = request.param("asked", context=context, use_global_arguments=False)
    node.declare_parameter("seed", 1)
    yield node
    node.destroy_node()


@pytest.fixture
def log(node):
    return recorded_log(node)


def call(node, kind, request):
    (service,) = [each for each in node.services if each.srv_type is kind]
    return service.callback(request, kind.Response())


def integer(value, name="seed"):
    return Parameter(name=name, value=ParameterValue(type=2, integer_value=value))


def unknown(kind, name="seed"):
    return Parameter(name=name, value=ParameterValue(type=kind))


@pytest.mark.parametrize("kind", [10, 11, 200, 255])
def test_a_value_of_an_unknown_type_is_refused_and_the_others_are_set(node, kind):
    parameters = [integer(2), unknown(kind), integer(3, "none_such"), integer(4)]
    results = call(node, SetParameters, SetParameters.Request(parameters=parameters)).results
    assert [each.successful for each in results] == [True, False, False, True]
    assert results[1].reason == (
        f"parameter seed: expected a value of a type from 0 to 9, got type {kind};"
        " see rcl_interfaces/msg/ParameterType"
    )
    assert node.get_parameter("seed").value == 4


@pytest.mark.parametrize("name", ABSURD)
@pytest.mark.parametrize("kind", [0, 2])
def test_a_name_that_is_not_declared_is_refused_and_stays_so(node, name, kind):
    parameters = [Parameter(name=name, value=ParameterValue(type=kind))]
    for service in (SetParameters, SetParametersAtomically):
        answer = call(node, service, service.Request(parameters=parameters))
        result = answer.results[0] if service is SetParameters else answer.result
        assert not result.successful
        assert result.reason.startswith("parameter: expected the name of one that is declared, got")
    listed = call(node, ListParameters, ListParameters.Request()).result.names
    assert name not in listed


@pytest.mark.parametrize("kind", [10, 255])
def test_together_none_is_set(node, kind):
    request = SetParametersAtomically.Request(parameters=[integer(2), unknown(kind)])
    result = call(node, SetParametersAtomically, request).result
    assert not result.successful
    assert f"got type {kind}" in result.reason
    assert node.get_parameter("seed").value == 1


def test_what_nobody_foresaw_is_answered_and_told_in_one_line(node, log):
    def check(parameters):
        if parameters[0].value == 3:
            raise OverflowError("too\nmuch")
        return SetParametersResult(successful=True)

    node.add_on_set_parameters_callback(check)
    request = SetParameters.Request(parameters=[integer(3), integer(2)])
    refused, taken = call(node, SetParameters, request).results
    assert (refused.successful, taken.successful) == (False, True)
    assert refused.reason == "internal error: OverflowError: too much"
    assert log.records == [
        ("error", "a call that sets parameters went wrong: OverflowError: too much")
    ]


@pytest.mark.parametrize("kind", [DescribeParameters, GetParameters, GetParameterTypes])
def test_absurd_names_are_answered(node, kind):
    for names in (ABSURD, [], ["seed"] * 1000):
        assert isinstance(call(node, kind, kind.Request(names=names)), kind.Response)


def test_so_is_a_list_of_them(node):
    request = ListParameters.Request(prefixes=ABSURD, depth=2**64 - 1)
    assert call(node, ListParameters, request).result.names == []


def test_a_reader_that_fails_reads_nothing(node, log, monkeypatch):
    def fail(_):
        raise KeyError("odd")

    monkeypatch.setattr(node, "get_parameter", fail)
    answer = call(node, GetParameters, GetParameters.Request(names=["seed"]))
    assert answer.values == []
    assert log.records == [("error", "a call that reads parameters went wrong: KeyError: 'odd'")]
