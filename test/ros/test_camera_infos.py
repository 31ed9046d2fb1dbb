# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""``CameraInfo`` of drivers that come, go and change."""

from __future__ import annotations

import pytest

pytest.importorskip("focus_planner_msgs")

from focus_planner.core.rig.camera import CameraIntrinsics
from focus_planner.ros.camera_infos import CameraInfos
from testing.ros.calls import until
from testing.ros.static_frames import LATCHED, SENSOR_DATA, camera_info

IMAGE = CameraIntrinsics(640, 480, 500.0, 501.0, 320.0, 240.0)
TOPIC = "/test_camera_infos/camera_info"


@pytest.fixture
def infos(make_node):
    return CameraInfos(make_node(), TOPIC.__eq__, 10)


@pytest.fixture
def start_driver(named):
    """Start drivers; each sends its message again and again while it is asked for."""
    node = named("/driver")

    def start(qos):
        message = camera_info("cam_0", IMAGE)
        return node.create_publisher(type(message), TOPIC, qos), message

    return start


def hears(infos, driver):
    """Look until a driver is heard."""
    publisher, message = driver

    def look():
        publisher.publish(message)
        infos.discover()
        return [topic for topic, _ in infos.look()]

    assert until(look) == [TOPIC]


@pytest.mark.parametrize("others", [(SENSOR_DATA, LATCHED), (LATCHED, SENSOR_DATA)])
def test_a_driver_that_is_replaced_by_one_that_offers_less_or_more_is_heard(
    infos, start_driver, others
):
    for qos in others:
        driver = start_driver(qos)
        hears(infos, driver)
        driver[0].destroy()
    infos.destroy()


def test_a_topic_without_a_publisher_is_gone_until_it_has_one_again(infos, start_driver):
    for _ in range(2):
        driver = start_driver(SENSOR_DATA)
        hears(infos, driver)
        assert infos.gone == set()
        driver[0].destroy()

        def is_gone():
            infos.discover()
            list(infos.look())
            return infos.gone

        assert until(is_gone) == {TOPIC}
    infos.destroy()
