# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What an attack was, what was asked of the node, what was seen, and whether it held."""

from __future__ import annotations

import tempfile
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from benchmarks.guarantees import own_graph

_LONGEST = 700


@dataclass(frozen=True)
class Seen:
    """What was seen.

    Attributes
    ----------
    observed : str
    held : bool
        Whether it is what was asked.
    times : int
        How often the attack was repeated.
    """

    observed: str
    held: bool
    times: int = 1


@dataclass(frozen=True)
class Attack:
    """An attack, and what the node is asked to do about it."""

    what: str
    asked: str
    carry_out: Callable[[Path], Seen]


def attack(what: str, asked: str) -> Callable[[Callable[[Path], Seen]], Attack]:
    """Make an attack of a function, which gets a folder of its own."""
    return lambda carry_out: Attack(what, asked, carry_out)


def report(console: Console, title: str, attacks: list[Attack]) -> bool:
    """Carry out attacks and print what came of them; return whether all of them held."""
    table = Table("attack", "how many", "asked", "observed", "held", title=title)
    held = True
    with own_graph() as folder:
        for one in attacks:
            seen = _carried_out(one, Path(tempfile.mkdtemp(dir=folder)))
            observed, said = escape(_line(seen.observed)), "yes" if seen.held else "NO"
            what = escape(one.what)
            table.add_row(what, f"{seen.times:,}", escape(one.asked), observed, said)
            console.print(f"{said:3} {what}: {observed}", style="dim")
            held = held and seen.held
    console.print(table)
    return held


def _carried_out(one: Attack, folder: Path) -> Seen:
    try:
        return one.carry_out(folder)
    except (AssertionError, TimeoutError) as error:
        return Seen(str(error) or type(error).__name__, held=False)
    except Exception as error:  # noqa: BLE001 - an attack that fails must not cost the others
        traceback.print_exc()
        return Seen(f"{type(error).__name__}: {error}", held=False)


def _line(text: str) -> str:
    """Return a text in one line that a terminal can show."""
    line = "".join(c if c.isprintable() else repr(c)[1:-1] for c in text)
    return line if len(line) <= _LONGEST else f"{line[:_LONGEST]} …"
