"""Driver nodes with simulated lenses, for tests and for work without hardware."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.node import Node
from rclpy.parameter import Parameter

from focus_planner.lenses.simulation import MovingLens
from focus_planner.parameters.lenses import SIMULATION_DECLARATIONS, SimulationSettings
from focus_planner.ros.process import declare, run, spinning

_ON = {"AfMode": 2, "focus_automatic_continuous": True}


class SimulatedLens(Node):
    """Stands in for one camera's driver node: its parameters, and a lens behind them.

    As with the real drivers a lens cannot be set during autofocus: v4l2_camera refuses the value
    without giving a reason, and camera_ros accepts it and does nothing.

    Parameters
    ----------
    node : str
        Full name of the node.
    settings : SimulationSettings
    stuck : bool
        Whether the lens never moves.
    number : int
        Distinguishes its random numbers from those of other lenses.
    """

    def __init__(self, node: str, settings: SimulationSettings, stuck: bool, number: int) -> None:
        self._settings = settings
        self._focus = settings.profile.parameter
        self._random = np.random.default_rng([settings.seed, number])
        self._lens = MovingLens(settings.mechanics, settings.mechanics.low, stuck)
        self._switches = [name for name, _ in settings.profile.manual if name in _ON]
        namespace, _, name = node.rpartition("/")
        # Not the parameters of the process; the base class reads some of them already.
        super().__init__(
            name, namespace=namespace or "/", use_global_arguments=False, enable_rosout=False
        )
        for switch in self._switches:
            self.declare_parameter(switch, _ON[switch] if settings.autofocus else _off(switch))
        self.declare_parameter(
            self._focus, self._number(settings.mechanics.low), self._descriptor()
        )
        self.add_on_set_parameters_callback(self._check)
        self.add_post_set_parameters_callback(self._move)

    def get_parameter(self, name: str) -> Parameter:
        """Return a parameter; for the focus the lens's position, if that is to be reported."""
        if name == self._focus and self._settings.reports_position:
            return Parameter(name, value=self._number(self._lens.position(time.monotonic())))
        return super().get_parameter(name)

    def _check(self, parameters: Iterable[Parameter]) -> SetParametersResult:
        for parameter in parameters:
            if parameter.name != self._focus:
                continue
            if self._random.random() < self._settings.failure_rate:
                return SetParametersResult(successful=False, reason="simulated failure")
            if self._settings.profile.whole and self._autofocus():
                return SetParametersResult(successful=False, reason="")
        return SetParametersResult(successful=True)

    def _move(self, parameters: Iterable[Parameter]) -> None:
        for parameter in parameters:
            if parameter.name == self._focus and not self._autofocus():
                value = self._settings.mechanics.clamp(parameter.value)
                self._lens.command(value, time.monotonic())

    def _autofocus(self) -> bool:
        values = (super(SimulatedLens, self).get_parameter(name) for name in self._switches)
        return any(bool(parameter.value) for parameter in values)

    def _number(self, value: float) -> int | float:
        return round(value) if self._settings.profile.whole else float(value)

    def _descriptor(self) -> ParameterDescriptor:
        mechanics = self._settings.mechanics
        descriptor = ParameterDescriptor(description="Focus of the simulated lens.")
        limits: dict[str, Any] = {
            "from_value": self._number(mechanics.low),
            "to_value": self._number(mechanics.high),
        }
        if self._settings.clamps:
            return descriptor
        if self._settings.profile.whole:
            descriptor.integer_range = [IntegerRange(**limits, step=0)]
        else:
            descriptor.floating_point_range = [FloatingPointRange(**limits, step=0.0)]
        return descriptor


def main(args: list[str] | None = None) -> int:
    """Run simulated lenses until SIGINT or SIGTERM; return the exit status."""
    return run("simulated_lens", _serve, args)


def _serve(wait: Callable[[], None]) -> None:
    node = Node("simulated_lens")
    settings = SimulationSettings.from_values(declare(node, SIMULATION_DECLARATIONS))
    lenses = [
        SimulatedLens(name, settings, camera in settings.stuck, number)
        for number, (camera, name) in enumerate(settings.nodes.items())
    ]
    with spinning([node, *lenses]):
        node.get_logger().info(f"{len(lenses)} lenses, ready")
        wait()


def _off(switch: str) -> int | bool:
    return type(_ON[switch])(0)


if __name__ == "__main__":
    sys.exit(main())
