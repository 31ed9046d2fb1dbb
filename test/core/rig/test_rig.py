# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

import pytest

from focus_planner import (
    Grid,
    InputError,
    Rig,
)
from testing.problems import camera


def test_a_rig_needs_cameras_of_different_names_that_fit_its_grid():
    with pytest.raises(InputError, match="rig: expected at least one camera, got none"):
        Rig(())
    with pytest.raises(InputError, match="rig: expected unique camera names, got 'b' 2 times"):
        Rig((camera("a"), camera("b"), camera("b")))
    with pytest.raises(
        InputError, match=r"rig.grid: expected rows × columns = 2, the number of .*, got 2 × 3"
    ):
        Rig((camera("a"), camera("b")), grid=Grid(2, 3))
    assert len(Rig((camera("a"), camera("b")), grid=Grid(1, 2))) == 2
    assert Rig((camera(),)).frame_id == "world"


@pytest.mark.parametrize("values", [{"rows": 0, "columns": 1}, {"rows": 1, "columns": 0}])
def test_a_grid_has_rows_and_columns(values):
    with pytest.raises(InputError, match="expected a whole number of at least 1, got 0"):
        Grid(**values)
