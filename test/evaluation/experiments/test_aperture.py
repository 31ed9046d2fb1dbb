# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.
import re
from dataclasses import replace

import numpy as np
import pytest

from focus_planner import InputError, Lens, cylinder_rig
from focus_planner.core.rig.optics import depth_of_field, hyperfocal_distance
from focus_planner.evaluation.experiments.aperture import EXPERIMENT
from testing.evaluations import (
    CONDITIONS,
    assert_same_for_any_threads,
    ellipsoids,
    made_up,
    run,
    written,
)

CIRCLE = 29.3e-6
METHODS = ("closest", "EM", "2-view, all samples")
F_NUMBERS = (2.8, 4, 5.6, 8, 11, 16, 22)


def given_circle(circle):
    rig = cylinder_rig(2, 6, radius=0.7, bottom=-0.1, top=0.1)
    lens = Lens(circle_of_confusion=circle)
    return replace(rig, cameras=tuple(replace(each, lens=lens) for each in rig.cameras))


def blur(depth, focus, f_number, wavelength):
    """Diameter on the sensor, by the textbook: defocus and the Airy disc in quadrature."""
    magnification = 0.05 / (focus - 0.05)
    defocus = (0.05 / f_number) * 0.05 * np.abs(depth - focus) / (depth * (focus - 0.05))
    return np.hypot(defocus, 2.44 * wavelength * f_number * (1 + magnification))


@pytest.mark.parametrize(
    ("name", "wavelength"), [("defocus alone", 0.0), ("with diffraction", 550e-9)]
)
def test_what_closest_holds_is_what_the_textbook_says(name, wavelength):
    (subject,) = ellipsoids(given_circle(CIRCLE), count=1).values()
    rows = run(EXPERIMENT, {"body_0": subject}).rows
    problem, fresh = subject.problem(CONDITIONS), subject.fresh_problem(CONDITIONS)
    focus = np.full(problem.camera_count, np.inf)
    np.minimum.at(focus, problem.camera_index, problem.depth)
    for f_number in F_NUMBERS:
        at = focus[fresh.camera_index]
        sharp = blur(fresh.depth, at, f_number, wavelength) <= CIRCLE
        if wavelength == 0:
            near, far = depth_of_field(at, Lens(0.05, hyperfocal_distance(0.05, f_number, CIRCLE)))
            assert ((near <= fresh.depth) & (fresh.depth <= far) == sharp).all()
        held, cost = np.zeros(fresh.sample_count), np.ones(fresh.sample_count)
        for pair in range(len(sharp)):
            p = fresh.sample_index[pair]
            of_pair = fresh.base_cost[pair] + (0 if sharp[pair] else 1 / 3)
            if of_pair < cost[p]:
                cost[p], held[p] = of_pair, sharp[pair]
        row = rows[
            (rows.f_number == f_number) & (rows.blur == name) & (rows.method == "closest")
        ].iloc[0]
        assert row.in_focus == pytest.approx(held.mean())
        assert row.fresh_cost == pytest.approx(1000 * cost.mean())
        assert row.circle_of_confusion == pytest.approx(CIRCLE)


def test_nothing_is_sharp_once_the_airy_disc_is_too_wide():
    results = run(EXPERIMENT, ellipsoids())
    both = results.rows[results.rows.blur == "with diffraction"]
    assert (both[both.f_number == 22].in_focus == 0).all()
    assert (both[both.f_number == 22].airy_diameter > 29.3e-6).all()
    assert (both[both.f_number == 11].in_focus > 0).all()
    assert "at f/22 the Airy disc alone is wider" in written(EXPERIMENT, results)


def test_rows_do_not_depend_on_threads():
    assert_same_for_any_threads(EXPERIMENT)


def test_a_circle_that_no_lens_has_is_refused():
    (subject,) = ellipsoids(count=1).values()
    lens = Lens(0.002, 1.0, circle_of_confusion=9e-4)
    cameras = tuple(replace(each, lens=lens) for each in subject.rig.cameras)
    with pytest.raises(InputError, match="circle of confusion is probably too large"):
        EXPERIMENT.measure(
            [subject.with_rig(replace(subject.rig, cameras=cameras))], {}, CONDITIONS
        )


def rows(planned, autofocus, subjects=("a",)):
    for subject in subjects:
        for i, f_number in enumerate(F_NUMBERS):
            for name in ("defocus alone", "with diffraction"):
                for method in METHODS:
                    yield {
                        "subject": subject,
                        "f_number": f_number,
                        "blur": name,
                        "circle_of_confusion": 30e-6,
                        "airy_diameter": 1e-6 * f_number,
                        "focus_range": 0.05,
                        "method": method,
                        "fresh_cost": 300.0,
                        "in_focus": autofocus[i] if method == "closest" else planned[i],
                    }


def test_the_best_apertures_are_written():
    planned = (0.4, 0.6, 0.7, 0.8, 0.9, 0.85, 0.5)
    text = written(EXPERIMENT, made_up(rows(planned, (0.1, 0.2, 0.3, 0.4, 0.5, 0.55, 0.45))))
    assert "Plans for 1 subject, " in text
    assert "confusion, 30.0 µm" in text
    assert re.search(r"Autofocus \(\*closest\*\) holds most at f/16: 55\.0 %", text)
    assert "2-view, all samples holds most at f/11: 90.0 %" in text
    assert "Planned by 2-view, f/4 already holds 60.0 %" in text
    assert "nothing counts as sharp" not in text
    assert "| f/4 | 4.0 | 50 | 20.0 % (20.0 %) | 60.0 % (60.0 %) |" in text


def test_planning_that_gains_nothing_is_not_praised():
    text = written(EXPERIMENT, made_up(rows([0.4] * 7, [0.5] * 7, ("a", "b"))))
    assert "Plans for 2 subjects, " in text
    assert "2-view nowhere holds more than that" in text
