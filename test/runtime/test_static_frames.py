# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What is kept of static transforms, whoever publishes them."""

from __future__ import annotations

import math

import pytest

from focus_planner.messages.frames import StaticTransform
from focus_planner.messages.limits import MAX_TRANSFORM_BYTES
from focus_planner.messages.transforms import transforms_to_bytes
from focus_planner.runtime import static_frames
from focus_planner.runtime.static_frames import StaticFrames
from testing.messages import Log

STILL = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)


def of(parent, child, translation=STILL[0], rotation=STILL[1]):
    return StaticTransform(parent, child, translation, rotation)


@pytest.fixture
def log():
    return Log()


@pytest.fixture
def frames(log):
    return StaticFrames(log)


def heard(frames, *transforms):
    return frames.receive(transforms_to_bytes(transforms))


def test_each_publisher_adds_its_own(frames):
    assert heard(frames, of("world", "rig"))
    assert heard(frames, of("rig", "cam0"), of("rig", "cam1"))
    assert frames.heard.names == ("world", "rig", "cam0", "cam1")


def test_what_is_repeated_is_nothing_new(frames):
    assert heard(frames, of("world", "rig"))
    before = frames.heard
    assert not heard(frames, of("world", "rig"))
    assert not heard(frames, of("/world", "/rig"))
    assert frames.heard is before


def test_the_newest_counts_also_with_another_parent(frames):
    heard(frames, of("world", "cam"))
    assert heard(frames, of("world", "cam", (1.0, 0.0, 0.0)))
    assert heard(frames, of("arm", "cam"))
    assert frames.heard.transforms == (of("arm", "cam"),)


@pytest.mark.parametrize(
    ("bad", "told"),
    [
        (of("cam", "cam"), "frame cam: expected a parent that is not below it, got 'cam'"),
        (of("cam", "world"), "frame world: expected a parent that is not below it, got 'cam'"),
        (of("", "cam"), "transform frame_id: expected the name of a frame"),
        (of("world", "/"), "transform child_frame_id: expected the name of a frame"),
        (of("world", "c" * 300), "expected at most 255 characters, got 300"),
        (of("world", "cam", (math.nan, 0.0, 0.0)), "translation: expected finite"),
        (of("world", "cam", (math.inf, 0.0, 0.0)), "translation: expected finite"),
        (of("world", "cam", rotation=(0.0,) * 4), "expected a unit quaternion x, y, z, w"),
        (of("world", "cam", rotation=(0.0, 0.0, 0.0, 2.0)), "expected a unit quaternion"),
    ],
)
def test_what_is_not_valid_costs_nothing_but_itself(frames, log, bad, told):
    heard(frames, of("world", "rig"), of("rig", "cam"))
    before = frames.heard.transforms
    assert heard(frames, bad, of("rig", "other"))
    assert frames.heard.transforms == (*before, of("rig", "other"))
    (warning,) = log.warnings
    assert warning.startswith("refused from /tf_static: ")
    assert told in warning


def test_bytes_of_something_else_are_refused(frames, log):
    assert not frames.receive(b"\x00\x01\x00\x00" + b"\xff" * 50)
    assert not frames.receive(bytes(MAX_TRANSFORM_BYTES + 1))
    assert len(log.warnings) == 2


def test_frames_are_limited_in_number_and_in_depth(frames, log, monkeypatch):
    monkeypatch.setattr(static_frames, "MAX_TRANSFORMS", 150)
    heard(frames, *(of(f"f{i}", f"f{i + 1}") for i in range(120)))
    asked = {of(f"f{i}", f"f{i + 1}") for i in range(120)}
    (missing,) = asked.difference(frames.heard.transforms)
    assert missing.child == "f101"
    assert "at most 100 frames above it" in log.warnings[0]
    heard(frames, *(of("f0", f"g{i}") for i in range(60)))
    assert len(frames.heard.transforms) == 150
    assert heard(frames, of("f0", "f1", (1.0, 0.0, 0.0)))
