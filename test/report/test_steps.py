# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""The steps of a search, as they are done and as they were recorded."""

from __future__ import annotations

import math

from focus_planner.core.progress import Progress
from focus_planner.report.content import Step
from focus_planner.report.steps import StepCollector, steps_of

DONE = [Progress("fresh", 1, math.nan), Progress("em", 1, 310.0), Progress("prices", 1, 310.0, 2.0)]


def test_steps_are_collected_and_passed_on() -> None:
    seconds = iter([5.0, 5.25, 6.0, 8.0])
    passed: list[Progress] = []

    def on_progress(progress: Progress) -> bool:
        passed.append(progress)
        return progress.stage != "prices"

    collector = StepCollector(on_progress, lambda: next(seconds))
    assert [collector(each) for each in DONE] == [True, True, False]
    assert passed == DONE
    assert collector.elapsed == (0.25, 1.0, 3.0)
    assert collector.steps == (
        Step("fresh", 1, None, None, 0.25),
        Step("em", 1, 310.0, None, 1.0),
        Step("prices", 1, 310.0, 2.0, 3.0),
    )


def test_seconds_may_be_unknown() -> None:
    assert [step.elapsed for step in steps_of(DONE, [0.5])] == [0.5, None, None]
    assert steps_of([], []) == ()
