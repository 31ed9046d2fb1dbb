from __future__ import annotations

from dataclasses import replace

import pytest

from focus_planner.core.rig.rig import Rig
from focus_planner.core.validation import InputError
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


def test_a_name_too_long_for_a_topic_is_an_input_error(make_node, rig):
    topics = CameraTopics(make_node(namespace="n" * 140))
    with pytest.raises(InputError, match="camera name: expected part of a topic's name, got 'aaa"):
        topics.check(Rig((rig.cameras[0], replace(rig.cameras[1], name="a" * 100))))
    assert topics.check(rig) is rig
