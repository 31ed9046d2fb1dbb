# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Gains of several views against sums by hand."""

import numpy as np

from focus_planner.core.problem.gains import gains_of
from testing.problems import tiny_problem
from testing.several_views import choices, plan_units, tiny_problem_in_views


def gain_of(problem, gains, cell):
    """What a choice of cells gains: of each sample the largest gains of different views."""
    seen = [{} for _ in gains.most]
    for c in range(gains.camera_count):
        for pairs, in_focus in ((gains.blurred, False), (gains.by_camera, True)):
            for j in range(pairs.offsets[c], pairs.offsets[c + 1]):
                if not in_focus or pairs.first[j] <= cell[c] <= pairs.last[j]:
                    views = seen[pairs.sample[j]]
                    view = c // problem.shots
                    views[view] = max(views.get(view, 0), int(pairs.gain[j]))
    total = 0
    for p, views in enumerate(seen):
        some = list(views.values())
        # Out of focus in cameras that cannot focus on it: told by sample only.
        part = slice(gains.blurred_views.offsets[p], gains.blurred_views.offsets[p + 1])
        by_sample = sorted(gains.blurred_views.gain[part].tolist())
        of_cameras = {
            c // problem.shots: int(gains.blurred.gain[j])
            for c in range(gains.camera_count)
            for j in range(gains.blurred.offsets[c], gains.blurred.offsets[c + 1])
            if gains.blurred.sample[j] == p
        }
        for gain in of_cameras.values():
            by_sample.remove(gain)
        total += sum(sorted(some + by_sample)[-problem.views :])
    return total


def test_a_plan_costs_what_is_without_gain_less_what_its_views_gain():
    blurred = blind = 0
    for seed in range(250):
        problem, random = tiny_problem_in_views(seed), np.random.default_rng(seed)
        gains = gains_of(problem)
        every = list(choices(problem))
        for k in random.integers(0, len(every), 3):
            cost = plan_units(problem, every[k])
            assert gains.out - gain_of(problem, gains, every[k]) == cost
            assert gains.out - gains.in_focus <= cost
        assert (np.diff(gains.blurred_views.offsets) < problem.views).all()
        assert gains.shots == (problem.shots if problem.views > 1 else 1)
        blurred += len(gains.blurred.gain) > 0
        blind += len(gains.blurred_views.gain) * gains.shots > len(gains.blurred.gain)
    assert blurred > 50
    assert blind > 10


def test_no_gain_is_larger_than_the_most():
    for seed in range(100):
        gains = gains_of(tiny_problem_in_views(seed))
        most = np.zeros_like(gains.most)
        np.maximum.at(most, gains.sample, gains.gain)
        samples = np.repeat(np.arange(len(most)), np.diff(gains.blurred_views.offsets))
        np.maximum.at(most, samples, gains.blurred_views.gain)
        np.testing.assert_array_equal(gains.most, most)


def test_with_one_view_nothing_gains_out_of_focus():
    for seed in range(200):
        gains = gains_of(tiny_problem(seed))
        assert gains.views == gains.shots == 1
        assert len(gains.blurred.gain) == len(gains.blurred_views.gain) == 0
        assert gains.in_focus == gains.most.sum()
