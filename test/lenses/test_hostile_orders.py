# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Random orders, nearly right or garbage: the lens stays where the last good one sent it."""

from __future__ import annotations

import asyncio
import math
import warnings

import numpy as np

from focus_planner.core.rig.lens_table import LensTable
from focus_planner.core.validation import InputError
from focus_planner.lenses.calls import Timeouts
from focus_planner.lenses.control import LensControl
from focus_planner.lenses.driver import LensStatus, report_to_fields
from focus_planner.lenses.orders import order_from_message
from focus_planner.lenses.profiles import PROFILES
from focus_planner.messages.typestore import LENS_STATE, ORDER, deserialize, serialize
from testing.hostile_lenses import orders
from testing.virtual_time import run_in_virtual_time

TABLE = LensTable("steps", whole=True, distances=(0.25, 1.0), values=(200.0, 50.0))
QUICK = Timeouts(timeout=0.05, verify_timeout=0.0, watch_period=0.0, shortest_pause=0.01)
GOOD = {
    "header": {"stamp": {"sec": 3, "nanosec": 4}},
    "name": "cam",
    "plan_id": "a plan",
    "status": 1,
    "focus_distance": 0.5,
    "dioptres": 2.0,
    "device_value": 100.0,
    "device_unit": "steps",
    "bracket": [0.5],
}


class Lens:
    """A driver that takes whatever it is told, and remembers it."""

    name = "/cam/v4l2_camera"

    def __init__(self):
        self.values = {"focus_absolute": 0, "focus_auto": True}
        self.moved_to = set()

    async def connect(self):
        pass

    def is_available(self):
        return True

    def strangeness(self):
        return ""

    async def list_parameters(self, names):
        return [name for name in names if name in self.values]

    async def set_parameters(self, values):
        self.values.update(values)
        self.moved_to.add(self.values["focus_absolute"])

    async def get_parameters(self, names):
        return {name: self.values.get(name) for name in names}


def test_no_order_moves_a_lens_but_as_its_table_says():
    lens, reports, refused = Lens(), [], 0
    random = np.random.default_rng(7)

    async def run():
        nonlocal refused
        control = LensControl(
            lens, PROFILES["v4l2_camera"], reports.append, lambda: (9, 0), QUICK, table=TABLE
        )
        for payload in orders(random, 600, GOOD):
            try:
                order = order_from_message(deserialize(ORDER, payload), "cam")
            except InputError:
                refused += 1
                continue
            before = control.plan_id
            control.apply(order)
            if control.plan_id != before:
                await asyncio.sleep(0.01)
        control.apply(order_from_message(deserialize(ORDER, serialize(ORDER, GOOD)), "cam"))
        await asyncio.sleep(1.0)
        control.stop()

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        run_in_virtual_time(run())
    assert 200 < refused < 600
    assert lens.values == {"focus_absolute": 100, "focus_auto": False}
    assert lens.moved_to <= set(range(50, 201))
    assert {each.status for each in reports} <= set(LensStatus)
    assert not [each for each in reports if "internal error" in each.message]
    for report in reports:
        state = deserialize(
            LENS_STATE, serialize(LENS_STATE, report_to_fields(report, "cam", (9, 0)))
        )
        assert len(state.message) < 500
        assert state.message.isprintable()
        assert math.isfinite(state.planned_distance) or report.refused
