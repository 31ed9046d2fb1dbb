# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Driver nodes with simulated lenses, for tests and for work without hardware."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.parameter import Parameter

from focus_planner.lenses.profiles import DriverProfile
from focus_planner.lenses.simulated_devices import DEVICES, PerFrameDevice, SimulatedDevice
from focus_planner.parameters.lenses import SIMULATION_DECLARATIONS, SimulationSettings
from focus_planner.ros.base_node import BaseNode
from focus_planner.ros.node_parameters import declare
from focus_planner.ros.process import run, spinning
from focus_planner.runtime.stop_signals import StopSignals

# AfState of libcamera: in manual focus, and of an autofocus that has found its focus.
_IDLE, _FOCUSED = 0, 2


class SimulatedDriver(BaseNode):
    """Stands in for a driver node: its parameters, and the lenses behind them.

    Publishes, as camera_ros does
    -----------------------------
    /diagnostics : diagnostic_msgs/msg/DiagnosticArray
        Of every frame libcamera's ``LensPosition`` and ``AfState``.

    Parameters
    ----------
    node : str
        Full name of the node.
    settings : SimulationSettings
    number : int
        Distinguishes its random numbers from those of other drivers.
    """

    def __init__(self, node: str, settings: SimulationSettings, number: int = 0) -> None:
        self._settings = settings
        self._random = np.random.default_rng([settings.seed, number])
        kind = DEVICES.get(settings.driver, SimulatedDevice)
        self._devices: dict[str, SimulatedDevice] = {
            lens.profile.parameter: kind(
                lens.profile, settings.mechanics, settings.autofocus, camera in settings.stuck
            )
            for camera, lens in settings.lenses.items()
            if lens.node == node
        }
        namespace, _, name = node.rpartition("/")
        # Not the parameters of the process; the base class reads some of them already.
        super().__init__(
            name, namespace=namespace or "/", use_global_arguments=False, enable_rosout=False
        )
        for device in self._devices.values():
            self._declare(device)
        self.add_on_set_parameters_callback(self._check)
        self.add_post_set_parameters_callback(self._apply)
        self._framed = [each for each in self._devices.values() if isinstance(each, PerFrameDevice)]
        self._publisher = None
        if self._framed:
            self._frame_id = f"{namespace.removeprefix('/')}/{name}"
            self.declare_parameter("frame_id", self._frame_id)
            self.declare_parameter("camera", 0)
            if settings.metadata:
                self._publisher = self.create_publisher(DiagnosticArray, "/diagnostics", 1)

    def get_parameter(self, name: str) -> Parameter:
        """Return a parameter; for the focus the lens's position, if that is to be reported."""
        device = self._devices.get(name)
        if device is not None and self._settings.reports_position:
            position = device.position(time.monotonic())
            return Parameter(name, value=_number(device.profile, position))
        return super().get_parameter(name)

    def make_frame(self) -> None:
        """Let what was set take effect, and publish what the frame says of the lens."""
        for device in self._framed:
            device.begin_frame(time.monotonic())
            if self._publisher is not None:
                self._publisher.publish(self._metadata(device))

    def _declare(self, device: SimulatedDevice) -> None:
        for name, value in device.initial:
            if name in self._devices:
                self.declare_parameter(name, value, self._descriptor(device.profile))
            else:
                self.declare_parameter(name, value)

    def _check(self, parameters: Iterable[Parameter]) -> SetParametersResult:
        is_focus = any(parameter.name in self._devices for parameter in parameters)
        if is_focus and self._random.random() < self._settings.failure_rate:
            return SetParametersResult(successful=False, reason="simulated failure")
        # camera_ros takes parameters once they are set, the others while they decide.
        if self._framed:
            return SetParametersResult(successful=True)
        reason = self._take(parameters)
        return SetParametersResult(successful=reason is None, reason=reason or "")

    def _apply(self, parameters: Iterable[Parameter]) -> None:
        if self._framed:
            self._take(parameters)

    def _take(self, parameters: Iterable[Parameter]) -> str | None:
        values = [(parameter.name, parameter.value) for parameter in parameters]
        refused = [device.take(values, time.monotonic()) for device in self._devices.values()]
        return next((reason for reason in refused if reason is not None), None)

    def _metadata(self, device: SimulatedDevice) -> DiagnosticArray:
        """Return the metadata of a frame in the form that camera_ros 0.7 gives it."""
        said: Mapping[str, str] = {
            "LensPosition": f"{device.position(time.monotonic()):f}",
            "AfState": str(_FOCUSED if device.has_autofocus else _IDLE),
        }
        message = DiagnosticArray()
        message.header.stamp = self.get_clock().now().to_msg()
        message.header.frame_id = self._frame_id
        values = [KeyValue(key=key, value=value) for key, value in said.items()]
        message.status = [DiagnosticStatus(hardware_id=f"simulated{self._frame_id}", values=values)]
        return message

    def _descriptor(self, profile: DriverProfile) -> ParameterDescriptor:
        mechanics = self._settings.mechanics
        descriptor = ParameterDescriptor(description="Focus of the simulated lens.")
        limits: dict[str, Any] = {
            "from_value": _number(profile, mechanics.low),
            "to_value": _number(profile, mechanics.high),
        }
        if self._settings.clamps:
            return descriptor
        if profile.whole:
            descriptor.integer_range = [IntegerRange(**limits, step=0)]
        else:
            descriptor.floating_point_range = [FloatingPointRange(**limits, step=0.0)]
        return descriptor


def run_nodes(signals: StopSignals, args: list[str] | None) -> int:
    """Run simulated lenses until SIGINT or SIGTERM; return the exit status.

    Parameters
    ----------
    signals : StopSignals
    args : list of str, optional
        ROS arguments; by default those of the process.
    """
    return run("simulated_lens", _serve, signals, args)


def _serve(wait: Callable[[], None]) -> None:
    node = BaseNode("simulated_lens")
    values = declare(node, SIMULATION_DECLARATIONS)
    settings = SimulationSettings.from_values(values, node.get_namespace())
    names = dict.fromkeys(lens.node for lens in settings.lenses.values())
    drivers = [SimulatedDriver(name, settings, number) for number, name in enumerate(names)]

    def make_frames() -> None:
        for driver in drivers:
            driver.make_frame()

    # Lenses move in real time; the node's own clock may stand still, or be set back.
    steady = Clock(clock_type=ClockType.STEADY_TIME)
    node.create_timer(1.0 / settings.frame_rate, make_frames, clock=steady)
    with spinning([node, *drivers]):
        node.get_logger().info(f"{len(settings.lenses)} lenses, ready")
        wait()
    # In the order of their names, of which the middleware finds the first at once.
    for driver in drivers:
        driver.destroy_node()


def _number(profile: DriverProfile, value: float) -> int | float:
    return round(value) if profile.whole else float(value)
