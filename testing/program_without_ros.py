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
