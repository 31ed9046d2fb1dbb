# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

from __future__ import annotations

import pytest

from focus_planner.core.rig.camera import MAX_NAME
from focus_planner.ros.camera_topics import CameraTopics


def topics_of(node):
    return {p.topic_name for p in node.publishers if p.topic_name.startswith("/here/cameras/")}


def test_publishers_follow_the_rig(make_node, rig):
    node = make_node()
    topics = CameraTopics(node)
    topics.follow([camera.name for camera in rig.cameras[:3]])
    assert topics_of(node) == {f"/here/cameras/{c.name}/focus" for c in rig.cameras[:3]}
    kept = [p for p in node.publishers if rig.cameras[2].name in p.topic_name]
    topics.follow([camera.name for camera in rig.cameras[2:5]])
    assert topics_of(node) == {f"/here/cameras/{c.name}/focus" for c in rig.cameras[2:5]}
    assert kept[0] in node.publishers


def test_the_longest_name_is_what_the_topics_of_a_node_leave_room_for(make_node):
    assert CameraTopics(make_node()).longest_name == MAX_NAME
    node = make_node(namespace="n" * 140)
    longest = CameraTopics(node).longest_name
    assert 0 < longest < MAX_NAME
    node.resolve_topic_name(f"~/cameras/{'a' * longest}/focus")
    with pytest.raises(RuntimeError):
        node.resolve_topic_name(f"~/cameras/{'a' * (longest + 1)}/focus")
