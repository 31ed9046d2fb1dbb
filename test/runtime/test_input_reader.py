# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Reading messages as inputs, in whichever process."""

from __future__ import annotations

import pickle
from dataclasses import replace
from functools import partial

import pytest

from focus_planner.core.rig.layouts import cylinder_rig
from focus_planner.core.rig.rig import Rig
from focus_planner.core.validation import InputError
from focus_planner.messages.limits import Limits
from focus_planner.messages.reading import Optics
from focus_planner.messages.typestore import RIG, serialize
from focus_planner.messages.writing import rig_to_fields
from focus_planner.runtime.input_reader import InputReader

RIG_OF_CAMERAS = cylinder_rig(rows=2, columns=6, radius=1.0)
READER = InputReader("world", "importance", Limits(), longest_name=20)


def named(name):
    cameras = (replace(RIG_OF_CAMERAS.cameras[0], name=name), *RIG_OF_CAMERAS.cameras[1:])
    return serialize(RIG, rig_to_fields(Rig(cameras)))


def test_a_name_too_long_for_a_topic_is_refused():
    assert READER.rig(named("a" * 20), Optics()).cameras[0].name == "a" * 20
    with pytest.raises(InputError, match=r"^camera name: expected at most 20 characters, so that"):
        READER.rig(named("a" * 21), Optics())


def test_what_reads_a_message_can_be_sent_to_another_process():
    read = pickle.loads(pickle.dumps(partial(InputReader.rig, READER, named("a"))))
    assert read(Optics()).cameras[0].name == "a"
