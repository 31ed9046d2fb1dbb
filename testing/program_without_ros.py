# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The command line on a machine without ROS: every package that comes with ROS is refused."""

from __future__ import annotations

import importlib.abc
import importlib.util
import re
import sys

ROS = re.compile(
    r"rclpy|rcl_.*|.*_msgs|.*_interfaces|rosidl.*|rpyutils|ament.*|tf2.*|ros2.*|launch.*|lark"
)


class Blocker(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if ROS.fullmatch(name.partition(".")[0]):
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)


if found := sorted(name for name in sys.modules if ROS.fullmatch(name.partition(".")[0])):
    sys.exit(f"the blocker comes too late: {found}")
sys.meta_path.insert(0, Blocker())

from focus_planner.cli.main import main  # noqa: E402 - with the blocker in place

sys.exit(main())
