# Copyright 2026 focus_planner developers
#
# Licensed under the Apache License, Version 2.0 (the "License"); you may not use this file except
# in compliance with the License. You may obtain a copy of the License at
# http://www.apache.org/licenses/LICENSE-2.0
# Unless required by applicable law or agreed to in writing, software distributed under the License
# is distributed on an "AS IS" BASIS, WITHOUT WARRANTIES OR CONDITIONS OF ANY KIND, either express
# or implied. See the License for the specific language governing permissions and
# limitations under the License.

"""What a command says while it works."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator
from io import BytesIO, StringIO, TextIOWrapper
from pathlib import Path
from typing import Any

import pytest
from rich.cells import cell_len

from focus_planner.cli.console import PlainConsole
from focus_planner.cli.interrupts import ctrl_c
from focus_planner.cli.progress import show_progress, show_reading, show_share, shown
from focus_planner.cli.progress_line import ProgressLine
from focus_planner.core.progress import STAGES, Progress, Standing
from testing.clock import Clock
from testing.terminal import on_a_terminal

# Longer than any figure of a plan that is worth waiting for.
LATE = Standing("k_view, triples", 123456, None, 999.99, 123.45, 5678.9, 7200.0)


def test_a_share_is_shown_in_percent() -> None:
    said: list[str] = []
    show = show_share(said.append, "preparing scan.ply")
    for share in (0.0, 0.347, 0.999, 1.0):
        show(share)
    assert said == [f"preparing scan.ply: {percent}%" for percent in (0, 34, 99, 100)]


def test_a_plans_steps_are_shown() -> None:
    said: list[str] = []
    on_progress = show_progress(said.append, "2 of 3: ")
    assert on_progress(Progress("visibility", 4, math.nan, share=0.4))
    assert on_progress(Progress("em", 4, 250.0, 249.0))
    assert said[0].startswith("2 of 3: casting rays to plan on, 40%, ")
    assert said[1].startswith("2 of 3: searching one by one, step 4, cost 250.00, gap 0.40%,")


def test_a_plan_is_stopped_once_ctrl_c_was_typed(monkeypatch: pytest.MonkeyPatch) -> None:
    said: list[str] = []
    on_progress = show_progress(said.append)
    monkeypatch.setattr(ctrl_c, "typed", True)
    assert not on_progress(Progress("em", 1, 2.0))
    assert said == []


def test_compiling_ends_at_once_when_ctrl_c_was_typed(monkeypatch: pytest.MonkeyPatch) -> None:
    # There is no plan yet that could be returned.
    on_progress = show_progress(lambda _: None)
    compiling = Progress("compiling", 1, math.nan)
    assert on_progress(compiling)
    monkeypatch.setattr(ctrl_c, "typed", True)
    with pytest.raises(KeyboardInterrupt):
        on_progress(compiling)


def test_the_size_of_a_large_file_is_told(tmp_path: Path) -> None:
    said: list[str] = []
    for name, size in (("small.ply", 1000), ("large.ply", 512_000_000)):
        with (tmp_path / name).open("wb") as file:
            file.truncate(size)
        show_reading(said.append, tmp_path / name)(0.5)
    show_reading(said.append, tmp_path / "missing.ply")
    assert said == [
        f"reading {tmp_path / 'small.ply'}",
        f"reading {tmp_path / 'small.ply'}: 50%",
        f"reading {tmp_path / 'large.ply'}",
        f"reading {tmp_path / 'large.ply'}, 512 MB: 50%",
        f"reading {tmp_path / 'missing.ply'}",
    ]


# --- the line on a terminal --------------------------------------------------------------------


@pytest.fixture
def clock() -> Any:
    return Clock()


def line_of(clock: Any, width: int = 80) -> tuple[ProgressLine, Callable[[], str]]:
    """Return a line, not started, and what draws it."""
    line = ProgressLine(StringIO(), clock=clock, width=width)

    def drawn() -> str:
        stream = StringIO()
        PlainConsole(stream, width).print(line)
        (text,) = stream.getvalue().splitlines()
        assert cell_len(text.rstrip()) <= width - 3  # the terminal may add ^C, and does not wrap
        return text[2:].rstrip()  # without the spinner

    return line, drawn


def test_time_goes_on_between_steps(clock: Any) -> None:
    line, drawn = line_of(clock)
    line("drawing plan.png")
    assert drawn() == "drawing plan.png"
    clock.now += 1.5
    assert drawn() == "drawing plan.png  1.5 s"
    line.show_standing(Standing("em", 3, None, 250.0, elapsed=0.5, time_budget=60.0))
    clock.now += 11.5
    assert drawn() == "searching one by one  step 3  cost 250.00  12.0 s of 60 s"


def test_a_share_has_a_bar_and_keeps_its_place(clock: Any) -> None:
    line, drawn = line_of(clock)
    places = set()
    for share in (0.0, 0.05, 0.5, 1.0):
        line.show_share("preparing scan.ply", share)
        what, bar, percent = drawn().partition("  ")[0], drawn().count("━"), drawn()[-4:]
        assert (what, percent) == ("preparing scan.ply", f"{share:>4.0%}")
        assert abs(bar - 24 * share) <= 1
        places.add(len(drawn()))
    assert len(places) == 1
    clock.now += 2.0
    line.show_share("preparing scan.ply", 1.0)
    assert drawn().endswith("100%  2.0 s")


def test_compiling_is_a_stage_of_its_own(clock: Any) -> None:
    line, drawn = line_of(clock)
    standing = Standing("compiling", 34, 0.26, elapsed=21.5, expected=84.0)
    line.show_standing(standing)
    # The clock goes on while a kernel takes long.
    clock.now += 4.0
    assert re.fullmatch(r"compiling, once, about 90 s  [━╸╺ ]{24}   26%  25.5 s", drawn())


@pytest.mark.parametrize("stage", STAGES)
def test_all_figures_fit_into_80_columns(clock: Any, stage: str) -> None:
    line, drawn = line_of(clock)
    line.show_standing(Standing(stage, 123, None, 231.9, 231.2, 12.3, 60.0))
    told = f"{STAGES[stage]}  step 123  cost 231.90  gap 0.30%  12.3 s of 60 s"
    assert drawn() == told


@pytest.mark.parametrize("width", [26, 40, 60, 79, 80, 120])
def test_what_has_no_room_is_left_out(clock: Any, width: int) -> None:
    line, drawn = line_of(clock, width)
    line.show_standing(LATE, "12 of 345: ")
    assert drawn().endswith("5678.9 s of 7200 s")
    assert ("gap 87.65%" in drawn()) == (width >= 60)
    line.show_share("reading " + "a long name/" * 20, 0.5)
    assert "50%" in drawn()
    line("x" * 200)
    assert drawn().endswith("…")


def test_that_it_is_stopping_stays(clock: Any) -> None:
    line, drawn = line_of(clock, 40)
    line.stopping()
    line.show_standing(LATE)
    assert drawn() == "stopping; Ctrl-C again to stop now"


def test_names_do_not_steer_the_terminal(clock: Any) -> None:
    line, drawn = line_of(clock)
    line("reading a\x1b[2Jb\n[bold]:smile:")
    assert drawn() == r"reading a\x1b[2Jb [bold]:smile:"


def test_where_only_ascii_is_shown_it_keeps_to_that(clock: Any) -> None:
    stream = TextIOWrapper(BytesIO(), encoding="ascii", errors="backslashreplace")
    line = ProgressLine(stream, clock=clock, width=40)
    line.show_share("reading " + "a long name/" * 20, 0.5)
    PlainConsole(stream, 40).print(line)
    stream.seek(0)
    (text,) = stream.read().splitlines()
    assert "\\" not in text
    assert text.rstrip().endswith("50%")


def test_a_new_phrase_is_seen_at_once() -> None:
    stream = StringIO()
    line = ProgressLine(stream)
    line._live = live = Recorder()  # type: ignore[assignment]
    line("drawing")
    line.show_share("preparing", 0.1)
    line.show_share("preparing", 0.2)
    assert live.refreshed == 2


class Recorder:
    """Stands in for what draws."""

    refreshed = 0

    def refresh(self) -> None:
        self.refreshed += 1


def test_ctrl_c_ends_the_work_at_the_next_change(clock: Any) -> None:
    def check() -> None:
        raise KeyboardInterrupt

    line = ProgressLine(StringIO(), before_change=check, clock=clock)
    for change in (
        lambda: line("drawing"),
        lambda: line.show_share("preparing", 0.5),
        lambda: line.show_standing(LATE),
    ):
        with pytest.raises(KeyboardInterrupt):
            change()


ON_A_TERMINAL = """
import math
from focus_planner.cli.progress import show_progress, show_share, shown
from focus_planner.core.progress import Progress

