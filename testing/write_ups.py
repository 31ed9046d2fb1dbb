# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What is written of experiments' results, and results made up for it."""

from __future__ import annotations

import pandas as pd
from matplotlib.figure import Figure

from focus_planner.evaluation.experiment import Results
from testing.evaluation_subjects import CONDITIONS, run, subjects
from testing.problems import with_threads


def made_up(rows, seconds=()):
    return Results(pd.DataFrame(rows), pd.DataFrame(seconds), CONDITIONS)


def written(experiment, results):
    """The text of its write-up, drawn too."""
    write_up = experiment.write_up(results)
    figure = Figure(figsize=(8, 4.5))
    write_up.draw(figure)
    figure.draw_without_rendering()
    assert all(axes.get_ylabel() for axes in figure.axes)
    assert "nan" not in write_up.text
    return write_up.text


def assert_same_for_any_threads(experiment, wanted=lambda _: True):
    """The same rows, bit for bit, whether kernels run in one thread or in two."""
    one, two = (
        with_threads(count, lambda: run(experiment, subjects(), wanted=wanted).rows)
        for count in (1, 2)
    )
    pd.testing.assert_frame_equal(one, two, check_exact=True)
