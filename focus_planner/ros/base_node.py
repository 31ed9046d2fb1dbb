"""What every node of ours is, managed or not."""

from __future__ import annotations

from rclpy.node import Node

from focus_planner.ros.log import PrintableLog
from focus_planner.ros.parameter_calls import AnsweredParameterCalls


class OwnNode(PrintableLog, AnsweredParameterCalls):
    """Mix-in of nodes: a printable log, and parameter services that answer."""


class BaseNode(OwnNode, Node):
    """A node with a printable log and parameter services that answer."""
