# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Tiny subjects of evaluations, and experiments run on them."""

from __future__ import annotations

import pandas as pd

from focus_planner import cylinder_rig
from focus_planner.evaluation.experiment import Conditions, Results
from focus_planner.evaluation.subject import Subject
from testing.problems import box, sphere

CONDITIONS = Conditions(samples=150, judged=400, seed=3)
RIG = cylinder_rig(2, 6, 0.75, 0.2, 0.6)


def subjects(rig=RIG):
    """Return a ball and a box before a small cylinder, by their names."""
    surfaces = {
        "ball": sphere(0.3, (0.0, 0.0, 0.4)),
        "box": box((0.5, 0.2, 0.7), (0.0, 0.0, 0.4)),
    }
    return {name: Subject(name, surface, rig) for name, surface in surfaces.items()}


def run(experiment, by_name, conditions=CONDITIONS, wanted=lambda _: True):
    """Return the results of an experiment's tasks; of those with a ``wanted`` setting only."""
    rows, seconds = [], []
    for task in experiment.tasks(list(by_name), conditions):
        if wanted(task.setting):
            taken = [by_name[name] for name in task.subjects]
            measured = experiment.measure(taken, task.setting, conditions)
            first = {"subject": "+".join(task.subjects), **task.setting}
            rows += [first | row for row in measured.rows]
            seconds.append(first | measured.seconds | {"task_seconds": 1.0})
    return Results(pd.DataFrame(rows), pd.DataFrame(seconds), conditions)
