# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.
"""What peers found on one problem."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from rich.table import Table


@dataclass(frozen=True)
class Row:
    """What a peer found: the cost of its plan, its bound if it has one, and its seconds."""

    peer: str
    cost: float
    lower_bound: float | None
    seconds: float


def peer_table(rows: Sequence[Row], title: str) -> Table:
    """Return a row per peer: each one's own gap, and its cost above the best bound of all."""
    table = Table("peer", "cost", "bound", "gap", "above the best bound", "seconds", title=title)
    best = max((row.lower_bound for row in rows if row.lower_bound is not None), default=None)
    for row in rows:
        bound = row.lower_bound
        table.add_row(
            row.peer,
            f"{row.cost:.3f}",
            "–" if bound is None else f"{bound:.3f}",
            "–" if bound is None else f"{1 - bound / row.cost:.4%}",
            "–" if best is None else f"{row.cost / best - 1:.4%}",
            f"{row.seconds:.2f}",
        )
    return table
