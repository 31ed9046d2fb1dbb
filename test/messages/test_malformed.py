# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Fuzz: whatever bytes come, the node says what is wrong and goes on with what it has."""

from __future__ import annotations

import time
from contextlib import suppress
from datetime import timedelta

import numpy as np
import pytest

from focus_planner.core.rig.rig import MAX_CAMERAS
from focus_planner.core.validation import InputError
from focus_planner.messages.typestore import serialize
from testing.malformed import READ, TYPES, Bench, absurd, broken, good

MESSAGES = 200
# Of a processor, a hundred times what it takes; what else the machine does is not counted.
SECONDS = 5.0


@pytest.fixture
def bench():
    return Bench()


def check_goes_on(bench, expected, before):
    """What came is refused, and what was in force stays; or it can be planned with, or not."""
    if bench.in_force == before:
        return False
    with suppress(InputError):
        assert bench.plan().cost >= 0
    bench.put_good()
    assert bench.plan().cameras == expected.cameras
    return True


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("make", [absurd, broken])
@pytest.mark.parametrize("topic", list(READ))
def test_whatever_comes_the_planner_goes_on(bench, topic, make):
    expected, accepted = bench.plan(), 0
    for seed in range(MESSAGES):
        before, started = bench.in_force, time.thread_time()
        bench.offer(topic, make(topic, np.random.default_rng(seed)))
        assert time.thread_time() - started < SECONDS
        assert bench.log.errors == [], seed
        accepted += check_goes_on(bench, expected, before)
    assert bench.plan().cameras == expected.cameras
    assert accepted < MESSAGES / 2
    assert not any("internal error" in text or len(text) > 1000 for text in bench.log.warnings)


@pytest.mark.parametrize("topic", list(READ))
def test_a_good_message_is_good(bench, topic):
    bench.offer(topic, good(topic))
    assert bench.plan().cost > 0
    assert bench.log.warnings == []


@pytest.mark.parametrize("topic", ["rig", "camera_poses"])
def test_a_rig_of_too_many_cameras_is_not_even_read(bench, topic):
    name = "cameras" if topic == "rig" else "poses"
    payload = serialize(TYPES[topic], {"header": {"frame_id": "world"}, name: [{}]})
    count = payload.index((1).to_bytes(4, "little"), 16)
    many = payload[:count] + MAX_CAMERAS.to_bytes(4, "little") + payload[count + 4 :] * 1000
    before, started = bench.in_force, time.thread_time()
    for _ in range(100):
        bench.offer(topic, many)
    assert time.thread_time() - started < SECONDS
    assert bench.in_force == before
    assert "at most 20,000 cameras (parameter max_cameras), got 250,000" in bench.log.warnings[0]


def test_refusals_at_full_speed_are_few_lines(bench):
    for seed in range(300):
        bench.offer("mesh", b"\0\1\0\0" + bytes([seed % 256] * 9))
        bench.now += timedelta(milliseconds=3)
    assert len(bench.log.warnings) == 10
    bench.now += timedelta(seconds=1.1)
    bench.offer("mesh", b"")
    assert "(290 similar warnings suppressed)" in bench.log.warnings[-1]
