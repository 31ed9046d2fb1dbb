# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The planner node's parameters: declared in ROS, validated together on every change."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.node import Node
from rclpy.parameter import Parameter

from focus_planner.core.validation import InputError
from focus_planner.io.bounded_wait import BoundedWait
from focus_planner.io.lens_tables import LensTables
from focus_planner.parameters.declaration import Declaration
from focus_planner.parameters.folders import PATHS, DataFolders
from focus_planner.parameters.planner import DECLARATIONS
from focus_planner.parameters.planner_settings import Settings, lens_tables_of
from focus_planner.parameters.unknown import meant_by

# For what a changed parameter names, while nobody else is answered.
_SECONDS_TO_READ = 2.0


class Parameters:
    """Declares the node's parameters, and keeps the settings that they result in.

    A change is refused, with a reason, if it would result in invalid settings, or lead where
    :class:`~focus_planner.parameters.folders.DataFolders` does not allow. What a change names is
    read on another thread, which the executor's waits for a limited time.

    Attributes
    ----------
    current : Settings

    Raises
    ------
    InputError
        If the initial values are invalid together.
    rclpy.exceptions.ParameterException
        If a value has the wrong type or is out of range.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        self._values = declare(node, DECLARATIONS)
        self.current = self._checked = Settings.from_values(self._values)
        self._folders = DataFolders.from_values(self._values)
        self._disk = BoundedWait(_SECONDS_TO_READ)
        self._warn_if_ignored()
        node.add_on_set_parameters_callback(self._check)
        node.add_post_set_parameters_callback(self._apply)

    def _check(self, parameters: list[Parameter]) -> SetParametersResult:
        changes = _declared_here(parameters)
        try:
            tables = self._read(changes)
            self._checked = Settings.from_values(self._values | changes, tables)
        except InputError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _read(self, changes: Mapping[str, Any]) -> LensTables | str:
        """Return the lens tables after a change, once its paths are known to be allowed."""
        paths = {name: changes[name] for name in PATHS if name in changes}
        # Their file is read when this parameter is set, not whenever another one changes.
        kept = "" if "lens_tables" in paths else self.current.lens_tables or ""
        if not any(paths.values()):
            return kept

        def read() -> LensTables | str:
            for name, path in paths.items():
                self._folders.check(name, path)
            return lens_tables_of(paths.get("lens_tables", "")) or kept

        return self._disk.call(" and ".join(paths), tuple(paths.items()), read)

    def _apply(self, parameters: list[Parameter]) -> None:
        self._values |= _declared_here(parameters)
        self.current = self._checked
        self._warn_if_ignored()

    def _warn_if_ignored(self) -> None:
        if self._values["lens.f_number"] and self._values["lens.hyperfocal_distance"]:
            self._node.get_logger().warning(
                "lens.f_number is ignored unless lens.hyperfocal_distance is 0"
            )
        images = [d for d in DECLARATIONS if d.name.startswith("image.")]
        if self._values["camera_frames"] and any(self._values[d.name] != d.default for d in images):
            self._node.get_logger().warning(
                "image.* is ignored for the cameras of camera_frames: their CameraInfo gives the"
                " image"
            )


def declare(node: Node, declarations: Sequence[Declaration]) -> dict[str, Any]:
    """Declare parameters, warn of others that resemble them, and return the values by name.

    Raises
    ------
    rclpy.exceptions.ParameterException
        If a value has the wrong type or is out of range.
    """
    # Parameters of other nodes may be in the same file: ROS gives a node all that fit its name.
    given = node._parameter_overrides  # noqa: SLF001 - rclpy has no other way to ask for them
    for name, meant in meant_by(given, declarations):
        node.get_logger().warning(f"there is no parameter {name}: did you mean {meant}?")
    return {
        d.name: node.declare_parameter(d.name, d.default, describe(d)).value for d in declarations
    }


def describe(declaration: Declaration) -> ParameterDescriptor:
    """Return a parameter's descriptor, as ``ros2 param describe`` shows it."""
    low, high = declaration.low, declaration.high
    descriptor = ParameterDescriptor(
        description=declaration.description, read_only=declaration.read_only
    )
    if isinstance(declaration.default, bool):
        return descriptor
    if isinstance(declaration.default, int):
        descriptor.integer_range = [IntegerRange(from_value=int(low), to_value=int(high), step=0)]
    elif isinstance(declaration.default, float):
        descriptor.floating_point_range = [
            FloatingPointRange(from_value=float(low), to_value=float(high), step=0.0)
        ]
    return descriptor


def _declared_here(parameters: Iterable[Parameter]) -> dict[str, Any]:
    """Return the values by name, without parameters that rclpy declares (use_sim_time)."""
    names = {declaration.name for declaration in DECLARATIONS}
    return {p.name: p.value for p in parameters if p.name in names}
