# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Several contexts in one process, as tests have them and our programs do not."""

from __future__ import annotations

import os

from rclpy.context import Context
from rclpy.node import Node

from testing.pages import ROOT

_PROFILE = ROOT / "docs" / "one_process.xml"


def end_deliveries_within_it() -> None:
    """Have Fast DDS carry what is sent within this process as it does between processes.

    It would deliver it by calls from participant to participant, which now and then deadlock when
    one of them is destroyed (eProsima/Fast-DDS#6193): a test then hangs where no signal reaches it.
    The profile is read with the first participant. Processes that tests start do not get it.
    """
    name = "FASTRTPS_DEFAULT_PROFILES_FILE"
    given = os.environ.get(name)
    os.environ[name] = str(_PROFILE)
    context = Context()
    context.init(args=[])
    Node("first", context=context, use_global_arguments=False).destroy_node()
    context.try_shutdown()
    del os.environ[name]
    if given is not None:
        os.environ[name] = given
