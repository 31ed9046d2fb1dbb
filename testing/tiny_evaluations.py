# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.
"""Two tiny subjects, what experiments find of them, and what they write of it."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from focus_planner import Mesh, cylinder_rig
from focus_planner.evaluation.experiment import Conditions, Results
from focus_planner.evaluation.subject import Subject
from testing.problems import sphere, with_threads

TINY = Conditions(samples=120, judged=300, seed=3)


def small_rig():
    return cylinder_rig(2, 6, radius=0.7, bottom=-0.1, top=0.1)


def tiny_subjects(rig=None, count=2):
    """Ellipsoids before a rig, by default a grid of 2 × 6 cameras, by name."""
    ball, subjects = sphere(1.0), {}
    for number in range(count):
        axes = np.array([0.25, 0.12 + 0.02 * number, 0.3])
        name = f"body_{number}"
        surface = Mesh(ball.vertices * axes, ball.triangles)
        subjects[name] = Subject(name, surface, rig or small_rig())
    return subjects


def results_of(experiment, subjects, conditions=TINY, wanted=lambda _: True):
    """What the experiment finds, task after task; of those with a ``wanted`` setting only."""
    rows = []
    for task in experiment.tasks(list(subjects), conditions):
        if wanted(task.setting):
            given = [subjects[name] for name in task.subjects]
            measured = experiment.measure(given, task.setting, conditions)
            first = {"subject": "+".join(task.subjects), **task.setting}
            assert all(not first.keys() & row.keys() for row in measured.rows)
            rows += [first | row for row in measured.rows]
    return made_up(rows, conditions)


def made_up(rows, conditions=TINY):
    return Results(pd.DataFrame(list(rows)), pd.DataFrame(), conditions)


def written(experiment, results):
    """The text of its write-up; the plot is drawn too."""
    write_up = experiment.write_up(results)
    figure = Figure(figsize=(8, 4.5))
    write_up.draw(figure)
    figure.draw_without_rendering()
    assert "nan" not in write_up.text
    return write_up.text


def assert_same_for_any_threads(experiment, wanted=lambda _: True):
    """The same rows, bit for bit, whether kernels run in one thread or in two."""
    one, two = (
        with_threads(count, lambda: results_of(experiment, tiny_subjects(), wanted=wanted).rows)
        for count in (1, 2)
    )
    pd.testing.assert_frame_equal(one, two, check_exact=True)
