# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Tables and figures of results in Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Sequence


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table, its first column to the left and all others to the right."""
    lines = [header, ["---", *(["---:"] * (len(header) - 1))], *rows]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines) + "\n"


def percent(share: float, digits: int = 1) -> str:
    """Return ``−4.6 %`` for −0.046; a change that rounds to nothing has no sign."""
    text = f"{100 * share:.{digits}f}"
    return f"{text.removeprefix('-') if float(text) == 0 else text.replace('-', '−')} %"


def changed(change: float, digits: int = 1) -> str:
    """Return ``4.6 % less`` for −0.046, ``4.6 % more`` for 0.046."""
    return f"{percent(abs(change), digits)} {'less' if change < 0 else 'more'}"


def counted(number: int, noun: str) -> str:
    """Return ``1 subject`` or ``1,200 subjects``."""
    return f"{number:,} {noun}{'' if number == 1 else 's'}"
