# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The ROS 2 layer: the node, its parameters, a client, rclpy's messages. It does no mathematics.

Importing any of it without rclpy or the interfaces raises an error that says what to type.
"""

from importlib.util import find_spec

_REMEDIES = {
    "rclpy": "source ROS 2 (. /opt/ros/jazzy/setup.bash) for its own Python, or type `make setup`"
    " in a clone",
    "focus_planner_msgs": "in a workspace type `colcon build --base-paths src"
    " src/focus_planner/msg_defs` and `. install/setup.bash`, in a clone by itself `make setup`",
}


def _check(package: str, remedy: str) -> None:
    """Find a package, without importing it: rclpy starts a thread."""
    try:
        found = find_spec(package)
    except ModuleNotFoundError:
        found = None
    if found is None or found.origin is None:  # a folder of that name is no package
        raise ModuleNotFoundError(f"No module named '{package}': {remedy}", name=package)


for _package, _remedy in _REMEDIES.items():
    _check(_package, _remedy)
