# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""Tables for people: plain, as wide as they need to be, and never so cut that rows look the same.

On a terminal they are fitted to its width: long names are shortened if they remain distinct, and
what is still too wide goes on in a second line. Elsewhere, as in pipes, nothing is shortened.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

from rich import box
from rich.table import Table
from rich.text import Text

from focus_planner.cli.console import PlainConsole
from focus_planner.core.text import printable

if TYPE_CHECKING:
    from rich.console import RenderableType

_GAP = 2  # cells between columns
_UNLIMITED = 10_000  # cells, of what is not for a terminal
_LEAST_NAME = 12  # cells; below that, names go on in a second line
_COMMON = 8  # characters at the beginning of all names that nobody needs to see again


def console_for(stream: TextIO) -> PlainConsole:
    """Return the console on which to print tables."""
    return PlainConsole(stream, None if stream.isatty() else _UNLIMITED)


def new_table(*headers: str, right: Collection[int] = (), title: str = "") -> Table:
    """Return a table without rows.

    Parameters
    ----------
    *headers : str
        None at all for a table without headers, to which columns are added.
    right : collection of int
        Indices of the columns that are flush right.
    title : str
    """
    table = Table(
        title=title or None,
        box=box.SIMPLE_HEAD,
        show_edge=False,
        pad_edge=False,
        padding=(0, _GAP - 1, 0, 0),  # beside the box's own
        show_header=bool(headers),
        title_justify="left",
        title_style="bold",
    )
    for index, header in enumerate(headers):
        table.add_column(header, justify="right" if index in right else "left", overflow="fold")
    return table


def add_named_rows(
    table: Table, rows: Sequence[tuple[str, Sequence[str | Text]]], console: PlainConsole
) -> None:
    """Add rows that begin with a name each, as long as the console has room for.

    Parameters
    ----------
    table : Table
    rows : sequence
        Names, and the cells beside them.
    console : PlainConsole
        To be printed on.
    """
    columns = [[len(str(column.header))] for column in table.columns[1:]]
    for _, cells in rows:
        for column, cell in zip(columns, cells, strict=True):
            column.append(len(str(cell)))
    room = console.width - sum(map(max, columns)) - _GAP * len(columns)
    room = max(room, _LEAST_NAME)
    names = told_apart([printable(name) for name, _ in rows], room)
    # Other columns go on in a second line first.
    table.columns[0].no_wrap = all(len(name) <= room for name in names)
    for name, (_, cells) in zip(names, rows, strict=True):
        shown: list[RenderableType] = [name, *cells]
        table.add_row(*shown)


def told_apart(names: Sequence[str], room: int) -> list[str]:
    """Return names of at most so many characters, if they can be that short and remain distinct.

    A name that fits is left as it is. If shortening would make two of them look the same, all are.

    >>> told_apart(["run", "20261127T130511Z-5f0c", "20261127T141200Z-77aa"], 14)
    ['run', '…T130511Z-5f0c', '…T141200Z-77aa']
    >>> told_apart(["camera_in_the_front", "camera_in_the_front_2"], 13)
    ['camera…_front', 'camera…ront_2']
    """
    long = list(dict.fromkeys(name for name in names if len(name) > room))
    head = (room - 1) // 2
    ways: list[Callable[[str], str]] = [
        lambda name: f"{name[:head]}…{name[len(name) - (room - 1 - head) :]}",
        lambda name: f"…{name[len(name) - (room - 1) :]}",
        lambda name: f"{name[: room - 1]}…",
    ]
    if len(long) > 1 and len({name[:_COMMON] for name in long}) == 1:
        ways.insert(0, ways.pop(1))
    short = {name for name in names if len(name) <= room}
    for way in ways:
        shortened = {name: way(name) for name in long}
        if len({*shortened.values()} - short) == len(long):
            return [shortened.get(name, name) for name in names]
    return list(names)


def path_names(paths: Iterable[Path]) -> list[str]:
    """Return what to call files or folders: their own names, and where needed the folders' before.

    The same file twice has the same name twice.
    """
    whole = [path.absolute() for path in paths]
    kept = dict.fromkeys(whole, 1)

    def name(path: Path) -> str:
        return "/".join(path.parts[-kept[path] :])

    while True:
        counts = Counter(map(name, kept))
        again = [p for p in kept if counts[name(p)] > 1 and kept[p] < len(p.parts)]
        if not again:
            return [name(path) for path in whole]
        for path in again:
            kept[path] += 1
