# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from focus_planner.evaluation.results.cells import text_of, value_of


@given(st.one_of(st.booleans(), st.integers(), st.floats(allow_nan=False)))
def test_numbers_are_read_as_they_were(value):
    read = value_of(text_of(value))
    assert read == value
    assert type(read) is type(value)
    assert math.copysign(1, read) == math.copysign(1, value)


@pytest.mark.parametrize("value", [np.float64(0.1), np.int32(3), np.bool_(True)])
def test_numbers_of_numpy_are_plain_ones(value):
    read = value_of(text_of(value))
    assert read == value
    assert type(read) in {float, int, bool}


def test_what_is_no_number_is_one():
    assert math.isnan(value_of(text_of(math.nan)))


@pytest.mark.parametrize("text", ["", "closest", "w₃ = 0", "a,b", '"', "1e", "1_000", " 1", "true"])
def test_strings_are_read_as_they_were(text):
    assert value_of(text_of(text)) == text


@pytest.mark.parametrize("text", ["1", "-2.5", "1e-05", "nan", "-inf", "True", "a\nb", "a\r"])
def test_strings_that_would_be_read_as_something_else_are_refused(text):
    with pytest.raises(ValueError, match="cannot be told from"):
        text_of(text)
