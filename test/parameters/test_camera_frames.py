# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Which frames and topics parameters name."""

from __future__ import annotations

import pytest

from focus_planner.core.validation import InputError
from focus_planner.parameters.camera_frames import CameraFrames
from focus_planner.parameters.planner_settings import Settings


def test_names_and_patterns_are_told_apart():
    wanted = CameraFrames.from_values(" /left cam*_optical_frame left ", "", "")
    assert wanted.names == ("left",)
    assert wanted.patterns == ("cam*_optical_frame",)
    assert wanted.has("left")
    assert wanted.has("cam7_optical_frame")
    assert not wanted.has("cam7_link")
    assert Settings.from_values({}).camera_frames.frames == ()


@pytest.mark.parametrize(
    ("topics", "topic", "camera"),
    [
        ("", "/any/camera_info", ""),
        ("/cam*/info", "/cam1/info", ""),
        ("/cam*/info", "/eye/info", None),
        ("/{camera}/camera_info", "/cam1/camera_info", "cam1"),
        ("/{camera}/camera_info", "/rig/cam1/camera_info", None),
        ("/*/{camera}/camera_info", "/rig/cam1/camera_info", "cam1"),
        ("/a.b/info /left", "/left", ""),
        ("/a.b/info", "/aXb/info", None),
    ],
)
def test_topics_may_name_cameras(topics, topic, camera):
    assert CameraFrames.from_values("cam*", "", topics).camera_of(topic) == camera


@pytest.mark.parametrize("given", ["a,b", "a, b", "[a, b]", "cam[0-3], b", "/a/info,/b/info"])
def test_commas_are_refused(given):
    telling = "expected names or patterns, separated by spaces, got .*; leave out commas"
    with pytest.raises(InputError, match=f"camera_frames: {telling}"):
        CameraFrames.from_values(given, "", "")
    with pytest.raises(InputError, match=f"camera_info_topics: {telling}"):
        CameraFrames.from_values("cam*", "", given)


def test_a_comma_may_be_in_a_set():
    assert CameraFrames.from_values("cam[0,2]_x b", "", "").has("cam2_x")


def test_an_unknown_convention_is_refused():
    with pytest.raises(InputError, match="camera_convention: expected one of optical, body"):
        Settings.from_values({"camera_convention": "opengl"})
