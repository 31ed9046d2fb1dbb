# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Drivers over their services, and what is there in place of them."""

from __future__ import annotations

import asyncio
from collections import deque

import pytest
from rcl_interfaces.msg import ParameterType, ParameterValue, SetParametersResult
from rcl_interfaces.srv import GetParameters, ListParameters, SetParametersAtomically
from rclpy.context import Context
from rclpy.exceptions import InvalidServiceNameException
from rclpy.node import Node
from std_srvs.srv import Trigger

from focus_planner.lenses.calls import Timeouts
from focus_planner.lenses.control import LensControl
from focus_planner.lenses.driver import LensStatus
from focus_planner.lenses.orders import FocusOrder
from focus_planner.lenses.profiles import PROFILES
from focus_planner.ros.driver_parameters import DriverClients
from testing.ros.calls import until
from testing.ros.planner_process import PATIENCE
from testing.ros.spinning import spun

CAMERA_ROS = PROFILES["camera_ros"]
NAME = "/cam/camera"
ORDER = FocusOrder("a plan", 0.5)
# Answers come however busy the machine is.
PATIENT = Timeouts(timeout=float(PATIENCE), retries=0, verify_timeout=0.0, poll_period=0.01)
HASTY = Timeouts(timeout=0.3, retries=0)
DOUBLE = ParameterValue(type=ParameterType.PARAMETER_DOUBLE, double_value=2.0)
MANUAL = ParameterValue(type=ParameterType.PARAMETER_INTEGER, integer_value=0)
TEXT = ParameterValue(type=ParameterType.PARAMETER_STRING, string_value="far")
LIST = ParameterValue(type=ParameterType.PARAMETER_DOUBLE_ARRAY, double_array_value=[2.0])
YES = ParameterValue(type=ParameterType.PARAMETER_BOOL, bool_value=True)
UNKNOWN = ParameterValue(type=77)


class Driver:
    """A driver node that answers what it is told to."""

    def __init__(self, node):
        self.node = node
        self.values = {"LensPosition": DOUBLE, "AfMode": MANUAL}
        self.answer = lambda names: [self.values[name] for name in names if name in self.values]
        self.listed = ["LensPosition", "AfMode"]
        self.result = SetParametersResult(successful=True)

    def serve(self, **types):
        kinds = {
            "get_parameters": (GetParameters, self._get),
            "list_parameters": (ListParameters, self._list),
            "set_parameters_atomically": (SetParametersAtomically, self._set),
        }
        for name, (kind, callback) in kinds.items():
            self.node.create_service(types.get(name, kind), f"{NAME}/{name}", callback)

    def _get(self, request, response):
        response.values = self.answer(request.names)
        return response

    def _list(self, _, response):
        response.result.names = self.listed
        return response

    def _set(self, _, response):
        response.result = self.result
        return response


@pytest.fixture
def driver():
    # In a process of its own, as far as the middleware knows.
    context = Context()
    context.init(args=[])
    namespace, _, name = NAME.rpartition("/")
    settings = {"use_global_arguments": False, "start_parameter_services": False}
    node = Node(name, namespace=namespace, context=context, **settings)
    with spun(node):
        yield Driver(node)
    node.destroy_node()
    context.try_shutdown()


@pytest.fixture
def adapter(named):
    return named("/adapter")


@pytest.fixture
def reported(adapter):
    """Apply an order; return the report with a verdict, and all before."""

    def reported(timeouts=PATIENT):
        clients = DriverClients(adapter, [NAME])

        async def apply():
            reports, settled = [], asyncio.Event()

            def hear(report):
                reports.append(report)
                if report.status is not LensStatus.SENT or report.message:
                    settled.set()

            control = LensControl(clients.drivers[NAME], CAMERA_ROS, hear, lambda: (1, 0), timeouts)
            control.apply(ORDER)
            await asyncio.wait_for(settled.wait(), PATIENCE)
            control.stop()
            await asyncio.sleep(0)
            return reports

        with spun(adapter):
            return asyncio.run(apply())

    return reported


def test_a_driver_that_answers_well(driver, reported):
    driver.serve()
    assert [each.status for each in reported()] == [LensStatus.SENT, LensStatus.ACCEPTED]


