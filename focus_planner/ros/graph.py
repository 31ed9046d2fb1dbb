# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Who is on the graph."""

from __future__ import annotations

from focus_planner_msgs.msg import PlannerStatus
from rclpy.node import Node
from rclpy.topic_endpoint_info import TopicEndpointInfo

from focus_planner.ros.conversions import type_name_of

#: What stands for the name of a node that has not been discovered yet.
UNKNOWN = "_NODE_NAME_UNKNOWN_"
_STATUS = "/status"


def full_name_of(endpoint: TopicEndpointInfo) -> str:
    """Return the full name of the node that has a publisher or a subscription."""
    return f"{endpoint.node_namespace.rstrip('/')}/{endpoint.node_name}"


def planners_seen_by(node: Node) -> list[str]:
    """Return the full names of the planners that a node has discovered, by their ``~/status``."""
    status = type_name_of(PlannerStatus)
    return sorted(
        name.removesuffix(_STATUS)
        for name, types in node.get_topic_names_and_types()
        if status in types and name.endswith(_STATUS) and node.count_publishers(name)
    )
