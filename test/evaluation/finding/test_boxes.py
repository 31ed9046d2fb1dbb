# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Reading many surfaces, by one process or by several."""

from __future__ import annotations

from contextlib import closing

import numpy as np
import pytest

from focus_planner.evaluation.finding.boxes import read_boxes
from testing.data_sets import person


@pytest.fixture
def paths(tmp_path):
    """Return the files of three persons, of which one is broken."""
    found = [tmp_path / f"{number}.ply" for number in range(3)]
    for number, path in enumerate(found):
        person(1.5 + number / 10).export(path)
    found[1].write_bytes(found[1].read_bytes()[:-9])
    return found


def check(boxes):
    first, broken, last = boxes
    np.testing.assert_allclose([np.ptp(box, axis=0)[2] for box in (first, last)], [1.5, 1.7])
    assert broken.startswith("expected a complete")


def test_one_process_reads_boxes(paths):
    check(read_boxes(paths))


@pytest.mark.processes
def test_several_processes_read_the_same_boxes(paths):
    check(read_boxes(paths, 2, worth_it=0))


@pytest.mark.processes
def test_whoever_waits_may_stop(paths):
    with closing(read_boxes(paths * 50, 2, worth_it=0)) as boxes:
        next(boxes)
