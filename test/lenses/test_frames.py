# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Which frames are whose, and what they say."""

from __future__ import annotations

import math

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from focus_planner.core.validation import InputError
from focus_planner.lenses.frames import Frame, FrameLog, FrameSource, frame_from_message


def message(name="", frame_id="pi0", **values):
    """Return what camera_ros 0.7 publishes of a frame."""
    made = DiagnosticArray()
    made.header.stamp.sec, made.header.stamp.nanosec = 3, 4
    made.header.frame_id = frame_id
    said = [KeyValue(key=key, value=value) for key, value in values.items()]
    made.status = [DiagnosticStatus(name=name, hardware_id="/base/imx708@1a", values=said)]
    return made


def test_the_metadata_of_a_frame():
    said = {"ExposureTime": "9985", "LensPosition": "1.724138", "AfState": "0"}
    frame = frame_from_message(message(**said))
    assert frame == Frame((3, 4), "pi0", "/base/imx708@1a", 1.724138, "")


@pytest.mark.parametrize("state", ["1", "2", "3"])
def test_any_other_state_than_idle_is_autofocus(state):
    assert frame_from_message(message(LensPosition="2.0", AfState=state)).autofocus == state


@pytest.mark.parametrize("said", [{"ExposureTime": "1"}, {"LensPosition": "<ValueType Error>"}])
def test_frames_that_do_not_tell(said):
    assert math.isnan(frame_from_message(message(**said)).position)


def test_what_is_no_frame():
    assert frame_from_message(message(name="focus_planner: memory", LensPosition="1")) is None
    assert frame_from_message(message()) is None  # of a request that was cancelled
    assert frame_from_message(DiagnosticArray()) is None


@pytest.mark.parametrize(
    ("frame_id", "camera", "source"),
    [
        ("pi0", "/base/imx708@1a", FrameSource("pi0", "/base/imx708@1a")),
        ("pi0", 0, FrameSource("pi0")),
        ("pi0", None, FrameSource("pi0")),
        (None, 0, None),
    ],
)
def test_what_the_drivers_parameters_say(frame_id, camera, source):
    assert FrameSource.of(frame_id, camera) == source


def frame(number, frame_id="pi0", hardware_id="a"):
    return Frame((number, 0), frame_id, hardware_id, 2.0, "")


def log_of(*frames, **sources):
    log = FrameLog()
    for driver, source in sources.items():
        log.expect(driver, source)
    for each in frames:
        log.add(each)
    return log


def test_the_newest_frames_not_before_a_time():
    log = log_of(*map(frame, range(1, 7)), frame(9, "pi1"), cam=FrameSource("pi0"))
    assert [each.stamp[0] for each in log.frames_of("cam", (0, 0))] == [4, 5, 6]
    assert [each.stamp[0] for each in log.frames_of("cam", (5, 0))] == [5, 6]
    assert log.frames_of("cam", (6, 1)) == ()
    assert log.frames_of("unknown", (0, 0)) == ()


def test_a_sensor_by_its_name_is_told_from_another_of_the_same_frame_id():
    log = log_of(frame(1, hardware_id="a"), frame(2, hardware_id="b"), cam=FrameSource("pi0", "a"))
    assert [each.hardware_id for each in log.frames_of("cam", (0, 0))] == ["a"]


@pytest.mark.parametrize(
    ("frames", "sources"),
    [
        ([frame(1, hardware_id="a"), frame(2, hardware_id="b")], {"cam": FrameSource("pi0")}),
        ([frame(1)], {"cam": FrameSource("pi0"), "other": FrameSource("pi0")}),
        ([frame(1)], {"cam": FrameSource("pi0", "a"), "other": FrameSource("pi0")}),
        ([frame(1)], {"cam": FrameSource("pi0", "a"), "other": FrameSource("pi0", "a")}),
    ],
)
def test_frames_that_may_be_of_several_are_nobodys(frames, sources):
    with pytest.raises(InputError, match="a frame_id of its own for each camera driver, got 'pi0'"):
        log_of(*frames, **sources).frames_of("cam", (0, 0))


def test_a_sensor_that_sent_its_last_frame_long_ago_confuses_nobody():
    log = log_of(frame(1, hardware_id="old"), frame(5, hardware_id="new"), cam=FrameSource("pi0"))
    assert [each.hardware_id for each in log.frames_of("cam", (2, 0))] == ["new"]


def test_a_driver_that_restarts_under_another_name():
    log = log_of(frame(1), cam=FrameSource("pi0"))
    log.expect("cam", FrameSource("pi7"))
    log.add(frame(2, "pi7"))
    assert [each.frame_id for each in log.frames_of("cam", (0, 0))] == ["pi7"]
    log.expect("cam", None)
    assert log.frames_of("cam", (0, 0)) == ()


def test_frames_of_strangers_take_no_memory():
    log = log_of(*(frame(number, f"stranger {number}") for number in range(99)))
    assert not log._newest


def test_the_name_that_all_have_by_default():
    log = log_of(cam=FrameSource("camera"), other=FrameSource("pi0"))
    assert [log.is_unnamed(name) for name in ("cam", "other", "unknown")] == [True, False, False]