def test_what_values_do_not_tell_is_listed(driver, reported):
    driver.serve()
    asked = []

    def answer(names):
        asked.append(list(names))
        return [DOUBLE] if names == ["LensPosition"] else []

    driver.answer, driver.listed = answer, ["LensPosition"]
    assert [each.status for each in reported()] == [LensStatus.SENT, LensStatus.ACCEPTED]
    assert asked == [["LensPosition", "AfMode"], ["LensPosition"]]


def test_a_driver_without_the_parameter(driver, reported):
    driver.serve()
    driver.values, driver.listed = {}, ["gain", "LensPosition.other"]
    (report,) = reported()
    assert report.status is LensStatus.FAILED
    assert "expected a driver with the parameter LensPosition, got one without" in report.message


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (TEXT, "got the text 'far'; this parameter moves no lens: check the adapter's parameters"),
        (LIST, "got a list; this parameter moves no lens"),
        (YES, "got true; this parameter moves no lens"),
    ],
)
def test_a_parameter_of_another_kind(driver, reported, value, words):
    driver.serve()
    driver.values["LensPosition"] = value
    report = reported()[-1]
    assert f"{NAME}: expected to read back a number for LensPosition, {words}" in report.message
    assert "internal error" not in report.message


def test_a_value_of_an_unknown_type(driver, reported):
    driver.serve()
    driver.values["LensPosition"] = UNKNOWN
    (report,) = reported()
    assert report.status is LensStatus.FAILED
    assert report.message == (
        f"{NAME}: expected a value of a type that ParameterType.msg names for LensPosition, got"
        " type 77; the driver is broken"
    )


@pytest.mark.parametrize("values", [[DOUBLE], [DOUBLE, DOUBLE, MANUAL]])
def test_another_number_of_values(driver, reported, values):
    driver.serve()
    driver.answer = lambda _: values
    (report,) = reported()
    assert report.status is LensStatus.FAILED
    assert report.message == (
        f"{NAME}: expected get_parameters to answer with 2 values or none, got {len(values)}; the"
        " driver is broken"
    )


def test_a_driver_that_answers_well_at_first_only(driver, reported):
    driver.serve()
    answers = deque([[DOUBLE, MANUAL], [UNKNOWN, MANUAL], []])
    driver.answer = lambda names: answers.popleft() if len(names) == 2 else []
    sent, failed = reported()
    assert (sent.status, failed.status) == (LensStatus.SENT, LensStatus.FAILED)
    assert failed.sent_value == 2.0
    assert "got type 77; the driver is broken" in failed.message


def test_a_refusal_without_end(driver, reported):
    driver.serve()
    driver.result = SetParametersResult(successful=False, reason=100_000 * "no")
    (report,) = reported()
    assert report.status is LensStatus.FAILED
    assert report.message.startswith(f"{NAME} refused AfMode = 0, LensPosition = 2.0: nono")


def until_seen(adapter, driver):
    """Wait until the adapter can see what the driver has."""
    namespace, _, name = NAME.rpartition("/")
    served = {each.srv_name for each in driver.node.services if each.srv_name.startswith(NAME)}

    def seen():
        if NAME not in adapter.get_fully_qualified_node_names():
            return False
        found = adapter.get_service_names_and_types_by_node(name, namespace)
        return served <= {name for name, _ in found}

    until(seen)


def test_services_of_another_type(driver, adapter, reported):
    driver.serve(get_parameters=Trigger)
    until_seen(adapter, driver)
    (report,) = reported(HASTY)
    assert report.status is LensStatus.FAILED
    assert report.message == (
        f"{NAME}: expected a driver with parameter services, found get_parameters of the type"
        " std_srvs/srv/Trigger; check the adapter's parameters driver and driver_node"
    )


def test_a_node_without_parameter_services(driver, adapter, reported):
    until_seen(adapter, driver)
    (report,) = reported(HASTY)
    assert report.status is LensStatus.FAILED
    assert "found a node without get_parameters, list_parameters, set_param" in report.message


def test_a_name_that_is_none_is_refused_at_once(adapter):
    with pytest.raises(InvalidServiceNameException, match="Invalid service name"):
        DriverClients(adapter, ["/cam/my-node"])


def test_nobody(reported):
    (report,) = reported(HASTY)
    assert report.message.startswith(f"{NAME}: expected a running driver, found none; start it")