with shown(quiet=False) as tell:
    tell("loading the planner")
    show_share(tell, "preparing scan.ply")(0.5)
    tell._live.refresh()
    show_progress(tell, "", 60.0)(Progress("k_view", 7, 250.0, 249.0))
    tell._live.refresh()
"""


@pytest.mark.processes
def test_on_a_terminal_it_is_one_line_that_goes() -> None:
    status, shown_ = on_a_terminal([], ON_A_TERMINAL)
    assert status == 0
    text = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", shown_)
    assert "loading the planner" in text
    assert re.search(r"preparing scan.ply  ━+.*  50%", text)
    assert re.search(r"in pairs  step 7  cost 250\.00  gap 0\.40%  \d\.\d s of 60 s", text)
    # It is never more than a line; the last is erased, and the cursor is there again.
    assert "\n" not in shown_.partition("60 s")[0]
    assert "\x1b[2K" in shown_[shown_.rindex("60 s") :]
    assert shown_.rindex("\x1b[?25h") > shown_.rindex("\x1b[?25l")


# --- where there is no terminal ----------------------------------------------------------------


@pytest.fixture(params=[False, True], ids=["piped", "quiet"])
def told_nothing(request: Any, capsys: Any) -> Iterator[Any]:
    """What to tell, where nobody wants to be told."""
    with shown(request.param) as tell:
        yield tell
    assert capsys.readouterr() == ("", "")


def test_nothing_is_shown(told_nothing: Any) -> None:
    told_nothing("reading")
    show_share(told_nothing, "preparing")(0.5)
    assert show_progress(told_nothing, "", 60.0)(Progress("em", 1, 2.0))


def test_ctrl_c_ends_the_work_there_too(told_nothing: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ctrl_c, "typed", True)
    with pytest.raises(KeyboardInterrupt):
        show_share(told_nothing, "preparing")(0.5)
    monkeypatch.setattr(ctrl_c, "typed", False)
