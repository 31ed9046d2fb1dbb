# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Doing jobs in this process, one after the other."""

from __future__ import annotations

from collections.abc import Iterator

from focus_planner.evaluation.running.running import Batch
from focus_planner.evaluation.running.window import Window
from focus_planner.evaluation.running.work import Assignment, Failed, measured, packed, unpacked
from focus_planner.evaluation.subject import Subject


class Here:
    """One job at a time; its kernels may use all cores."""

    count = 1

    def work(self, assignment: Assignment) -> Iterator[Batch]:
        """Do jobs; yield each."""
        window = Window(assignment.jobs)
        subjects: dict[str, Subject | Failed] = {}
        while (job := window.next(0)) is not None:
            for name in job.task.subjects:
                if name not in subjects:
                    subjects[name] = unpacked(packed(assignment.sources[name]))
            given = [subjects[name] for name in job.task.subjects]
            what = measured(assignment.measure, job.task.setting, assignment.conditions, given)
            for name in window.take_back(job):
                del subjects[name]
            yield [(job, what)]
