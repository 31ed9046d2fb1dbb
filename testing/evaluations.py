# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Tiny subjects of evaluations, what experiments find of them, and what they write of it."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from focus_planner import Mesh, cylinder_rig
from focus_planner.evaluation.experiment import Conditions, Results
from focus_planner.evaluation.subject import Subject
from testing.problems import box, sphere, with_threads

CONDITIONS = Conditions(samples=150, judged=400, seed=3)
RIG = cylinder_rig(2, 6, 0.75, 0.2, 0.6)


def subjects(rig=RIG):
    """Return a ball and a box before a small cylinder, by their names."""
    surfaces = {
        "ball": sphere(0.3, (0.0, 0.0, 0.4)),
        "box": box((0.5, 0.2, 0.7), (0.0, 0.0, 0.4)),
    }
    return {name: Subject(name, surface, rig) for name, surface in surfaces.items()}


def ellipsoids(rig=RIG, count=2):
    """Return ellipsoids before a small cylinder, by their names: each flatter than the next."""
    ball, by_name = sphere(1.0), {}
    for number in range(count):
        axes = np.array([0.25, 0.12 + 0.02 * number, 0.3])
        surface = Mesh(ball.vertices * axes + [0.0, 0.0, 0.4], ball.triangles)
        name = f"body_{number}"
        by_name[name] = Subject(name, surface, rig)
    return by_name


def run(experiment, by_name, conditions=CONDITIONS, wanted=lambda _: True):
    """Return the results of an experiment's tasks; of those with a ``wanted`` setting only."""
    rows, seconds = [], []
    for task in experiment.tasks(list(by_name), conditions):
        if wanted(task.setting):
            taken = [by_name[name] for name in task.subjects]
            measured = experiment.measure(taken, task.setting, conditions)
            first = {"subject": "+".join(task.subjects), **task.setting}
            assert all(not first.keys() & row.keys() for row in measured.rows)
            rows += [first | row for row in measured.rows]
            seconds.append(first | measured.seconds | {"task_seconds": 1.0})
    return made_up(rows, seconds, conditions)


def made_up(rows, seconds=(), conditions=CONDITIONS):
    return Results(pd.DataFrame(list(rows)), pd.DataFrame(list(seconds)), conditions)


def written(experiment, results):
    """The text of its write-up, drawn too."""
    write_up = experiment.write_up(results)
    figure = Figure(figsize=(8, 4.5))
    write_up.draw(figure)
    figure.draw_without_rendering()
    assert figure.axes[0].get_ylabel() or figure.get_supylabel()
    assert "nan" not in write_up.text
    return write_up.text


def assert_same_for_any_threads(experiment, wanted=lambda _: True):
    """The same rows, bit for bit, whether kernels run in one thread or in two."""
    one, two = (
        with_threads(count, lambda: run(experiment, subjects(), wanted=wanted).rows)
        for count in (1, 2)
    )
    pd.testing.assert_frame_equal(one, two, check_exact=True)
