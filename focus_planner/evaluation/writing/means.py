# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.
"""Means of results by several keys: what pandas returns of them, with its type."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, cast

if TYPE_CHECKING:
    from pandas import DataFrame, Series


def mean_row(mean: DataFrame, *keys: Any) -> Series[float]:
    """Return the row with these keys, one of each level of the index."""
    return cast("Series[float]", mean.loc[keys])


def mean_rows(mean: DataFrame, *keys: Any) -> DataFrame:
    """Return the rows with these first keys, by those that are left."""
    return cast("DataFrame", mean.loc[keys])


def mean_column(mean: Series[float], *keys: Any) -> Series[float]:
    """Return the values with these first keys, by those that are left."""
    return cast("Series[float]", cast("Any", mean).loc[keys])
