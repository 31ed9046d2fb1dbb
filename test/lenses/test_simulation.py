# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

from __future__ import annotations

import math

import numpy as np
import pytest

from focus_planner.core.validation import InputError
from focus_planner.lenses.simulation import LensMechanics, MovingLens


def lens(position=0.0, stuck=False, **mechanics):
    return MovingLens(LensMechanics(0.0, 10.0, **mechanics), position, stuck)


def test_without_speed_or_latency_it_arrives_at_once():
    moving = lens()
    assert moving.position(0.0) == 0.0
    moving.command(4.0, 1.0)
    assert moving.position(1.0) == 4.0


def test_it_moves_at_its_speed_after_the_latency():
    moving = lens(position=1.0, speed=2.0, latency=0.5)
    moving.command(4.0, 10.0)
    assert moving.arrives() == 12.0
    positions = [moving.position(time) for time in (10.0, 10.5, 11.0, 11.5, 12.0, 99.0)]
    assert positions == [1.0, 1.0, 2.0, 3.0, 4.0, 4.0]
    moving.command(0.0, 100.0)
    assert moving.position(101.5) == 2.0


def test_a_lens_that_jumps_waits_for_the_latency():
    moving = lens(latency=0.5)
    moving.command(4.0, 10.0)
    assert [moving.position(time) for time in (10.0, 10.4, 10.5)] == [0.0, 0.0, 4.0]


def test_a_command_during_a_movement_starts_where_the_lens_is():
    moving = lens(speed=1.0)
    moving.command(9.0, 0.0)
    moving.command(1.0, 3.0)
    assert moving.position(4.0) == 2.0
    assert moving.position(9.0) == 1.0


def test_backlash_appears_after_moving_down_only():
    moving = lens(backlash=0.5)
    for command, position in [
        (4.0, 4.0),
        (3.0, 3.5),
        (2.8, 3.3),
        (3.0, 3.3),
        (3.2, 3.3),
        (5.0, 5.0),
    ]:
        moving.command(command, 0.0)
        assert moving.position(1.0) == pytest.approx(position)


def test_backlash_does_not_lead_beyond_the_travel():
    moving = lens(position=10.0, backlash=0.5)
    moving.command(9.8, 0.0)
    assert moving.position(0.0) == 10.0


def test_backlash_agrees_with_small_steps_of_a_lens_between_two_stops():
    """The motor has two stops, ``backlash`` apart, and the lens lies between them."""
    generator = np.random.default_rng(1)
    moving, motor, slow = lens(backlash=0.7), 0.0, 0.0
    for target in generator.uniform(0.0, 9.0, 30):
        moving.command(target, 0.0)
        for stop in np.linspace(motor, target, 200):
            slow = min(max(slow, stop), stop + 0.7)
        motor = target
        assert moving.position(0.0) == pytest.approx(slow)


def test_the_motor_takes_steps_from_the_low_end():
    mechanics = LensMechanics(1.0, 2.0, step=0.3)
    assert [mechanics.quantise(v) for v in (1.0, 1.14, 1.16, 1.9)] == pytest.approx(
        [1, 1, 1.3, 1.9]
    )
    assert mechanics.clamp(9.0) == 2.0
    assert LensMechanics(1.0, 2.0).quantise(1.14) == 1.14


def test_a_stuck_lens_does_not_move():
    moving = lens(position=3.0, stuck=True, speed=1.0, backlash=1.0)
    moving.command(9.0, 0.0)
    assert moving.position(100.0) == 3.0


@pytest.mark.parametrize(
    ("change", "error"),
    [
        ({"high": 0.0}, "high: expected a number above 0, got 0"),
        ({"speed": 0.0}, "speed: expected a number above 0, got 0"),
        ({"latency": -1.0}, "latency: expected a number of at least 0, got -1"),
        ({"backlash": math.nan}, "backlash: expected a number of at least 0, got nan"),
        ({"step": 11.0}, "step: expected less than the lens's travel, got 11"),
    ],
)
def test_impossible_mechanics(change, error):
    with pytest.raises(InputError) as raised:
        LensMechanics(**({"low": 0.0, "high": 10.0} | change))
    assert str(raised.value) == error
