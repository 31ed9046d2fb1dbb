# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Parameters that nobody declares."""

from __future__ import annotations

import pytest

from focus_planner.parameters.lenses import ADAPTER_DECLARATIONS, SIMULATION_DECLARATIONS
from focus_planner.parameters.planner import DECLARATIONS
from focus_planner.parameters.unknown import meant_by


@pytest.mark.parametrize(
    ("given", "meant"),
    [
        ("metod", "method"),
        ("Method", "method"),
        ("time-budget", "time_budget"),
        ("sampels", "samples"),
        ("lens.f_nmber", "lens.f_number"),
        ("lens/f_number", "lens.f_number"),
        ("f_number", "lens.f_number"),
        ("fnumber", "lens.f_number"),
        ("record_dir", "record_directory"),
        ("max_trianges", "max_triangles"),
    ],
)
def test_a_slip_of_the_pen_is_told_what_was_meant(given: str, meant: str) -> None:
    assert list(meant_by([given, "samples"], DECLARATIONS)) == [(given, meant)]


@pytest.mark.parametrize(
    "given",
    [
        *("use_sim_time", "start_type_description_service"),
        "qos_overrides./focus_planner/mesh.subscription.durability",
        # Of the other nodes here, and of nodes that others have, in a file for all of them.
        *("cameras", "driver_node", "verify_timeout", "frame_rate"),
        *("base_frame", "robot_description", "video_device", "publish_rate", "bond_timeout"),
        "x" * 100_000,
    ],
)
def test_what_other_nodes_have_is_left_alone(given: str) -> None:
    assert list(meant_by([given], DECLARATIONS)) == []


def test_every_node_has_its_own() -> None:
    assert list(meant_by(["camera"], ADAPTER_DECLARATIONS)) == [("camera", "cameras")]
    assert list(meant_by(["failure-rate"], SIMULATION_DECLARATIONS)) == [
        ("failure-rate", "failure_rate")
    ]
    for declarations in (DECLARATIONS, ADAPTER_DECLARATIONS, SIMULATION_DECLARATIONS):
        assert list(meant_by([each.name for each in declarations], declarations)) == []
