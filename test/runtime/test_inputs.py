# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The reported state of an input; how messages are handled is in test_planner."""

from __future__ import annotations

from datetime import datetime, timedelta, timezone

import pytest

from focus_planner.core.validation import InputError
from focus_planner.messages.reading import Optics
from focus_planner.messages.typestore import CLOUD, MESH, POSES, RIG, serialize
from focus_planner.runtime.inputs import Arrival, InputSlot, InputState
from testing.messages import Log

AT = datetime(2025, 1, 1, 10, 0, 0, tzinfo=timezone.utc)
BAD = InputError("rig", "a good one", "a bad one")


def header(seconds, nanoseconds):
    return {"header": {"frame_id": "world", "stamp": {"sec": seconds, "nanosec": nanoseconds}}}


def arrival(content="one", seconds=0, topic="/planner/rig", kind=RIG, payload=None):
    def read(_):
        if isinstance(content, Exception):
            raise content
        return content

    payload = serialize(RIG, header(5 + seconds, 6)) if payload is None else payload
    return Arrival(topic, kind, payload, read, AT + timedelta(seconds=seconds))


@pytest.fixture
def rig():
    return InputSlot("rig", "a rig on ~/rig", lambda content: content, Log())


def digested(slot, *arrivals):
    """Receive messages, and put the newest good one in force as the planner does."""
    for each in arrivals:
        slot.receive(each)
    accepted = slot.newest(Optics())
    if accepted is not None:
        slot.put_in_force(accepted)
    return slot.state


@pytest.mark.parametrize("kind", [CLOUD, POSES, RIG])
def test_the_stamp_is_the_headers(kind):
    payload = serialize(kind, header(1_700_000_000, 999_999_999))
    assert arrival(kind=kind, payload=payload).stamp == (1_700_000_000, 999_999_999)
    swapped = b"\x00\x00\x00\x00" + bytes.fromhex("0000000500000006")
    assert arrival(kind=kind, payload=swapped).stamp == (5, 6)


def test_a_mesh_has_no_stamp():
    payload = serialize(MESH, {})
    assert arrival(kind=MESH, payload=payload + b"\1" * 8).stamp == (0, 0)


@pytest.mark.parametrize("payload", [b"", b"\0\1\0\0", b"\0\1\0\0\1\1\1", b"\7\7\0\0" + b"\1" * 8])
def test_broken_bytes_have_no_stamp(payload):
    assert arrival(payload=payload).stamp == (0, 0)


def test_at_first_there_is_nothing(rig):
    assert rig.state == InputState("rig")


def test_the_state_is_of_the_input_in_force(rig):
    assert digested(rig, arrival()) == InputState("rig", "/planner/rig", AT, (5, 6))
    state = digested(rig, arrival("other", 3, "/planner/camera_poses"))
    later = AT + timedelta(seconds=3)
    assert state == InputState("rig", "/planner/camera_poses", later, (8, 6))


def test_a_refusal_is_reported_until_a_valid_input_arrives(rig):
    assert digested(rig, arrival(BAD)) == InputState("rig", refused=str(BAD))
    assert digested(rig, arrival("one", 1)).refused == ""
    state = digested(rig, arrival(BAD, 2))
    assert state == InputState("rig", "/planner/rig", AT + timedelta(seconds=1), (6, 6), str(BAD))
    rig.objection()
    assert rig.state == state
    assert digested(rig, arrival("other", 3)).refused == ""


def test_a_repeated_message_renews_the_age(rig):
    digested(rig, arrival())
    payload = serialize(RIG, header(5, 6))
    state = digested(rig, arrival(seconds=9, payload=payload))
    assert state.received == AT + timedelta(seconds=9)
